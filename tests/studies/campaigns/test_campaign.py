"""Campaigns of real, short missions: taken up again, the same whoever makes them."""

from __future__ import annotations

import csv
import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from mrmg.errors import RunFolderError, UsageError
from mrmg.locking import locked
from mrmg.studies.campaigns.campaign import run_campaign
from mrmg.studies.campaigns.reading import Campaign, read_campaign
from mrmg.studies.campaigns.trial import make_trial
from mrmg.studies.engine import Engine

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture(scope="session")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """Four trials, of which one is refused, and one scene that has no plan."""
    file = tmp_path_factory.mktemp("campaign") / "short.yaml"
    file.write_text(
        f"scenes: [{SCENES}/one_goal.yaml, {SCENES}/goal_enclosed.yaml]\n"
        "controllers: pure_pursuit\ndisturbances: [none, default]\n"
    )
    return read_campaign(file)


@pytest.fixture(scope="session")
def made(campaign: Campaign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the campaign, made by one process; only to be read."""
    folder = tmp_path_factory.mktemp("made") / "campaign"
    run_campaign(campaign, folder, parquet=True)
    return folder


def test_the_table_has_a_row_for_each_trial(made: Path, campaign: Campaign) -> None:
    rows = list(csv.DictReader((made / "trials.csv").open()))
    assert [row["trial"] for row in rows] == [each.key for each in campaign.trials]
    assert [row["status"] for row in rows] == ["solved"] * 2 + ["infeasible"] * 2
    assert [row["feasible"] for row in rows] == ["true"] * 2 + ["false"] * 2
    assert [row["disturbance"] for row in rows] == ["none", "default"] * 2
    assert float(rows[0]["measured_J"]) != float(rows[1]["measured_J"]) > 0.0
    assert rows[0]["plan_digest"] == rows[1]["plan_digest"]
    assert "g1" in rows[2]["reason"]
    assert [row["causes"] for row in rows] == ["", "", "infeasible", "infeasible"]


def test_a_plan_that_trials_share_counts_in_each(made: Path) -> None:
    rows = list(csv.DictReader((made / "times.csv").open()))
    assert rows[0]["plan_s"] == rows[1]["plan_s"]
    for row in rows:
        parts_s = [float(row[f"{part}_s"] or 0) for part in ("plan", "verify", "drive")]
        assert float(row["total_s"]) >= sum(parts_s) > 0.0


def test_waiting_for_another_trial_does_not_count(tmp_path: Path) -> None:
    file = tmp_path / "two.yaml"
    file.write_text(f"scenes: {SCENES}/goal_enclosed.yaml\nseeds: [90002, 90003]\n")
    each = read_campaign(file).trials
    began = time.perf_counter()
    with ThreadPoolExecutor(2) as pool:
        made = list(pool.map(lambda one: make_trial(one.source, one.order), each))
    spent_s = time.perf_counter() - began
    assert sum(one["time_s"]["total"] for one in made) <= spent_s


def test_values_of_several_types_are_text_in_the_parquet_table(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    file = tmp_path / "mixed.yaml"
    parameters = "{time_limit: [null, 100], skip_unreachable: [true, false]}"
    file.write_text(f"scenes: {SCENES}/goal_enclosed.yaml\nparameters: {parameters}\n")
    run_campaign(read_campaign(file), tmp_path / "out", parquet=True)
    columns = parquet.read_table(tmp_path / "out" / "trials.parquet").to_pydict()
    assert columns["time_limit"] == ["null", "null", "100", "100"]
    assert columns["skip_unreachable"] == [True, False] * 2


def test_a_stopped_campaign_is_taken_up(
    campaign: Campaign, made: Path, tmp_path: Path
) -> None:
    def stop(done: int, trials: int, feasible: int, left_s: float | None) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_campaign(campaign, tmp_path, on_trial=stop)
    assert not (tmp_path / "trials.csv").exists()
    kept = sorted((tmp_path / "trials").iterdir())
    assert len(kept) == 3
    before = [path.stat().st_mtime_ns for path in kept]
    output: list[tuple[int, int, int, float | None]] = []
    run_campaign(campaign, tmp_path, on_trial=lambda *now: output.append(now))
    assert [path.stat().st_mtime_ns for path in kept] == before
    kept_before = [(1, 4, 1, None), (2, 4, 2, None), (3, 4, 2, None)]
    assert output == [*kept_before, (4, 4, 2, 0.0)]
    table = (tmp_path / "trials.csv").read_bytes()
    assert table == (made / "trials.csv").read_bytes()


@pytest.mark.slow
def test_the_number_of_workers_does_not_affect_the_table(
    campaign: Campaign, made: Path, tmp_path: Path
) -> None:
    run_campaign(campaign, tmp_path, engine=Engine(workers=2))
    table = (tmp_path / "trials.csv").read_bytes()
    assert table == (made / "trials.csv").read_bytes()


def test_a_cluster_does_not_affect_the_table(
    campaign: Campaign, made: Path, tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        engine = Engine(kind="dask", scheduler=cluster.scheduler_address)
        run_campaign(campaign, tmp_path, engine=engine)
    table = (tmp_path / "trials.csv").read_bytes()
    assert table == (made / "trials.csv").read_bytes()


def test_what_is_damaged_is_made_again(
    campaign: Campaign, made: Path, tmp_path: Path
) -> None:
    trials = tmp_path / "trials"
    trials.mkdir()
    (tmp_path / "campaign.json").write_text("{}")
    for path in (made / "trials").iterdir():
        (trials / path.name).write_bytes(path.read_bytes())
    broken, failed, whole, edited = sorted(trials.iterdir())
    broken.write_text('{"format": 1, "resu')
    content = json.loads(failed.read_text())
    content["result"]["status"] = "error"
    failed.write_text(json.dumps(content))
    edited.write_text(
        edited.read_text().replace('"goals_total": 1', '"goals_total": "x"')
    )
    before = whole.stat().st_mtime_ns
    run_campaign(campaign, tmp_path)
    assert whole.stat().st_mtime_ns == before
    table = (tmp_path / "trials.csv").read_bytes()
    assert table == (made / "trials.csv").read_bytes()


def test_foreign_and_busy_folders_are_refused(
    campaign: Campaign, tmp_path: Path
) -> None:
    with locked(tmp_path), pytest.raises(RunFolderError, match="another mrmg process"):
        run_campaign(campaign, tmp_path)
    (tmp_path / "thesis.txt").write_text("")
    with pytest.raises(UsageError, match="not a campaign folder"):
        run_campaign(campaign, tmp_path)
