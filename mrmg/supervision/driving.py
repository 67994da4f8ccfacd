"""Driving a mission under supervision, from the first plan to its end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mrmg import storage
from mrmg.planning import PlannerParams
from mrmg.plans import DRIVEN_PLAN, Plan
from mrmg.scene.driven_parts import require_drivable
from mrmg.scene.types import Scene
from mrmg.simulation import ExecutionLog, simulate
from mrmg.simulation.disturbance import Disturbance
from mrmg.simulation.log import require_same_mission
from mrmg.supervision.faults import checked_faults
from mrmg.supervision.parameters import ControlParams
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
    controller: str = "mpc",
    disturbance: Disturbance | None = None,
    replan: bool = True,
    faults: Sequence[str] = (),
    seed: int = 0,
    planner: PlannerParams | None = None,
    params: ControlParams | None = None,
    on_progress: Callable[[float, str], None] | None = None,
) -> Drive:
    """Drive a plan in MuJoCo, and plan anew where the mission leaves it.

    Where nothing goes wrong the log is that of `simulation.simulate`, bit for bit.

    Args:
        scene: the mission.
        plan: it starts by.
        controller: name of the tracking controller.
        disturbance: how the robots differ from their models; None if they do not.
        replan: whether to plan anew; if not, the mission ends safely after a fault.
        faults: robots that break down, such as `r2@40s`.
        seed: of all random streams of planning anew.
        planner: parameters of planning anew; the default profile's if None.
        params: corridors and effort.
        on_progress: called with the fraction done and a text.

    Raises:
        UsageError: if the controller or a fault's robot is unknown, a fault cannot be
            read, or a robot can only be planned for.
        IdentityError: if the plan is of another scene.
    """
    require_same_mission(scene, plan)
    require_drivable(scene.robots)
    params = params or ControlParams()
    supervisor = FleetSupervisor(
        scene,
        plan,
        faults=checked_faults(scene, tuple(faults)),
        replanner=Replanner(
            scene=scene, seed=seed, planner=planner or PlannerParams(), control=params
        )
        if replan
        else None,
        params=params,
    )
    log = simulate(
        scene,
        plan,
        controller=controller,
        disturbance=disturbance,
        supervisor=supervisor if replan or faults else None,
        on_progress=on_progress,
    )
    return Drive(
        log=log, plan=supervisor.course.plan, replans=tuple(supervisor.replans)
    )
