"""The report: one page that stands alone and says what the files say."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from markupsafe import Markup

from mrmg import storage
from mrmg.energy.audit import audit
from mrmg.errors import RunFolderError
from mrmg.report import page as html
from mrmg.report.report import command, report_html, write_report
from mrmg.runs.arguments import RunArguments
from mrmg.runs.record import read_record
from mrmg.runs.summary import summary_of
from mrmg.scene.loading import dump_scene, load_scene
from mrmg.simulation.disturbance import Disturbance, RobotDisturbance
from mrmg.simulation.log import Contact
from mrmg.simulation.supervision import Event
from mrmg.studies.outcomes import Study, Trial, save_study
from mrmg.verification.verify import verify
from mrmg.viz.energy_plot import draw_energy
from mrmg.viz.overview import draw_overview

VOID = {"meta", "link", "img", "br", "hr", "input"}
STATISTICS = {
    "vertices": 120,
    "groups": 7,
    "router_calls": 2,
    "time_s": {"init": 0.1, "routing": 0.02, "first_solution": 0.2, "total": 0.25},
}


class Page(HTMLParser):
    """Parses strictly: every element is closed in order."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []
        self.headings: list[str] = []
        self.cells: list[str] = []
        self.words = ""
        self.feed(source)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs) -> None:
        if tag not in VOID:
            self.open.append(tag)
        if tag == "td":
            self.cells.append("")
        names = ("src", "href", "action", "data", "srcset", "poster")
        self.references += [value for name, value in attrs if name in names]

    def handle_endtag(self, tag) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data) -> None:
        if self.open and self.open[-1] == "h2":
            self.headings.append(data)
        if "td" in self.open:
            self.cells[-1] += data
        if not {"style", "script"} & {*self.open}:
            self.words += data


def page_of(folder: Path) -> Page:
    return Page((folder / "report.html").read_text())


@pytest.fixture
def mission(make_scene, make_plan, make_log, straight):
    scene = make_scene(
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}]
    )
    plan = make_plan(scene, {"r1": straight(12.0)}, {"r1": ("s", "g")})
    return scene, plan, make_log(scene, plan)


def fill(folder: Path, scene, plan, log) -> None:
    """Write all files of a run, as the pipeline does."""
    planning = {"status": "solved", "reason": "", "statistics": STATISTICS}
    storage.write_text(folder / "scene.yaml", dump_scene(scene))
    storage.write_json(folder / "planning.json", planning)
    storage.write_json(
        folder / "run.json", {"format": 1, "arguments": {"seed": plan.seed}}
    )
    plan.save(folder)
    log.save(folder)
    verdict, account = verify(scene, plan), audit(scene, plan, log)
    verdict.save(folder)
    account.save(folder)
    summary = summary_of(
        scene,
        planning,
        seed=plan.seed,
        plan=plan,
        verdict=verdict,
        log=log,
        audit=account,
    )
    storage.write_json(folder / "summary.json", summary)
    draw_overview(scene, plan, log, path=folder / "overview.png")
    draw_energy(scene, plan, log, path=folder / "energy.png")


def test_page_stands_alone_and_follows_the_reader_s_scheme(mission, tmp_path) -> None:
    fill(tmp_path, *mission)
    (tmp_path / "mission.mp4").write_bytes(b"video")
    write_report(tmp_path)
    source = (tmp_path / "report.html").read_text()
    page = Page(source)
    assert set(page.references) == {"data:,", "mission.mp4"}
    assert not re.search(r"@import|url\(|fetch\(|XMLHttpRequest|import\(", source)
    assert "prefers-color-scheme: dark" in source


def test_the_library_s_licence_goes_with_it(mission, tmp_path) -> None:
    fill(tmp_path, *mission)
    write_report(tmp_path)
    source = (tmp_path / "report.html").read_text()
    assert "The MIT License" in source
    assert "Copyright (c) 2022 Leon Sorokin" in source


def test_data_cannot_end_the_element_that_holds_it() -> None:
    data = {"name": "</script><b>'\"&"}
    source = html.page("<t>", Markup("<p>here</p>"), data=data)
    assert Page(source).open == []
    held = re.search(r'id="data">(.*?)</script>', source, re.DOTALL)
    assert held is not None
    assert json.loads(held.group(1)) == data


