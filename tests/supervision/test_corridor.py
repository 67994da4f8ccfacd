"""When a robot has left the energy corridor of its plan, and when it has not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from mrmg.energy.metering import find_visits, plan_ledger
from mrmg.plans import Plan, Trajectory
from mrmg.scene.types import Scene
from mrmg.supervision.corridor import Departure, EnergyCorridor
from mrmg.supervision.course import Course
from mrmg.supervision.metering import RobotMeter

SPEED_M_S, DT_S, STEPS = 1.5, 0.1, 1000
END_S = STEPS * DT_S


@dataclass
class Way:
    """Robot r1 goes straight on for 150 m, without recharging."""

    scene: Scene
    course: Course

    @property
    def metre_J(self) -> float:
        return self.scene.robot("r1").model.energy_model.plain_ground_J_per_m()

    def departure(
        self, *, more: float, clock_s: float, start_m: float, reserves: Scene
    ) -> Departure | None:
        """Look at r1 when all its way has taken `more` times what was planned.

        Args:
            more: than planned.
            clock_s: when to look.
            start_m: charge at the start, in metres of plain ground.
            reserves: scene whose reserves the plan keeps.
        """
        corridor = EnergyCorridor(self.course)
        corridor.follow(self.course, 0, {}, reserves)
        robot = self.scene.robot("r1")
        battery = replace(robot.battery, start_J=start_m * self.metre_J)
        meter = RobotMeter(self.scene, replace(robot, battery=battery))
        still = np.zeros((2, 5))
        work_J = meter.robot.model.energy_model.drive_efficiency * (
            more * SPEED_M_S * clock_s * self.metre_J
        )
        meter.add(np.array([0.0, 1.0]), still, np.array([[work_J, 0.0]]))
        return corridor.left(clock_s, {"r1": meter})

    def first_departure_s(
        self, *, more: float, start_m: float, reserves: Scene | None = None
    ) -> float:
        """Return when r1 leaves its corridor; infinity if it does not."""
        for clock_s in np.arange(0.5, END_S + 0.01, 0.5):
            found = self.departure(
                more=more,
                clock_s=float(clock_s),
                start_m=start_m,
                reserves=reserves or self.scene,
            )
            if found is not None:
                return float(clock_s)
        return np.inf


def straight_on(reserve: float, make_yard: Callable[..., Scene]) -> Scene:
    """Return a long yard, with batteries for 200 m."""
    return make_yard(
        bounds=[0, 0, 200, 24],
        goals=[{"id": "g1", "circle": {"center": [155, 5], "radius": 1.5}}],
        stations=[],
        battery={"capacity_m": 200, "reserve": reserve},
        robots=[{"id": "r1", "model": "car", "pose": [5, 5, 0]}],
    )


@pytest.fixture(scope="module")
def way(make_yard: Callable[..., Scene]) -> Way:
    scene = straight_on(0.05, make_yard)
    state = np.zeros((STEPS + 1, 5))
    state[:, 0] = 5.0 + SPEED_M_S * DT_S * np.arange(STEPS + 1)
    state[:, 1], state[:, 3] = 5.0, SPEED_M_S
    item = Trajectory(robot="r1", dt_s=DT_S, state=state, control=np.zeros((STEPS, 2)))
    visits = find_visits(scene, item, ("g1",))
    plan = Plan(
        scene_name=scene.name,
        scene_digest=scene.digest,
        seed=0,
        profile="default",
        parameters_digest="none",
        versions={},
        dt_s=DT_S,
        trajectories=(item,),
        tours={"r1": ("g1",)},
        visits=visits,
        ledger=plan_ledger(scene, (item,), visits),
    )
    return Way(scene, Course.of(scene, plan))


def test_what_was_planned_is_within_the_corridor(way: Way) -> None:
    # 150 m and the reserve of 10 m.
    assert way.first_departure_s(more=1.0, start_m=160.0) == np.inf


def test_what_would_use_the_reserve_is_noticed_while_there_is_time(way: Way) -> None:
    """2 % more, and 1 m to spare: too much, but seen only over a long way."""
    noticed_s = way.first_departure_s(more=1.02, start_m=161.0)
    assert noticed_s < 0.9 * END_S
    found = way.departure(
        more=1.02, clock_s=noticed_s, start_m=161.0, reserves=way.scene
    )
    assert found is not None
    assert (found.cause, found.robot) == ("energy", "r1")
    assert "the end of its tour" in found.message
    # The more it is, the earlier.
    assert way.first_departure_s(more=1.05, start_m=161.0) < 0.5 * noticed_s


def test_what_the_battery_has_to_spare_may_be_used(way: Way) -> None:
    assert way.first_departure_s(more=1.02, start_m=164.0) == np.inf


def test_a_large_excess_is_noticed_whatever_is_left(way: Way) -> None:
    # 30 % of the way is 10 % of it and 1 % of the capacity after 10 m.
    noticed_s = way.first_departure_s(more=1.3, start_m=200.0)
    assert noticed_s * SPEED_M_S == pytest.approx(10.0, abs=1.0)


def test_a_plan_that_may_use_the_reserve_is_held_to_what_it_keeps(
    way: Way, make_yard: Callable[..., Scene]
) -> None:
    without = straight_on(0.0, make_yard)
    assert way.first_departure_s(more=1.02, start_m=154.0, reserves=without) == np.inf
    assert way.first_departure_s(more=1.02, start_m=154.0) < END_S
    # A plan that keeps more than the reserve is held to the reserve.
    larger = straight_on(0.06, make_yard)
    assert way.first_departure_s(more=1.02, start_m=164.0, reserves=larger) == np.inf
