"""How long legs take: what the router reckons with where time matters."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrmg.energy.model import CONSUMERS_W
from mrmg.planning.preference import Preference
from mrmg.planning.problem.targets import finish_of
from mrmg.planning.problem.time_weighting import way_lengths_m
from mrmg.planning.roadmap.roadmap import Roadmap
from mrmg.planning.routing.instance import homes
from mrmg.scene.types import Scene

TIE_SHARE = 0.01
"""Worth of a second of driving, in seconds of makespan: among tours that are over as
soon, those of less energy are better."""


def routing_times(
    scene: Scene,
    roadmap: Roadmap,
    fleet: np.ndarray,
    table: np.ndarray,
    dwell: np.ndarray,
    margin: float,
) -> dict[str, Any]:
    """Return what of a `RoutingInstance` is about time; nothing if it does not matter.

    Robots drive the ways of the roadmap at the top speed that they are planned with.

    Args:
        scene: the mission.
        roadmap: its roadmap.
        fleet: records of FLEET, shape (R,).
        table: of each robot, as of `RoutingInstance`.
        dwell: how long robots stay at each target [s].
        margin: surcharge on times, for what the roadmap does not see.
    """
    preference = Preference.of(scene)
    if not preference.timed:
        return {}
    places, robots = len(scene.targets()), len(fleet)
    length = way_lengths_m(roadmap)
    pace = (1.0 + margin) / fleet["limit"][:, 1]
    home = homes(table, places)
    time = np.zeros((int(table.max()) + 1, int(home.max()) + 1, places))
    finish_time = np.zeros((robots, places + 1))
    for r, finish in enumerate(finish_of(scene)):
        field = fleet[r]["field"]
        to = length[field][:, [*range(len(roadmap.targets)), len(roadmap.targets) + r]]
        # Out of a region that reaches across a wall, another vertex knows the way.
        to[:, :-1] = np.where(
            np.isfinite(to[:, :-1]), to[:, :-1], roadmap.distance[field].T
        )
        here = [*range(places), -1]
        legs = pace[r] * to[:places, here].T + dwell[:places]
        time[table[r], :places], time[table[r], home[r]] = legs[:-1], legs[-1]
        if finish >= 0:
            finish_time[r] = pace[r] * to[finish, here]
    objective = preference.driving
    power_W = float((fleet["plain"] * fleet["limit"][:, 1]).mean())
    energy_weight = max(
        objective.energy_weight, TIE_SHARE * objective.makespan_weight / power_W
    )
    # Of the size that the weights have where energy alone counts.
    size = energy_weight + objective.makespan_weight
    return {
        "time": time,
        "finish_time": finish_time,
        "limit": np.full(robots, preference.limit_s),
        "charge_power": fleet["charge"] - fleet["energy"][:, CONSUMERS_W],
        "energy_weight": energy_weight / size,
        "makespan_weight": objective.makespan_weight / size,
    }