def test_page_of_a_good_run_says_what_the_files_say(mission, tmp_path) -> None:
    scene, plan, log = mission
    fill(tmp_path, scene, plan, log)
    write_report(tmp_path)
    page = page_of(tmp_path)
    account = audit(scene, plan, log)
    assert "Mission accomplished: 1 robot visited the goal" in page.words
    assert page.headings == [
        "Map",
        "Timeline",
        "State of charge",
        "Energy",
        "Energy by terrain",
        "Tours",
        "Tracking error",
        "Distances",
        "Checks",
        "Planner",
        "Reproduce",
    ]
    planned = f"{plan.ledger.total_J(robot='r1') / 1000:.2f} kJ"
    measured = f"{account.measured.total_J(robot='r1') / 1000:.2f} kJ"
    assert page.cells[3] == planned
    assert page.cells[5] == measured
    first = page.cells.index("⚡ station")
    assert page.cells[first - 2 : first] == ["1", "s"]
    assert page.cells[first + 1] == f"{plan.visits[0].time_s:.1f} s"
    assert page.cells[first + 2] == f"{account.visits[0].time_s:.1f} s"
    routing = page.cells.index("Time of the discrete solver")
    assert page.cells[routing + 1] == "0.020 s (8 % of all)"
    assert scene.digest in page.words


def test_the_bound_is_set_against_the_plan_it_was_computed_for(
    mission, tmp_path
) -> None:
    fill(tmp_path, *mission)
    record = read_record(tmp_path)
    objective = {**record.summary["plan"]["objective"], "bound": 1.0}
    figures = {**record.summary["plan"], "objective": objective, "gap": 0.204}

    def page_with(**changes) -> Page:
        plan = {**figures, **changes.pop("plan", {})}
        execution = {**record.summary["execution"], **changes}
        summary = {**record.summary, "plan": plan, "execution": execution}
        return Page(report_html(replace(record, summary=summary)))

    assert "whole fleet; at most 20 % above the least" in page_with().words
    assert "planned anew" not in page_with().words
    anew = page_with(plan={"cost_J": 1.5 * figures["cost_J"]}, replans=1)
    assert "above the least" not in anew.words
    assert "charge; planned anew once, see Timeline." in anew.words


def test_rows_of_a_tour_are_those_of_their_targets(missing, make_log, tmp_path) -> None:
    scene, plan = missing()
    half = RobotDisturbance(robot="r1", capacity=-0.5)
    disturbance = Disturbance(seed=0, robots=(half,))
    log = replace(make_log(scene, plan), disturbance=disturbance)
    fill(tmp_path, scene, plan, log)
    write_report(tmp_path)
    cells = page_of(tmp_path).cells
    first = cells.index("h")
    missed, reached = cells[first - 1 : first + 8], cells[first + 8 : first + 17]
    assert missed == ["1", "h", "", "not reached", "not reached", "", "", "", ""]
    account = audit(scene, plan, log)
    (visit,) = account.visits
    measured_J = sum(e.energy_J for e in account.measured.entries if e.target == "g")
    assert reached[:3] == ["2", "g", "goal"]
    assert reached[4] == f"{visit.time_s:.1f} s"
    assert reached[6] == f"{measured_J / 1000:.2f} kJ"
    assert reached[8] == f"{visit.energy_J / 100:.1f} %"  # of 10 kJ


def test_page_of_a_failed_run_names_the_reasons(mission, tmp_path) -> None:
    scene, plan, log = mission
    contact = Contact(time_s=3.0, robot="r1", other="wall<1>", x_m=1.0, y_m=2.0)
    fill(tmp_path, scene, plan, replace(log, contacts=(contact,)))
    write_report(tmp_path)
    page = page_of(tmp_path)
    assert "Mission failed: r1 touched wall<1> at 3.00 s" in page.words
    assert "Mission accomplished" not in page.words


@pytest.mark.parametrize("done", [True, False])
def test_page_says_in_its_banner_who_broke_down_and_in_tours_who_was_not_used(
    make_scene, make_plan, make_log, straight, tmp_path, done: bool
) -> None:
    robots = [
        {"id": f"r{n}", "model": "car", "pose": [5, 13 - 3 * n, 0]} for n in (1, 2, 3)
    ]
    scene = make_scene(robots=robots)
    controls = {"r1": straight(12.0), "r2": straight(4.0), "r3": []}
    plan = make_plan(scene, controls, {"r1": ("g",), "r2": (), "r3": ()})
    event = Event(time_s=4.0, cause="fault", robot="r2", action="stop", message="r2!")
    log = replace(make_log(scene, plan), events=(event,))
    if not done:
        touch = Contact(time_s=3.0, robot="r1", other="wall", x_m=1.0, y_m=2.0)
        log = replace(log, contacts=(touch,))
    fill(tmp_path, scene, plan, log)
    write_report(tmp_path)
    source = (tmp_path / "report.html").read_text()
    banner = source[source.index('id="verdict"') :].split("</p>")[0]
    assert ("Mission accomplished" in banner) is done
    assert "r2 broke down at 4.0 s" in banner
    assert ("1 of 3 robots visited the goal" in banner) is done
    words = page_of(tmp_path).words
    assert "r3 (not used)" in words
    assert "not used: stays where it is" in words
    assert "r2 (broken down)" in words


