"""What `tools/bench --output` wrote, read back for figures and tables."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg.errors import Fault, FileError


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRow:
    """One planned mission.

    Attributes:
        scene: name of the scene.
        source: path or name it was loaded from.
        seed: of the planner.
        profile: of the planner.
        solved: whether there is a verified plan.
        status: how planning ended.
        robots, goals, stations, terrain_areas: how many the scene has.
        capacity_m: of the first robot's battery, as metres of plain ground.
        init_s, routing_s, first_s, total_s: times of planning; `first_s` is None
            without a plan.
        path_following_plans: how often the fleet followed paths, without a search;
            files of earlier versions do not say it.
        iterations: expansions of motion trees.
        conditions: machine, versions, budget.
    """

    scene: str
    source: str
    seed: int
    profile: str
    solved: bool
    status: str
    robots: int
    goals: int
    stations: int
    terrain_areas: int
    capacity_m: float
    init_s: float
    routing_s: float
    first_s: float | None
    total_s: float
    path_following_plans: int
    iterations: int
    conditions: str

    @property
    def family(self) -> str:
        """The scene's name without the `_rN` of another fleet on its map."""
        base, _, fleet = self.scene.rpartition("_r")
        return base if fleet.isdigit() else self.scene


def read_rows(paths: Sequence[Path]) -> list[BenchRow]:
    """Read files of `tools/bench --output`.

    Raises:
        FileError: if one cannot be read or holds something else; names the line.
    """
    rows = []
    for path in paths:
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise FileError(
                str(path), [Fault("", f"cannot be read ({error})")]
            ) from error
        for number, line in enumerate(lines, start=1):
            try:
                rows.append(_row(json.loads(line)))
            except (ValueError, KeyError, TypeError) as error:
                fault = Fault(
                    f"line {number}", f"no row of 'tools/bench --output' ({error!r})"
                )
                raise FileError(str(path), [fault]) from error
    if not rows:
        names = ", ".join(map(str, paths))
        raise FileError(
            names, [Fault("", "no rows; 'tools/bench --output' makes some")]
        )
    return rows


def _row(data: dict[str, Any]) -> BenchRow:
    problem, statistics = data["problem"], data["statistics"]
    times = statistics["time_s"]
    solved = data["status"] == "solved" and data.get("violations", 0) == 0
    return BenchRow(
        scene=data["scene"],
        source=problem["source"],
        seed=data["seed"],
        profile=data["profile"],
        solved=solved,
        status=data["status"],
        robots=problem["robots"],
        goals=problem["goals"],
        stations=problem["stations"],
        terrain_areas=problem["terrain_areas"],
        capacity_m=problem["capacity_m"],
        init_s=times["init"],
        routing_s=times["routing"],
        first_s=times["first_solution"] if solved else None,
        total_s=times["total"],
        path_following_plans=statistics.get(
            "path_following_plans", statistics.get("drafts", 0)
        ),
        iterations=statistics["expansions"],
        conditions=data["conditions"],
    )
