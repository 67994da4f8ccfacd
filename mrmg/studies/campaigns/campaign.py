"""Trials of a campaign: made where they are missing, and put together in tables."""

from __future__ import annotations

import csv
import io
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.extras import import_extra
from mrmg.report.campaign_page import campaign_html
from mrmg.runs.folder import opened_folder
from mrmg.studies.campaigns.figures import campaign_figures, table_row, times_row
from mrmg.studies.campaigns.reading import Campaign
from mrmg.studies.campaigns.trial import ERROR, make_trial
from mrmg.studies.engine import Engine
from mrmg.studies.trials import Job, completed_trials

OnCampaignTrial = Callable[[int, int, int, float | None], None]
"""Called with (trials done, trials in all, feasible ones, time left [s] or None)."""

TRIAL_FORMAT = 1

CAMPAIGN_FILE = "campaign.json"
"""What marks a folder as that of a campaign."""

TABLE, TIMES, PARQUET = "trials.csv", "times.csv", "trials.parquet"
SUMMARY, PAGE = "summary.json", "summary.html"
TRIALS, RUNS = "trials", "runs"


def run_campaign(
    campaign: Campaign,
    folder: Path,
    *,
    engine: Engine | None = None,
    parquet: bool = False,
    on_trial: OnCampaignTrial | None = None,
) -> dict[str, Any]:
    """Make what is missing of a campaign, and its tables and summary page.

    Args:
        campaign: what is made.
        folder: of trials, tables and page.
        engine: who makes trials; this process if None.
        parquet: whether the table is wanted as a Parquet file, too.
        on_trial: called after every trial, for those of earlier commands first.

    Returns:
        The content of `summary.json`.

    Raises:
        UsageError: if the folder holds something else.
        RunFolderError: if another process is working in it.
        MachineError: if trials cannot be made; what is done is kept.
    """
    if parquet:
        import_extra("pyarrow.parquet", extra="parquet", purpose="writes Parquet files")
    with opened_folder(folder, CAMPAIGN_FILE, kind="campaign", places=(TRIALS, RUNS)):
        document = {"format": TRIAL_FORMAT, **campaign.document}
        storage.write_json(folder / CAMPAIGN_FILE, document)
        made = _all_made(campaign, folder, engine or Engine(), on_trial)
        pairs = list(zip(campaign.trials, made, strict=True))
        rows = [table_row(*pair) for pair in pairs]
        times = [times_row(*pair) for pair in pairs]
        storage.write_text(folder / TABLE, _csv(rows))
        storage.write_text(folder / TIMES, _csv(times))
        if parquet:
            _write_parquet(rows, folder / PARQUET)
        factors = [trial.factors for trial in campaign.trials]
        figures = campaign_figures(campaign.name, factors, rows, times)
        storage.write_json(folder / SUMMARY, figures)
        storage.write_text(folder / PAGE, campaign_html(figures))
    return figures


def _all_made(
    campaign: Campaign, folder: Path, engine: Engine, on_trial: OnCampaignTrial | None
) -> list[dict[str, Any]]:
    """Return the content of the files of all trials, in their order."""
    trials = {trial.key: trial for trial in campaign.trials}
    jobs = [
        Job(path=folder / TRIALS / f"{key}.json", shared=each.source, item=each.order)
        for key, each in trials.items()
    ]

    def run_folder(job: Job) -> Path:
        return folder / RUNS / job.path.stem

    def check(job: Job, content: Any) -> None:
        damaged = content["digest"] != _digest(content)
        if damaged or content["result"]["status"] == ERROR:
            raise ValueError("to be made anew")
        if job.item.with_run and not run_folder(job).exists():
            raise ValueError("its run folder is missing")

    def keep(job: Job, made: dict[str, Any]) -> dict[str, Any]:
        files = made.pop("files", None)
        if files:
            _write_run(run_folder(job), files)
        factors = trials[job.path.stem].factors
        content = {"format": TRIAL_FORMAT, "factors": factors, **made}
        return {**content, "digest": _digest(content)}

    found: dict[str, dict[str, Any]] = {}
    feasible = 0
    for number, content, left_s in completed_trials(
        jobs, make_trial, engine, check=check, keep=keep
    ):
        found[jobs[number].path.stem] = content
        feasible += content["result"]["feasible"]
        if on_trial is not None:
            on_trial(len(found), len(jobs), feasible, left_s)
    return [found[trial.key] for trial in campaign.trials]


def _digest(content: Mapping[str, Any]) -> str:
    """Return a fingerprint of what a trial's file states."""
    stated = [content[name] for name in ("format", "result", "time_s")]
    return storage.digest(storage.canonical_json(stated))


def _write_run(folder: Path, files: Mapping[str, bytes]) -> None:
    """Put a run folder in its place as a whole."""
    unfinished = storage.unfinished_path(folder)
    for name, content in files.items():
        storage.write_bytes(unfinished / name, content)
    shutil.rmtree(folder, ignore_errors=True)
    unfinished.replace(folder)


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a table as CSV; nothing where there is no value."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _cell(value) for name, value in row.items()})
    return text.getvalue()


def _cell(value: Any) -> Any:
    if isinstance(value, bool):
        return str(value).lower()
    return "; ".join(value) if isinstance(value, list) else value


def _write_parquet(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    arrow = import_extra("pyarrow", extra="parquet", purpose="writes Parquet files")
    parquet = import_extra("pyarrow.parquet", extra="parquet", purpose="")
    columns = {name: _column([row[name] for row in rows]) for name in rows[0]}
    with storage.atomic_path(path) as temporary:
        parquet.write_table(arrow.table(columns), temporary)


def _column(values: list[Any]) -> list[Any]:
    """Return a column of one type: text where a factor's values are of several."""
    kinds = {type(value) for value in values if value is not None}
    if len(kinds) > 1 and kinds != {int, float}:
        return [None if value is None else str(_cell(value)) for value in values]
    return values
