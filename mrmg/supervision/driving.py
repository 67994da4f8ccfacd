"""Driving a mission under supervision, from the first plan to its end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrmg import storage
from mrmg.planning import PlannerParams
from mrmg.plans import DRIVEN_PLAN, Plan
from mrmg.scene.types import Scene
from mrmg.simulation.log import ExecutionLog, require_executable
from mrmg.simulation.simulation import simulate
from mrmg.supervision.faults import checked_faults
from mrmg.supervision.replanning import Replan, Replanner
from mrmg.supervision.supervisor import FleetSupervisor


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """A mission that was driven.

    Attributes:
        log: of the whole simulation.
        plan: the plan in force at each time: the first one, or plans joined.
        replans: outcomes of planning anew, in order.
    """

    log: ExecutionLog
    plan: Plan
    replans: tuple[Replan, ...]

    def save(self, folder: Path) -> None:
        """Write the log and, where the fleet was stopped, what it was driven by."""
        if self.log.events:
            outcomes = [outcome.to_json() for outcome in self.replans]
            storage.write_json(folder / "replans.json", outcomes)
            self.plan.save(folder, DRIVEN_PLAN)
        self.log.save(folder)


def drive_mission(
    scene: Scene,
    plan: Plan,
    *,
    replan: bool = True,
    faults: str | Sequence[str] = (),
    seed: int = 0,
    planner: PlannerParams | None = None,
    **simulation: Any,
) -> Drive:
    """Drive a plan in MuJoCo, and plan anew where the mission leaves it.

    Where nothing goes wrong the log is that of `simulation.simulate`, bit for bit.

    Args:
        scene: the mission.
        plan: it starts by.
        replan: whether to plan anew; if not, the mission ends safely after a fault.
        faults: robots that break down, such as `r2@40s`.
        seed: of all random streams of planning anew.
        planner: parameters of planning anew; the default profile's if None.
        **simulation: further arguments of `simulate`: controller, disturbance, plant,
            on_progress.

    Raises:
        UsageError: if the controller or a fault's robot is unknown, a fault cannot be
            read, the plan is malformed, or a robot can only be planned for.
        IdentityError: if the plan is of another scene.
    """
    require_executable(scene, plan)
    supervisor = FleetSupervisor(
        scene,
        plan,
        faults=checked_faults(scene, faults),
        replanner=Replanner(scene=scene, seed=seed, planner=planner or PlannerParams())
        if replan
        else None,
    )
    log = simulate(
        scene,
        plan,
        supervisor=supervisor if replan or faults else None,
        **simulation,
    )
    return Drive(
        log=log, plan=supervisor.course.plan, replans=tuple(supervisor.replans)
    )
