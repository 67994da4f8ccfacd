"""A supervisor sees every tick; its orders are driven on from where the fleet is."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrmg.plans import Plan, Trajectory
from mrmg.scene.types import Scene
from mrmg.simulation.simulation import simulate
from mrmg.simulation.supervision import Event, Observation, Orders


class Watcher:
    """Notes what it sees, and orders once, when the fleet has come to rest."""

    def __init__(self, longer: Plan | None = None) -> None:
        self.longer = longer
        self.seen: list[Observation] = []
        self.work_J: list[np.ndarray] = []
        self.events: tuple[Event, ...] = ()

    def watch(self, now: Observation) -> Orders | None:
        self.seen.append(now)
        self.work_J.append(now.work_J()[-1, 0])
        if not now.ended or self.longer is None:
            return None
        plan, self.longer = self.longer, None
        self.events = (
            Event(
                time_s=now.time_s, cause="rest", robot="", action="replan", message="on"
            ),
        )
        return Orders(plan=plan, clock_s=now.clock_s)


@pytest.fixture(scope="module")
def mission(driving: SimpleNamespace) -> tuple[Scene, Plan, Plan]:
    """A short drive, and the plan that drives on after it."""
    scene = driving.open_ground([(0.0, 0.0, 0.0)])
    once = driving.straight(8.0, 1.0)
    short = driving.plan_of(scene, [once])
    return scene, short, driving.plan_of(scene, [np.concatenate([once, once])])


def test_watching_changes_nothing(mission: tuple[Scene, Plan, Plan]) -> None:
    scene, plan, _ = mission
    watcher = Watcher()
    alone, watched = simulate(scene, plan), simulate(scene, plan, supervisor=watcher)
    assert watched.qpos.tobytes() == alone.qpos.tobytes()
    assert watched.events == ()
    assert [now.time_s for now in watcher.seen] == watched.time_s[1:].tolist()
    np.testing.assert_array_equal(np.array(watcher.work_J), watched.work_J[0])


def test_orders_are_driven_on_from_rest(mission: tuple[Scene, Plan, Plan]) -> None:
    scene, plan, longer = mission
    log = simulate(scene, plan, supervisor=Watcher(longer))
    assert log.completed
    assert log.plan_digest == longer.digest
    end: Trajectory = longer.trajectory("r1")
    assert np.hypot(*(log.state[0, -1, :2] - end.state[-1, :2])) <= 0.03
    assert [event.action for event in log.events] == ["replan"]
    offset_m = np.hypot(*(log.state - log.reference)[0, :, :2].T)
    assert offset_m.max() <= 0.05


def test_events_are_kept_in_the_log(
    mission: tuple[Scene, Plan, Plan], tmp_path: Path
) -> None:
    scene, plan, longer = mission
    log = simulate(scene, plan, supervisor=Watcher(longer))
    log.save(tmp_path)
    assert type(log).load(tmp_path).events == log.events
