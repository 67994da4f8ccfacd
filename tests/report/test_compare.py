"""Comparisons say what the runs' files say, side by side."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrmg import storage
from mrmg.cli.main import main
from mrmg.energy.audit import audit
from mrmg.energy.ledger import EnergyLedger
from mrmg.errors import ExitCode, RunFolderError, UsageError
from mrmg.plans import DRIVEN_PLAN, Plan
from mrmg.report.compare import Row, compare_runs
from mrmg.report.compare_page import comparison_html
from mrmg.report.report import report_html
from mrmg.runs import pipeline
from mrmg.runs.record import read_record
from mrmg.scene.loading import dump_scene, load_scene
from mrmg.simulation.log import ExecutionLog
from mrmg.verification.verify import verify


def data_of(page: str) -> dict:
    return json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL).group(1))


def made_one(run: Path, name: str = "plan") -> None:
    """Make plan and log those of the scene that lies beside them."""
    digest = load_scene(run / "scene.yaml").digest
    replace(Plan.load(run, name), scene_digest=digest).save(run, name)
    plan_digest = Plan.load(run, name).digest
    log = ExecutionLog.load(run)
    replace(log, scene_digest=digest, plan_digest=plan_digest).save(run)


def test_measures_come_with_their_difference_and_counts_without() -> None:
    alike = (False, True)
    energy = Row("energy", "kJ", (10.0, 11.0, None), 1, (*alike, True))
    assert energy.cells() == ["10.0 kJ", "11.0 kJ (+10.0 %)", "–"]
    less = Row("energy", "kJ", (10.0, 9.0), 1, alike)
    assert less.cells() == ["10.0 kJ", "9.0 kJ (−10.0 %)"]
    assert Row("goals", "", (4.0, 5.0), 0, alike).cells() == ["4", "5"]
    assert Row("lag", "s", (0.0, 5.0), 0, alike).cells() == ["0 s", "5 s"]
    assert Row("scene", "", ("a", "b"), 0, alike).cells() == ["a", "b"]


def test_only_runs_of_one_scene_come_with_differences(
    quickstart_run: Path, own_run: Path
) -> None:
    some = Row("energy", "kJ", (10.0, 9.0, 8.0), 0, (False, False, True))
    assert some.cells() == ["10 kJ", "9 kJ", "8 kJ (−20.0 %)"]
    scene = own_run / "scene.yaml"
    scene.write_text(scene.read_text().replace("reserve: 0.05", "reserve: 0.04"))
    made_one(own_run)
    rows = {row.name: row for row in compare_runs([quickstart_run, own_run]).rows}
    assert "(" not in rows["planned energy"].cells()[1]
    names = rows["scene"].cells()
    assert names[0] != names[1]
    assert all(name.startswith("quickstart (") for name in names)


def test_maps_have_a_colour_for_each_robot(quickstart_run: Path, own_run: Path) -> None:
    fleet = "\n".join(
        f"- {{id: extra{at}, model: car, pose: [{30 + 3 * at}, 2, 0]}}"
        for at in range(3)
    )
    scene = own_run / "scene.yaml"
    scene.write_text(re.sub(r"robots:\n", f"robots:\n{fleet}\n", scene.read_text()))
    for name in ("plan.json", "log.json"):
        (own_run / name).unlink()
    page = comparison_html(compare_runs([quickstart_run, own_run]))
    used = {int(at) for at in re.findall(r"var\(--r(\d+)\)", page)}
    assert max(used) == 4
    assert all(f"--r{at}:#" in page for at in used)


def test_figures_are_those_of_the_summaries(
    quickstart_run: Path, own_run: Path
) -> None:
    comparison = compare_runs([quickstart_run, own_run])
    summary = json.loads((own_run / "summary.json").read_text())
    values = {row.name: row.values for row in comparison.rows}
    energy_kJ = summary["energy"]["measured_J"] / 1000.0
    assert values["simulated energy"] == pytest.approx((energy_kJ, energy_kJ))
    assert values["outcome"] == ("accomplished", "accomplished")
    assert values["goals visited"] == (4.0, 4.0)
    assert comparison.names == ("quickstart", "run")


def test_courses_end_at_the_audit_s_figures(
    quickstart_run: Path, own_run: Path
) -> None:
    comparison = compare_runs([quickstart_run, own_run])
    charts = {
        item["id"]: item for item in data_of(comparison_html(comparison))["charts"]
    }
    summary = json.loads((own_run / "summary.json").read_text())
    for number in (0, 1):
        used = charts["used"]["series"][number]["values"]
        wanted = summary["energy"]["measured_J"] / 1000.0
        assert used[-1] == pytest.approx(wanted, abs=2e-3)
        assert charts["goals"]["series"][number]["values"][-1] == 4
        least = min(charts["lowest"]["series"][number]["values"])
        assert least == pytest.approx(
            100 * summary["energy"]["min_charge_fraction"], abs=0.1
        )


def test_energy_drawn_grows_while_charging(
    make_scene, make_plan, make_log, straight, tmp_path: Path
) -> None:
    battery = {"capacity_J": 20000, "reserve": 0.05, "charging_power": 900}
    robot = {"id": "r1", "model": "car", "pose": [5, 10, 0]}
    scene = make_scene(
        battery=battery,
        stations=[{"id": "s", "circle": {"center": [10, 10], "radius": 1}}],
        robots=[{**robot, "start_energy": {"fraction": 0.5}}],
    )
    plan = make_plan(scene, {"r1": straight(12.0)}, {"r1": ("s", "g")})
    log = make_log(scene, plan)
    times = dict.fromkeys(("init", "routing", "first_solution", "total"), 0.1)
    statistics = {"vertices": 1, "groups": 1, "router_calls": 1, "time_s": times}
    planning = {"status": "solved", "reason": "", "statistics": statistics}
    for name in ("planned", "driven"):
        folder = tmp_path / name
        storage.write_text(folder / "scene.yaml", dump_scene(scene))
        storage.write_json(folder / "planning.json", planning)
        plan.save(folder)
        verify(scene, plan).save(folder)
    log.save(tmp_path / "driven")
    account = audit(scene, plan, log)
    account.save(tmp_path / "driven")
    comparison = compare_runs([tmp_path / "planned", tmp_path / "driven"])
    page = comparison_html(comparison)
    used, *_ = (item["series"] for item in data_of(page)["charts"])
    drawn_J = plan.ledger.total_J(), account.measured.total_J()
    for line, total_J in zip(used, drawn_J, strict=True):
        assert line["values"][-1] == pytest.approx(total_J / 1000, abs=2e-3)
        assert np.diff(line["values"]).min() > -0.02  # but for what braking feeds back
    assert "energy.png" not in page


def test_a_shorter_run_s_lines_end_with_it(quickstart_run: Path, own_run: Path) -> None:
    log = ExecutionLog.load(own_run)
    half = len(log.time_s) // 2
    replace(
        log,
        time_s=log.time_s[:half],
        clock_s=log.clock_s[:half],
        state=log.state[:, :half],
        reference=log.reference[:, :half],
        work_J=log.work_J[:, : half - 1],
    ).save(own_run)
    data = data_of(comparison_html(compare_runs([quickstart_run, own_run])))
    after = [time_s > log.time_s[half - 1] for time_s in data["time_s"]]
    for item in data["charts"]:
        long, short = (line["values"] for line in item["series"])
        assert None not in long
        assert [value is None for value in short] == after


def test_runs_of_one_name_are_told_apart_by_their_folders(
    quickstart_run: Path, tmp_path: Path
) -> None:
    import shutil

    folders = [tmp_path / "a" / "run", tmp_path / "b" / "run"]
    for folder in folders:
        shutil.copytree(quickstart_run, folder)
    assert compare_runs(folders).names == ("a/run", "b/run")


def test_a_run_without_a_plan_can_be_compared(
    quickstart_run: Path, walled_scene: Path, tmp_path: Path
) -> None:
    pipeline.run(walled_scene, out=tmp_path / "run", video=None)
    comparison = compare_runs([quickstart_run, tmp_path / "run"])
    values = {row.name: row.values for row in comparison.rows}
    assert values["outcome"] == ("accomplished", "infeasible")
    assert values["planned energy"][1] is None
    assert len(data_of(comparison_html(comparison))["charts"][0]["series"]) == 1


def test_fewer_than_two_runs_are_refused(quickstart_run: Path, tmp_path: Path) -> None:
    for folders in ([quickstart_run], [quickstart_run, quickstart_run]):
        with pytest.raises(UsageError, match="at least two"):
            compare_runs(folders)
    with pytest.raises(RunFolderError, match="run.json"):
        compare_runs([quickstart_run, tmp_path])


def test_the_command_prints_the_table_and_writes_the_page(
    quickstart_run: Path, own_run: Path, tmp_path: Path, capsys
) -> None:
    page = tmp_path / "c.html"
    runs = [str(quickstart_run), str(own_run)]
    assert main(["compare", *runs, "-o", str(page)]) == ExitCode.OK
    output = capsys.readouterr().out
    assert "simulated energy" in output
    assert output.endswith(f"{page}\n")
    assert "simulated energy" in page.read_text()
    assert main(["compare", *runs, "-o", str(page), "--json"]) == ExitCode.OK
    assert json.loads(capsys.readouterr().out)["runs"] == ["quickstart", "run"]


def test_missions_that_take_no_time_can_be_shown(
    quickstart_run: Path, tmp_path: Path, capsys
) -> None:
    scene = str(Path(__file__).parents[1] / "scenes" / "no_goals.yaml")
    run, page = str(tmp_path / "run"), tmp_path / "c.html"
    assert main(["plan", scene, "--out", run]) == ExitCode.OK
    assert main(["report", run]) == ExitCode.MISSION_FAILED  # not driven yet
    for kind in ("map", "energy", "timeline"):
        figure = ["--kind", kind, "-o", str(tmp_path / f"{kind}.pdf")]
        assert main(["figure", run, *figure]) == ExitCode.OK
    runs = [run, str(quickstart_run)]
    assert main(["compare", *runs, "-o", str(page)]) == ExitCode.OK
    assert "stays where it is" in (tmp_path / "run" / "report.html").read_text()
    assert "Traceback" not in capsys.readouterr().err


def test_what_differs_is_a_column_and_the_same_scene_is_one(
    quickstart_run: Path, tmp_path: Path
) -> None:
    other = {"objective": "makespan", "time_limit": 500, "controller": "tvlqr"}
    pipeline.run("quickstart", out=tmp_path / "run", video=None, **other)
    comparison = compare_runs([quickstart_run, tmp_path / "run"])
    assert comparison.differences == {
        "objective": ("energy", "makespan"),
        "time limit": ("–", "500 s"),
        "controller": ("mpc", "tvlqr"),
    }
    head, first, second = comparison.difference_table()
    assert head == ["run", "objective", "time limit", "controller"]
    assert (first[1], second[1]) == ("energy", "makespan")
    output = comparison.to_json()["differences"]
    assert {"name": "objective", "values": ["energy", "makespan"]} in output
    assert "tvlqr" in comparison.to_text().splitlines()[2]
    assert "<td>tvlqr</td>" in comparison_html(comparison)
    rows = {row.name: row.cells() for row in comparison.rows}
    assert rows["scene"] == ["quickstart", "quickstart"]
    assert rows["planned energy"][1].endswith(" %)")


def test_arguments_are_told_as_the_command_line_takes_them(
    quickstart_run: Path, own_run: Path
) -> None:
    record = json.loads((own_run / "run.json").read_text())
    arguments = record["arguments"]
    del arguments["soc_margin"]
    arguments |= {"margins": {"obstacle": 0.1, "robot": 0.3}, "spare": 0.2}
    (own_run / "run.json").write_text(json.dumps(record))
    assert compare_runs([quickstart_run, own_run]).differences == {
        "soc margin": ("–", "0.2"),
        "margins": ("–", "obstacle=0.1,robot=0.3"),
    }


def test_equal_runs_differ_in_nothing(quickstart_run: Path, own_run: Path) -> None:
    comparison = compare_runs([quickstart_run, own_run])
    assert comparison.differences == {}
    assert "same scene and parameters" in comparison_html(comparison)


def test_replanned_runs_have_the_figures_of_their_reports(
    quickstart_run: Path, own_run: Path
) -> None:
    plan = Plan.load(own_run)
    doubled = [
        replace(item, energy_J=2 * item.energy_J) for item in plan.ledger.entries
    ]
    joined = replace(plan, ledger=EnergyLedger(tuple(doubled)))
    joined.save(own_run, DRIVEN_PLAN)
    made_one(own_run, DRIVEN_PLAN)
    found = {row.name: row for row in compare_runs([quickstart_run, own_run]).rows}
    assert found["planned energy"].values[1] == pytest.approx(joined.cost_J / 1000)
    assert found["above the bound"].values[1] is None
    cell = found["planned energy"].cells()[1].split(" (")[0]
    assert cell in report_html(read_record(own_run))
