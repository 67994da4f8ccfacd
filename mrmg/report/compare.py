"""Runs side by side: a table of their figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg.errors import UsageError
from mrmg.report.compare_parameters import (
    MISSING,
    differences,
    parameters,
    problem_digest,
)
from mrmg.runs.record import RunRecord, read_record

_MEASURES = ("kJ", "s", "m", "cm")


@dataclass(frozen=True, slots=True)
class Row:
    """One figure of every run.

    Attributes:
        name: what the figure is.
        unit: of the values; "" for texts.
        values: one per run; None where a run has none.
        digits: after the decimal point.
        comparable: whether each run's value may be set against the first run's.
    """

    name: str
    unit: str
    values: tuple[float | str | None, ...]
    digits: int
    comparable: tuple[bool, ...]

    def cells(self) -> list[str]:
        """Return the values as text; measures after the first with their difference."""
        first, measured = self.values[0], self.unit in _MEASURES
        texts = []
        for value, alike in zip(self.values, self.comparable, strict=True):
            if value is None or isinstance(value, str):
                texts.append(value or MISSING)
                continue
            text = f"{value:.{self.digits}f} {self.unit}".rstrip()
            if measured and alike and isinstance(first, float) and first:
                text += f" ({100.0 * (value - first) / abs(first):+.1f} %)"
            texts.append(text.replace("-", "−"))
        return texts


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Some runs, and what they have in common to be compared by.

    Attributes:
        names: what distinguishes the runs apart, one per run.
        records: of the runs.
        rows: their figures.
        differences: what they were made with, as far as it differs, by its name: one
            text per run.
    """

    names: tuple[str, ...]
    records: tuple[RunRecord, ...]
    rows: tuple[Row, ...]
    differences: Mapping[str, tuple[str, ...]]

    def to_json(self) -> dict[str, Any]:
        """Return names, differences and figures as JSON data."""
        return {
            "runs": list(self.names),
            "differences": [
                {"name": name, "values": list(texts)}
                for name, texts in self.differences.items()
            ],
            "figures": [
                {"name": row.name, "unit": row.unit, "values": list(row.values)}
                for row in self.rows
            ],
        }

    def difference_table(self) -> list[list[str]]:
        """Return head and lines of a table: a line per run, a column per difference."""
        runs = zip(self.names, *self.differences.values(), strict=True)
        return [["run", *self.differences], *map(list, runs)]

    def to_text(self) -> str:
        """Return the tables as text with aligned columns."""
        table = [["", *self.names], *([row.name, *row.cells()] for row in self.rows)]
        if not self.differences:
            return _aligned(table)
        return f"{_aligned(self.difference_table())}\n\n{_aligned(table)}"


def _aligned(table: Sequence[Sequence[str]]) -> str:
    first, *others = (max(map(len, column)) for column in zip(*table, strict=True))
    lines = []
    for name, *cells in table:
        lines.append("  ".join([name.ljust(first), *map(str.rjust, cells, others)]))
    return "\n".join(line.rstrip() for line in lines)


def compare_runs(folders: Sequence[Path], *, trust_code: bool = False) -> Comparison:
    """Read run folders to compare.

    Args:
        folders: at least two, none twice.
        trust_code: whether robot models may bring Python code (`loading.trust`).

    Raises:
        UsageError: if there are fewer, or one is named twice.
        RunFolderError: if one cannot be read.
    """
    resolved = [folder.resolve() for folder in folders]
    if len(set(resolved)) < max(len(resolved), 2):
        raise UsageError("compare needs at least two run folders, none of them twice")
    records = tuple(read_record(folder, trust_code=trust_code) for folder in folders)
    return Comparison(
        names=_names(resolved),
        records=records,
        rows=tuple(_rows(records)),
        differences=differences(records),
    )