def test_a_mission_of_finishes_alone_is_told_by_them(
    make_scene, make_plan, make_log, straight, tmp_path
) -> None:
    finish = {"circle": {"center": [13, 10], "radius": 0.5}}
    robots = [{"id": "r1", "model": "car", "pose": [5, 10, 0], "finish": finish}]
    scene = make_scene(goals=[], robots=robots)
    plan = make_plan(scene, {"r1": straight(8.0)}, {"r1": ()})
    fill(tmp_path, scene, plan, make_log(scene, plan))
    write_report(tmp_path)
    words = page_of(tmp_path).words
    assert "1 robot reached its finish without contact" in words
    assert "drives to its finish" in words
    assert "not used" not in words


def test_page_of_an_infeasible_mission_has_the_reason_and_the_map(
    make_scene, tmp_path
) -> None:
    scene = make_scene()
    planning = {
        "status": "infeasible",
        "reason": "goal 'g' cannot be reached by any robot",
        "statistics": {"vertices": 0},
    }
    storage.write_text(tmp_path / "scene.yaml", dump_scene(scene))
    storage.write_json(tmp_path / "planning.json", planning)
    storage.write_json(tmp_path / "summary.json", summary_of(scene, planning, seed=5))
    draw_overview(scene, path=tmp_path / "overview.png")
    write_report(tmp_path)
    page = page_of(tmp_path)
    assert "Infeasible: goal 'g' cannot be reached by any robot" in page.words
    assert page.headings == ["Map", "Planner", "Reproduce"]
    assert "--seed 5" in page.words


def test_command_names_a_shipped_scene_only_where_it_is_the_same(
    mission, tmp_path
) -> None:
    fill(tmp_path, *mission)
    record = read_record(tmp_path)
    assert command(record) == "mrmg run scene.yaml --seed 3"
    shipped = replace(record, scene=load_scene("quickstart"))
    assert command(shipped) == "mrmg run quickstart --seed 3"
    edited = replace(shipped, scene=replace(shipped.scene, time_limit_s=900.0))
    assert command(edited) == "mrmg run scene.yaml --seed 3"
    asked = RunArguments(profile="paper", budget_s=2.5)
    assert command(replace(record, arguments=asked)) == (
        "mrmg run scene.yaml --seed 3 --profile paper --budget 2.5"
    )


def test_a_folder_without_a_plan_is_refused(tmp_path) -> None:
    with pytest.raises(RunFolderError, match="not a run folder: it has no run.json"):
        write_report(tmp_path)
    storage.write_json(tmp_path / "run.json", {"format": 1, "arguments": {}})
    with pytest.raises(RunFolderError, match="the run was stopped early; 'mrmg run"):
        write_report(tmp_path)
    with pytest.raises(RunFolderError, match="no such folder"):
        write_report(tmp_path / "absent")


def test_a_run_that_was_not_summed_up_has_a_report_all_the_same(
    mission, tmp_path
) -> None:
    fill(tmp_path, *mission)
    write_report(tmp_path)
    whole = (tmp_path / "report.html").read_text()
    (tmp_path / "summary.json").unlink()
    write_report(tmp_path)
    assert (tmp_path / "report.html").read_text() == whole


def test_trials_under_disturbances_have_a_section(mission, tmp_path) -> None:
    scene, plan, log = mission
    fill(tmp_path, scene, plan, log)
    write_report(tmp_path)
    assert "Robustness" not in page_of(tmp_path).headings
    good = Trial(
        seed=0,
        feasible=True,
        causes=(),
        reasons=(),
        goals_visited=1,
        charge_fraction=0.21,
        charge_J=4200.0,
        charge_robot="r1",
        obstacle_clearance_m=1.234,
        robot_distance_m=None,
        tracking_max_m=0.03,
        duration_s=60.0,
        log_digest="0",
    )
    bad = replace(
        good, seed=8, feasible=False, causes=("battery empty",), charge_fraction=-0.034
    )
    for disturb in ("", "rolling=+30%"):
        study = Study(options={"disturb": disturb}, trials=(good, good, good, bad))
        save_study(tmp_path, scene, plan, study)
    write_report(tmp_path)
    page = page_of(tmp_path)
    assert "Robustness" in page.headings
    for cell in (
        "default disturbances",
        "default disturbances, rolling=+30%",
        "3 of 4",
        "30.1 to 95.4 %",
        "-3.4 %",
        "1.23 m",
        "battery empty 1",
    ):
        assert cell in page.cells, cell
    assert "mrmg execute RUN --disturb rolling=+30% --disturb-seed 8" in page.words


def test_a_disturbed_run_is_reproduced_with_its_disturbance(mission, tmp_path) -> None:
    scene, plan, log = mission
    fill(tmp_path, scene, plan, log)
    arguments = RunArguments(disturb="rolling=+30%", disturb_seed=7)
    record = replace(read_record(tmp_path), arguments=arguments)
    assert command(record).endswith("--disturb rolling=+30% --disturb-seed 7")
    by_default = replace(record, arguments=RunArguments(disturb="", disturb_seed=2))
    assert command(by_default).endswith("--disturb --disturb-seed 2")
