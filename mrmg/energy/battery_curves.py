"""Motion and battery content of each robot over time, as planned and as driven.

Audit, pictures, video and pages all read these curves; those of a drive are worked out
once for the log.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrmg.energy.ledger import LedgerEntry
from mrmg.energy.metering import (
    MEASURED_PARTS,
    TimedStates,
    battery_profile,
    measured_energy_parts,
    step_energy_parts,
    visits_and_energy,
)
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Battery, Scene
from mrmg.simulation.log import ExecutionLog


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryCurve(TimedStates):
    """Motion and battery content of one robot over time.

    Attributes:
        energy_J: content at each time, after a recharge, shape (n,).
        visits: of this robot; their `energy_J` is the content on arrival.
        drawn_J: over each interval by part, shape (n - 1, parts).
        battery: of this robot; of a drive, the one it really had.
    """

    energy_J: np.ndarray
    visits: tuple[Visit, ...]
    drawn_J: np.ndarray
    battery: Battery

    @property
    def used_J(self) -> np.ndarray:
        """Energy drawn up to each time, whatever was recharged, shape (n,)."""
        return np.append(0.0, np.cumsum(self.drawn_J.sum(axis=1)))

    @property
    def least_J(self) -> float:
        """Least battery content, arrivals included."""
        arrivals_J = [visit.energy_J for visit in self.visits]
        return min([float(self.energy_J.min()), *arrivals_J])


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCurve(BatteryCurve):
    """A curve by the work of the simulated drives.

    Attributes:
        entries: what was drawn by leg and part of `MEASURED_PARTS`, as in `drawn_J`.
    """

    entries: tuple[LedgerEntry, ...]


def shown_curves(
    scene: Scene, plan: Plan, log: ExecutionLog | None
) -> tuple[BatteryCurve, ...]:
    """Return the curves of what was driven, else of what was planned."""
    if log is None:
        return planned_curves(scene, plan)
    return measured_curves(scene, plan, log)


def planned_curves(scene: Scene, plan: Plan) -> tuple[BatteryCurve, ...]:
    """Return the battery content the plan predicts, one curve per robot."""
    return tuple(
        BatteryCurve(
            robot=trajectory.robot,
            time_s=trajectory.time_s,
            state=trajectory.state,
            energy_J=plan.content_J[trajectory.robot]
            if plan.content_J
            else battery_profile(scene, trajectory, plan.visits),
            visits=tuple(v for v in plan.visits if v.robot == trajectory.robot),
            drawn_J=step_energy_parts(
                scene, trajectory, plan.rolling_factor.get(trajectory.robot)
            ),
            battery=scene.robot(trajectory.robot).battery,
        )
        for trajectory in plan.trajectories
    )


_last: list[tuple[Scene, Plan, ExecutionLog, tuple[MeasuredCurve, ...]]] = []
"""The drive whose curves were worked out last, and the curves."""


def measured_curves(
    scene: Scene, plan: Plan, log: ExecutionLog
) -> tuple[MeasuredCurve, ...]:
    """Return the battery content by the work of the simulated drives.

    Where robots were disturbed, contents are those of the batteries they really had.
    """
    for known, of_plan, of_log, curves in _last:
        if of_plan is plan and of_log is log and known == scene:
            return curves
    actual = log.disturbance.actual_scene(scene) if log.disturbance else scene
    found = []
    for motion, work_J in zip(log.driven_motions(), log.work_J, strict=True):
        drawn_J = measured_energy_parts(actual.robot(motion.robot), work_J, log.time_s)
        tour = plan.tours.get(motion.robot, ())
        visits, content_J, entries = visits_and_energy(
            actual, motion, tour, drawn_J, parts=MEASURED_PARTS
        )
        found.append(
            MeasuredCurve(
                robot=motion.robot,
                time_s=motion.time_s,
                state=motion.state,
                energy_J=content_J,
                visits=visits,
                drawn_J=drawn_J,
                battery=actual.robot(motion.robot).battery,
                entries=tuple(entries),
            )
        )
    _last[:] = [(scene, plan, log, tuple(found))]
    return tuple(found)


def with_recharge_jumps(curve: BatteryCurve) -> tuple[np.ndarray, np.ndarray]:
    """Return times and contents [J], with the content on arrival at each station."""
    stations = [visit for visit in curve.visits if visit.kind == "station"]
    steps = np.array([visit.step for visit in stations], dtype=int)
    time_s = np.insert(curve.time_s, steps, curve.time_s[steps])
    arrival_J = np.array([visit.energy_J for visit in stations])
    return time_s, np.insert(curve.energy_J, steps, arrival_J)