def _names(folders: Sequence[Path]) -> tuple[str, ...]:
    """Return the shortest ends of the paths that distinguish them."""
    for length in range(1, max(len(folder.parts) for folder in folders) + 1):
        names = ["/".join(folder.parts[-length:]) for folder in folders]
        if len(set(names)) == len(names):
            break
    return tuple(names)


_FIGURES: tuple[tuple[str, str, int, float, str], ...] = (
    ("planned energy", "kJ", 2, 1e-3, "plan.cost_J"),
    ("proven bound", "kJ", 2, 1e-3, "plan.bound_J"),
    ("planned duration", "s", 1, 1.0, "plan.makespan_s"),
    ("proven bound of the duration", "s", 1, 1.0, "plan.bound_s"),
    ("time limit", "s", 1, 1.0, "plan.time_limit_s"),
    ("above the bound", "%", 1, 100.0, "plan.gap"),
    ("planning time", "s", 2, 1.0, "plan.time_s.total"),
    ("first plan after", "s", 2, 1.0, "plan.time_s.first_solution"),
    ("path-following plans", "", 0, 1.0, "plan.path_following_plans"),
    ("tree vertices", "", 0, 1.0, "plan.vertices"),
    ("least distance to obstacles", "m", 2, 1.0, "verdict.min_obstacle_clearance_m"),
    ("least distance of robots", "m", 2, 1.0, "verdict.min_robot_distance_m"),
    ("rules broken", "", 0, 1.0, "verdict.violations"),
    ("simulated energy", "kJ", 2, 1e-3, "energy.measured_J"),
    ("lowest charge", "%", 1, 100.0, "energy.min_charge_fraction"),
    ("recharges", "", 0, 1.0, "energy.recharges"),
    ("goals visited", "", 0, 1.0, "execution.goals_visited"),
    ("contacts", "", 0, 1.0, "execution.contacts"),
    ("new plans on the way", "", 0, 1.0, "execution.replans"),
    ("tracking error, rms", "cm", 2, 100.0, "execution.tracking.rms_m"),
    ("tracking error, largest", "cm", 2, 100.0, "execution.tracking.max_m"),
)
"""Name, unit, digits, factor and dotted place in `summary.json`."""


def _rows(records: Sequence[RunRecord]) -> list[Row]:
    problems = [problem_digest(record) for record in records]
    alike = (False, *(problem == problems[0] for problem in problems[1:]))
    texts = parameters(records) | {"outcome": tuple(map(_outcome, records))}
    rows = [
        Row(name, "", texts[name], 0, alike)
        for name in ("scene", "seed", "profile", "objective", "outcome")
    ]
    for name, unit, digits, factor, place in _FIGURES:
        found = [_figure(record, place) for record in records]
        if any(value is not None for value in found):
            values = tuple(value and factor * value for value in found)
            rows.append(Row(name, unit, values, digits, alike))
    return rows


def _outcome(record: RunRecord) -> str:
    if record.plan is None:
        return str(record.planning["status"]).replace("_", " ")
    if record.audit is None:
        return "planned"
    if record.summary["status"] in ("model_mismatch", "energy_imbalance"):
        return str(record.summary["status"]).replace("_", " ")
    return "accomplished" if record.summary["mission_ok"] else "failed"


def _figure(record: RunRecord, place: str) -> float | None:
    """Return a figure of a run; of its plan in force where it was replanned."""
    first, plan = _at(record.summary, place), record.plan
    replanned = plan is not None and plan.cost_J != record.summary["plan"]["cost_J"]
    if plan is None or not replanned:
        return first
    # The gap is that of the first plan; the plan in force has gone other ways.
    in_force: dict[str, float | None] = {
        "plan.cost_J": plan.cost_J,
        "plan.makespan_s": plan.makespan_s,
        "plan.gap": None,
    }
    return in_force.get(place, first)


def _at(summary: Mapping[str, Any], place: str) -> float | None:
    value: Any = summary
    for name in place.split("."):
        value = value.get(name) if isinstance(value, Mapping) else None
    return None if value is None else float(value)
