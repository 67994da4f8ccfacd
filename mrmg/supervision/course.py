"""The course of a mission: the plans it went by, one after another, as one plan.

A course begins as the mission's plan. When the fleet is stopped, what was planned after
the next step is replaced by braking and standing; a new plan is then joined to that.
The clock of the simulation runs through all of it, so that log, audit and pictures need
to know of a single plan only: the one that was in force at each time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from mrmg.energy.ledger import EnergyLedger, LedgerEntry
from mrmg.energy.metering import step_energy_parts, visits_and_energy
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Scene
from mrmg.supervision.stopping import Motion, held, motions_to_rest


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """Plans in force, joined.

    Attributes:
        scene: the mission as it began.
        plan: the joined plan, of all robots of the scene.
        charge_J: (step, battery contents by robot) from which the batteries were
            reckoned on, in order.
    """

    scene: Scene
    plan: Plan
    charge_J: tuple[tuple[int, Mapping[str, float]], ...]

    @staticmethod
    def of(scene: Scene, plan: Plan) -> Course:
        """Return the course that is a single plan."""
        return Course(
            scene=scene,
            plan=plan,
            charge_J=(
                (0, {robot.id: robot.battery.start_J for robot in scene.robots}),
            ),
        )

    @property
    def steps(self) -> int:
        """Number of steps."""
        return len(self.plan.trajectories[0].control)

    @property
    def parts_J(self) -> dict[str, np.ndarray]:
        """Planned energy of each step by robot, shape (n, len(PARTS)) each.

        It is that of the rolling resistance believed when the step was planned.
        """
        factors = self.plan.rolling_factor
        return {
            item.robot: step_energy_parts(self.scene, item, factors.get(item.robot))
            for item in self.plan.trajectories
        }

    def stopped(
        self,
        step: int,
        states: Mapping[str, np.ndarray],
        broken: Set[str],
        pause_s: float,
    ) -> Course:
        """Return the course that is left at a step to come to rest.

        Args:
            step: after which the fleet brakes.
            states: of all robots at that step, shape (5,) each.
            broken: ids of robots that can but brake in full.
            pause_s: how long the fleet stands at least.
        """
        motions = motions_to_rest(
            self.scene, self.plan.trajectories, step, states, broken
        )
        longest = max(len(control) for _, control in motions.values())
        length = longest + round(pause_s / self.plan.dt_s)
        motions = {name: held(*motion, length) for name, motion in motions.items()}
        return self._continued(step, motions, {}).with_tours(self.plan.tours)

    def resumed(
        self,
        plan: Plan,
        charge_J: Mapping[str, float],
        rolling_factor: Mapping[str, float],
        tours: Mapping[str, Sequence[str]],
    ) -> Course:
        """Return the course that goes on by a new plan from its end.

        Args:
            plan: from where the fleet stands; robots that it does not have stay there.
            charge_J: battery contents the plan starts from, by robot.
            rolling_factor: by which the rolling resistance was believed to differ from
                the models' when it was made, by robot.
            tours: of the whole course.
        """
        planned = {item.robot: item for item in plan.trajectories}
        length = max(len(item.control) for item in plan.trajectories)
        motions = {}
        for item in self.plan.trajectories:
            if item.robot in planned:
                new = planned[item.robot]
                motions[item.robot] = (new.state, new.control)
            else:
                motions[item.robot] = held(item.state[-1:], np.zeros((0, 2)), length)
        believed = {name: rolling_factor[name] for name in planned}
        joined = self._continued(self.steps, motions, believed)
        anew = (*self.charge_J, (self.steps, dict(charge_J)))
        return replace(joined, charge_J=anew).with_tours(tours)

    def with_tours(self, tours: Mapping[str, Sequence[str]]) -> Course:
        """Return the course with the given tours, and all that follows from them."""
        visits: list[Visit] = []
        entries: list[LedgerEntry] = []
        content_J, parts_J = {}, self.parts_J
        for item in self.plan.trajectories:
            robot = item.robot
            anew = {step: charge_J[robot] for step, charge_J in self.charge_J}
            own, content_J[robot], legs = visits_and_energy(
                self.scene, item, tours[robot], parts_J[robot], anew
            )
            visits += own
            entries += legs
        visits.sort(key=lambda visit: (visit.step, visit.robot))
        plan = replace(
            self.plan,
            tours={name: tuple(tour) for name, tour in tours.items()},
            visits=tuple(visits),
            ledger=EnergyLedger(tuple(entries)),
            content_J=content_J,
        )
        return replace(self, plan=plan)

    def _continued(
        self,
        step: int,
        motions: Mapping[str, Motion],
        rolling_factor: Mapping[str, float],
    ) -> Course:
        """Return the course up to `step`, then the given states and controls.

        Args:
            step: whose state is replaced by the first of the new ones.
            motions: states, shape (n + 1, 5), and controls, shape (n, 2), by robot.
            rolling_factor: by which the new steps' rolling resistance is believed to
                differ from the model's, by robot, where it does.
        """
        trajectories, factors = [], {}
        for item in self.plan.trajectories:
            state, control = motions[item.robot]
            before = self.plan.rolling_factor.get(item.robot, np.ones(step))
            factor = rolling_factor.get(item.robot, 1.0)
            factors[item.robot] = np.concatenate(
                [before[:step], np.full(len(control), factor)]
            )
            trajectories.append(
                replace(
                    item,
                    state=np.concatenate([item.state[:step], state]),
                    control=np.concatenate([item.control[:step], control]),
                )
            )
        plan = replace(
            self.plan, trajectories=tuple(trajectories), rolling_factor=factors
        )
        return replace(self, plan=plan)
