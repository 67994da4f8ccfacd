"""Every rule is broken once by a minimal plan; a valid plan breaks none.

Oracle: shapely on densely sampled footprints, which sees what the verifier must see.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mrmg
from mrmg.energy.ledger import EnergyLedger
from mrmg.errors import UsageError
from mrmg.plans import Plan, Trajectory
from mrmg.scene.margins import NarrowPassage
from mrmg.scene.region import Region
from mrmg.scene.types import Battery, Finish, Scene
from mrmg.verification.verdict import Verdict, Violation, ViolationKind
from mrmg.verification.verify import verify

Kind = ViolationKind
Case = tuple[Scene, Plan]

TWO_ROBOTS = [
    {"id": "r1", "model": "car", "pose": [5, 10, 0]},
    {"id": "r2", "model": "car", "pose": [5, 14, 0]},
]
STATION = {"id": "s", "circle": {"center": [10, 10], "radius": 1}}
WALL = {"id": "wall", "box": {"center": [13.5, 10], "size": [1, 4]}, "height": 1}


def with_trajectory(plan: Plan, trajectory: Trajectory) -> Plan:
    return replace(plan, trajectories=(trajectory, *plan.trajectories[1:]))


def with_controls(case: Case, drive: Any, edit: Callable[[list], Any]) -> Case:
    """Drive r1 with edited controls; keep the stated visits and ledger."""
    scene, plan = case
    controls = plan.trajectories[0].control.tolist()
    edit(controls)
    return scene, with_trajectory(plan, drive(scene.robots[0], controls))


def kinds(verdict: Verdict) -> set[ViolationKind]:
    return {violation.kind for violation in verdict.violations}


def only(verdict: Verdict, kind: ViolationKind) -> Violation:
    """Return the single violation of a kind."""
    (violation,) = [item for item in verdict.violations if item.kind is kind]
    return violation


def asked(scene: Scene, plan: Plan, **changes: Any) -> Case:
    """Return a changed scene, and the plan as if it had been made for that."""
    changed = replace(scene, **changes)
    return changed, replace(plan, scene_digest=changed.digest)


def broken_scene_mismatch(case: Any, drive: Any) -> Case:
    scene, plan = case()
    return scene, replace(plan, scene_digest="another")


def broken_malformed(case: Any, drive: Any) -> Case:
    scene, plan = case()
    state = plan.trajectories[0].state.copy()
    state[4, 2] = np.nan
    return scene, with_trajectory(plan, replace(plan.trajectories[0], state=state))


def broken_start(case: Any, drive: Any) -> Case:
    scene, plan = case()
    robot = replace(scene.robots[0], pose=(5.25, 10.0, 0.0))
    return asked(scene, plan, robots=(robot,))


def broken_final_rest(case: Any, drive: Any) -> Case:
    return with_controls(case(), drive, lambda controls: controls.pop())


def broken_finish(case: Any, drive: Any) -> Case:
    scene, plan = case()
    ring = np.zeros((0, 2))
    region = Region(center=np.array([1.0, 1.0]), radius_m=0.1, corners=ring)
    finish = Finish(region=region, heading_rad=None, heading_tolerance_rad=0.1)
    return asked(scene, plan, robots=(replace(scene.robots[0], finish=finish),))


def broken_dynamics(case: Any, drive: Any) -> Case:
    scene, plan = case()
    state = plan.trajectories[0].state.copy()
    state[40, 0] = np.nextafter(state[40, 0], np.inf)
    return scene, with_trajectory(plan, replace(plan.trajectories[0], state=state))


def broken_state_limit(case: Any, drive: Any) -> Case:
    def speed_up(controls: list) -> None:
        controls[20:31] = [[1.0, 0.0]] * 11
        controls[31:42] = [[-1.0, 0.0]] * 11

    return with_controls(case(), drive, speed_up)


def broken_control_limit(case: Any, drive: Any) -> Case:
    def jerk(controls: list) -> None:
        controls[20], controls[21] = [1.625, 0.0], [-1.625, 0.0]

    return with_controls(case(), drive, jerk)


def broken_obstacle(case: Any, drive: Any) -> Case:
    return case(obstacles=[WALL])


def broken_bounds(case: Any, drive: Any) -> Case:
    return case(bounds=[0, 0, 18, 20])


def broken_robot(case: Any, drive: Any) -> Case:
    other = {"id": "r2", "model": "car", "pose": [30, 10, 3.141592653589793]}
    return case(robots=[TWO_ROBOTS[0], other])


def broken_goal_missed(case: Any, drive: Any) -> Case:
    return case(goals=[{"id": "g", "circle": {"center": [15, 14], "radius": 1}}])


def broken_dwell(case: Any, drive: Any) -> Case:
    scene, plan = case()
    return asked(scene, plan, goals=(replace(scene.goals[0], dwell_s=900.0),))


def broken_heading(case: Any, drive: Any) -> Case:
    """The car drives along the x axis, and never the other way round."""
    scene, plan = case()
    across = replace(scene.goals[0], heading_rad=1.5, heading_tolerance_rad=0.2)
    return asked(scene, plan, goals=(across,))


def broken_occupied(case: Any, drive: Any) -> Case:
    station = {"id": "s", "circle": {"center": [5, 12], "radius": 3}}
    scene, plan = case(robots=TWO_ROBOTS, stations=[station])
    lone = replace(scene.stations[0], one_at_a_time=True)
    return asked(scene, plan, stations=(lone,))


def broken_tour(case: Any, drive: Any) -> Case:
    scene, plan = case(stations=[STATION], tour=("s", "g"))
    return scene, replace(plan, tours={"r1": ("g", "s")})


def broken_visit(case: Any, drive: Any) -> Case:
    scene, plan = case()
    late = replace(plan.visits[0], step=plan.visits[0].step + 2)
    return scene, replace(plan, visits=(late,))


def broken_recharge(case: Any, drive: Any) -> Case:
    scene, plan = case()
    claim = replace(plan.visits[0], kind="station")
    return scene, replace(plan, visits=(claim,))


def broken_energy(case: Any, drive: Any) -> Case:
    scene, plan = case()
    battery = Battery(capacity_J=20000.0, start_J=2000.0, reserve_fraction=0.05)
    robot = replace(scene.robots[0], battery=battery)
    return asked(scene, plan, robots=(robot,))


def broken_late(case: Any, drive: Any) -> Case:
    scene, plan = case()
    return asked(scene, plan, time_limit_s=plan.makespan_s - 0.5)


def broken_margin(case: Any, drive: Any) -> Case:
    """The wall ends 1.5 m beside the path; a plan begins with any distance."""
    beside = {"id": "wall", "box": {"center": [13, 12.5], "size": [1, 1]}}
    scene, plan = case(obstacles=[beside])
    return scene, replace(plan, margins={"r1": (1.46, 0.5)})


def broken_ledger(case: Any, drive: Any) -> Case:
    scene, plan = case()
    first, *rest = plan.ledger.entries
    richer = replace(first, energy_J=first.energy_J + 1.0)
    return scene, replace(plan, ledger=EnergyLedger((richer, *rest)))


BROKEN = {kind: globals()[f"broken_{kind.value}"] for kind in Kind}

# Who moves or recharges otherwise than stated also breaks what was stated of it.
FOLLOWING = {
    Kind.FINAL_REST: {Kind.LEDGER},
    Kind.STATE_LIMIT: {Kind.VISIT, Kind.LEDGER},
    Kind.CONTROL_LIMIT: {Kind.VISIT, Kind.LEDGER},
    Kind.TOUR: {Kind.VISIT, Kind.LEDGER},
    Kind.GOAL_MISSED: {Kind.TOUR},
    Kind.HEADING: {Kind.TOUR, Kind.VISIT, Kind.LEDGER},
    Kind.DWELL: {Kind.TOUR, Kind.VISIT, Kind.LEDGER},
    Kind.RECHARGE: {Kind.VISIT},
    Kind.ENERGY: {Kind.VISIT},
}


def test_valid_plan_has_no_violation(case: Any) -> None:
    verdict = verify(*case(stations=[STATION], tour=("s", "g"), robots=TWO_ROBOTS))
    assert verdict.ok
    assert verdict.violations == ()


@pytest.mark.parametrize(("kept_m", "ok"), [(1.8, True), (2.0, False)])
def test_robots_keep_the_larger_of_their_margins(
    kept_m: float, ok: bool, case: Any
) -> None:
    """Two cars 1.1 m wide pass each other on lines 3 m apart."""
    facing = {"id": "r2", "model": "car", "pose": [20, 13, 3.141592653589793]}
    scene, plan = case(robots=[TWO_ROBOTS[0], facing])
    plan = replace(plan, margins={"r1": (0.1, 0.5), "r2": (0.1, kept_m)})
    found = verify(scene, plan).violations
    assert [one.kind for one in found] == ([] if ok else [Kind.MARGIN])


def passage(robot: str, margin_m: float, end_s: float = 1e3) -> NarrowPassage:
    return NarrowPassage(
        robot=robot, start_s=0.0, end_s=end_s, x_m=5.0, y_m=10.0, margin_m=margin_m
    )


def test_a_margin_that_is_never_kept_is_broken(case: Any) -> None:
    scene, plan = case()
    found = verify(scene, replace(plan, margins={"r1": (50.0, 0.0)})).violations
    assert [one.kind for one in found] == [Kind.MARGIN]


@pytest.mark.parametrize(("behind_m", "ok"), [(0.0, True), (12.0, False)])
def test_a_start_too_near_is_no_fault_of_the_plan(
    behind_m: float, ok: bool, case: Any
) -> None:
    """The post is 0.1 m behind the car, or as near to the middle of its way."""
    reach_m = case()[0].robots[0].model.half_width_m
    post = {"center": [5 + behind_m / 2, 10.1 + reach_m + 0.05], "size": [0.1, 0.1]}
    scene, plan = case(obstacles=[{"id": "post", "box": post}])
    plan = replace(plan, margins={"r1": (0.3, 0.5)})
    assert verify(scene, plan).ok is ok


def test_who_gets_away_comes_no_nearer_first(case: Any) -> None:
    """The wall lies 0.2 m beside the car, a bump in it 0.1 m; both are passed."""
    edge_m = 10.1 + case()[0].robots[0].model.half_width_m
    wall = {"center": [6, edge_m + 0.6], "size": [6, 1]}
    bump = {"center": [8, edge_m + 0.2], "size": [0.5, 0.4]}
    for boxes, broken in (((wall,), []), ((wall, bump), [Kind.MARGIN])):
        obstacles = [{"id": f"o{i}", "box": box} for i, box in enumerate(boxes)]
        scene, plan = case(obstacles=obstacles)
        stated = replace(plan, margins={"r1": (0.3, 0.5)})
        assert [one.kind for one in verify(scene, stated).violations] == broken


def test_who_stays_where_it_starts_comes_no_nearer(case: Any) -> None:
    """Two cars 0.1 m apart keep 0.5 m from each other if they can."""
    side_m = 2.0 * case()[0].robots[0].model.half_width_m + 0.1
    beside = [
        {**TWO_ROBOTS[1], "id": f"r{i}", "pose": [30, 2 + i * side_m, 0]}
        for i in (2, 3)
    ]
    margins = {"r2": (0.05, 0.5), "r3": (0.05, 0.5)}
    scene, plan = case(robots=[TWO_ROBOTS[0], *beside])
    standing = tuple(
        replace(
            item,
            control=0.0 * item.control,
            state=np.repeat(item.state[:1], len(item.state), axis=0),
        )
        for item in plan.trajectories[1:]
    )
    plan = replace(
        plan, trajectories=(plan.trajectories[0], *standing), margins=margins
    )
    assert Kind.MARGIN not in kinds(verify(scene, plan))


@pytest.mark.parametrize(("margin_m", "ok"), [(0.1, True), (0.0, False)])
def test_from_the_start_on_the_certified_minimum_holds(
    margin_m: float, ok: bool, case: Any
) -> None:
    """The wall ends 0.1 m beside the path, far from the start."""
    edge_m = 10.1 + case()[0].robots[0].model.half_width_m
    wall = {"center": [13, edge_m + 0.5], "size": [1, 1]}
    scene, plan = case(obstacles=[{"id": "wall", "box": wall}])
    stretch = passage("r1", margin_m, plan.makespan_s)
    plan = replace(plan, margins={"r1": (0.3, 0.5)}, narrow=(stretch,))
    assert verify(scene, plan).ok is ok


@pytest.mark.parametrize(("second", "ok"), [(False, True), (True, False)])
def test_only_a_start_may_be_nearer_than_the_certified_minimum(
    second: bool, ok: bool, case: Any
) -> None:
    """Posts are 5 mm beside the start, and 5 mm beside the way 8 m later."""
    edge_m = 10.0 + case()[0].robots[0].model.half_width_m
    boxes = [
        {"center": [x, edge_m + 0.055], "size": [0.1, 0.1]}
        for x in (5, 13)[: 1 + second]
    ]
    boxes.append({"center": [9, edge_m + 0.75], "size": [20, 1]})
    obstacles = [{"id": f"o{i}", "box": box} for i, box in enumerate(boxes)]
    scene, plan = case(obstacles=obstacles)
    stretch = passage("r1", 0.005, plan.makespan_s)
    plan = replace(plan, margins={"r1": (0.3, 0.5)}, narrow=(stretch,))
    assert kinds(verify(scene, plan)) == (set() if ok else {Kind.MARGIN})


@pytest.mark.parametrize(
    ("robot", "share", "ok"),
    [("r1", 1.0, True), ("r2", 1.0, False), ("r1", 0.3, False)],
)
def test_a_passage_is_one_robot_s_and_ends(
    robot: str, share: float, ok: bool, case: Any
) -> None:
    """The wall ends 0.1 m beside r1's path, 8 of its 12 m from the start."""
    edge_m = 10.1 + case()[0].robots[0].model.half_width_m
    wall = {"center": [13, edge_m + 0.5], "size": [1, 1]}
    aside = {**TWO_ROBOTS[1], "pose": [5, 16, 0]}
    scene, plan = case(
        robots=[TWO_ROBOTS[0], aside], obstacles=[{"id": "wall", "box": wall}]
    )
    stretch = passage(robot, 0.1, share * plan.makespan_s)
    margins = {"r1": (0.3, 0.5), "r2": (0.3, 0.5)}
    plan = replace(plan, margins=margins, narrow=(stretch,))
    assert kinds(verify(scene, plan)) == (set() if ok else {Kind.MARGIN})


def test_every_two_robots_that_touch_are_found(case: Any) -> None:
    """Two cars stand in the way of the first one, which runs into both."""
    ahead = [
        {"id": f"r{i}", "model": "car", "pose": [x, y, 0]}
        for i, x, y in ((2, 12, 11), (3, 22, 9))
    ]
    scene, plan = case(robots=[TWO_ROBOTS[0], *ahead], distance_m=24.0)
    standing = (
        replace(
            item,
            control=0.0 * item.control,
            state=np.repeat(item.state[:1], len(item.state), axis=0),
        )
        for item in plan.trajectories[1:]
    )
    plan = replace(plan, trajectories=(plan.trajectories[0], *standing))
    touched = [one for one in verify(scene, plan).violations if one.kind is Kind.ROBOT]
    assert {(one.robot, one.other) for one in touched} == {("r1", "r2"), ("r1", "r3")}


def test_every_two_robots_that_share_a_station_are_found(case: Any) -> None:
    station = {"id": "s", "circle": {"center": [5, 14], "radius": 2.5}}
    third = {**TWO_ROBOTS[1], "id": "r3", "pose": [5, 12.3, 0]}
    robots = [{**TWO_ROBOTS[0], "pose": [5, 10, 0]}, TWO_ROBOTS[1], third]
    scene, plan = case(robots=robots, stations=[station])
    lone = replace(scene.stations[0], one_at_a_time=True)
    found = verify(*asked(scene, plan, stations=(lone,))).violations
    shared = {(one.robot, one.other) for one in found if one.kind is Kind.OCCUPIED}
    assert len(shared) == 1


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        (Kind.LEDGER, lambda plan: replace(plan, ledger=EnergyLedger(()))),
        (
            Kind.LEDGER,
            lambda plan: replace(
                plan,
                ledger=EnergyLedger(
                    (*plan.ledger.entries, replace(plan.ledger.entries[0], leg=7))
                ),
            ),
        ),
        (Kind.VISIT, lambda plan: replace(plan, visits=())),
        (Kind.VISIT, lambda plan: replace(plan, visits=2 * plan.visits)),
    ],
    ids=["no ledger", "another entry", "no visits", "visits twice"],
)
def test_what_is_stated_is_neither_more_nor_less_than_what_is_done(
    kind: Kind, change: Callable[[Plan], Plan], case: Any
) -> None:
    scene, plan = case()
    assert kind in kinds(verify(scene, change(plan)))


@pytest.mark.parametrize("kind", Kind)
def test_broken_rule_is_found_alone(kind: Kind, case: Any, drive: Any) -> None:
    verdict = verify(*BROKEN[kind](case, drive))
    assert not verdict.ok
    found = kinds(verdict)
    assert kind in found
    assert found - {kind} <= FOLLOWING.get(kind, set())


@pytest.mark.parametrize("kind", Kind)
def test_message_names_what_is_broken(kind: Kind, case: Any, drive: Any) -> None:
    for violation in verify(*BROKEN[kind](case, drive)).violations:
        assert violation.message.startswith(violation.robot)
        assert len(violation.message) > 15


def test_start_tells_how_far_off(case: Any, drive: Any) -> None:
    violation = only(verify(*broken_start(case, drive)), Kind.START)
    assert violation.amount == 0.25
    assert violation.time_s == 0.0


def test_one_ulp_off_the_dynamics_is_found_once(case: Any, drive: Any) -> None:
    violation = only(verify(*broken_dynamics(case, drive)), Kind.DYNAMICS)
    assert 4.0 <= violation.time_s <= 4.1
    assert 0.0 < violation.amount < 1e-14


def test_state_limit_reports_the_fastest_moment(case: Any, drive: Any) -> None:
    violation = only(verify(*broken_state_limit(case, drive)), Kind.STATE_LIMIT)
    assert violation.amount == pytest.approx(0.1)
    assert violation.time_s == pytest.approx(3.1)


def test_obstacle_contact_is_one_violation_with_its_worst_overlap(
    case: Any, drive: Any
) -> None:
    scene, plan = broken_obstacle(case, drive)
    violation = only(verify(scene, plan), Kind.OBSTACLE)
    state = plan.trajectories[0].state
    shapes = shapely.polygons(scene.robots[0].model.footprint_at(state))
    overlap = shapely.area(shapely.intersection(shapes, scene.obstacles[0].shape))
    assert violation.other == "wall"
    assert violation.amount == pytest.approx(overlap.max())
    x_m = np.interp(violation.time_s, np.arange(len(state)) * 0.1, state[:, 0])
    assert violation.x_m == pytest.approx(x_m, abs=0.01)


def test_bounds_violation_is_measured_in_metres(case: Any, drive: Any) -> None:
    violation = only(verify(*broken_bounds(case, drive)), Kind.BOUNDS)
    assert violation.amount == pytest.approx(5 + 12 + 1.5 - 18)


def test_robots_in_conflict_are_both_named(case: Any, drive: Any) -> None:
    violation = only(verify(*broken_robot(case, drive)), Kind.ROBOT)
    assert (violation.robot, violation.other) == ("r1", "r2")


def test_energy_violation_tells_the_lack(case: Any, drive: Any) -> None:
    scene, plan = broken_energy(case, drive)
    violation = only(verify(scene, plan), Kind.ENERGY)
    assert violation.amount == pytest.approx(1000.0 - (2000.0 - plan.cost_J))


def test_lateness_is_measured_from_the_limit(case: Any, drive: Any) -> None:
    scene, plan = broken_late(case, drive)
    violation = only(verify(scene, plan), Kind.LATE)
    assert violation.amount == pytest.approx(0.5)
    assert violation.time_s == plan.makespan_s
    assert verify(*asked(scene, plan, time_limit_s=plan.makespan_s)).ok


def test_recharge_keeps_the_battery_above_the_reserve(case: Any) -> None:
    scene, plan = case(
        stations=[STATION],
        tour=("s", "g"),
        battery={"capacity_J": 1200, "reserve": 0.05},
    )
    without = replace(plan, tours={"r1": ("g",)})
    assert verify(scene, plan).ok
    assert Kind.ENERGY in kinds(verify(scene, without))


def test_malformed_plan_names_every_fault(case: Any) -> None:
    scene, plan = case(robots=TWO_ROBOTS)
    short = replace(
        plan.trajectories[1],
        state=plan.trajectories[1].state[:-1],
        control=plan.trajectories[1].control[:-1],
    )
    broken = replace(plan, trajectories=(plan.trajectories[0], short), tours={})
    verdict = verify(scene, broken)
    assert kinds(verdict) == {Kind.MALFORMED}
    messages = " ".join(item.message for item in verdict.violations)
    assert "steps" in messages
    assert "r2: the plan has no tour" in messages
    assert verdict.min_obstacle_clearance_m is None


def of_r1(plan: Plan, **changes: Any) -> Plan:
    return with_trajectory(plan, replace(plan.trajectories[0], **changes))


def slowed(plan: Plan) -> Plan:
    """Return a plan with steps of 4 s."""
    slow = tuple(replace(item, dt_s=4.0) for item in plan.trajectories)
    return replace(plan, dt_s=4.0, trajectories=slow)


def far_off(state: np.ndarray) -> np.ndarray:
    return state + 1e12 * np.eye(1, state.shape[1])


@pytest.mark.parametrize(
    ("malform", "words"),
    [
        (lambda plan: of_r1(plan, robot="r9"), "the plan moves robots ['r9']"),
        (lambda plan: replace(plan, dt_s=0.0), "the step length is 0.0 s"),
        (slowed, "the step length is 4.0 s, more than 0.2 s"),
        *(
            (partial(of_r1, control=control), "r1: states and controls are no tables")
            for control in (
                np.array(0.0),
                np.array([["a", "b"]]),
                np.zeros((1, 2), complex),
                np.zeros((1, 2), np.longdouble),
            )
        ),
        (
            lambda plan: of_r1(plan, state=plan.trajectories[0].state[:, :4]),
            "r1: states and controls have shapes",
        ),
        (
            lambda plan: of_r1(plan, control=plan.trajectories[0].control * np.nan),
            "r1: a state or control is not a finite number",
        ),
        (lambda plan: of_r1(plan, dt_s=0.2), "r1: its step is 0.2 s long"),
        (
            lambda plan: replace(plan, visits=(replace(plan.visits[0], robot="r9"),)),
            "r9: visits are stated but no motion",
        ),
        (
            lambda plan: replace(plan, narrow=(passage("r9", 0.1),)),
            "r9: a passage is stated but no motion",
        ),
        (
            lambda plan: replace(plan, narrow=(passage("r1", np.nan),)),
            "r1: a passage is not of finite numbers",
        ),
        (
            lambda plan: replace(plan, margins={"r1": (np.nan, np.nan)}),
            "r1: its margins are (nan, nan) m",
        ),
        (
            lambda plan: replace(plan, margins={"r1": (0.1, -0.1)}),
            "r1: its margins are (0.1, -0.1) m",
        ),
        (
            lambda plan: replace(plan, margins={"r9": (0.1, 0.1)}),
            "r9: margins are stated but no motion",
        ),
        (
            lambda plan: replace(plan, skipped={"nowhere": "out of reach"}),
            "nowhere is left out, and no goal of the scene",
        ),
        (
            lambda plan: of_r1(plan, state=plan.trajectories[0].state + 1e12),
            "r1: step 0 moves too wildly",
        ),
        (
            lambda plan: of_r1(plan, state=far_off(plan.trajectories[0].state)),
            "r1: step 0 moves too wildly",
        ),
    ],
)
def test_a_malformed_plan_is_judged_by_that_alone(
    malform: Callable[[Plan], Plan], words: str, case: Any
) -> None:
    scene, plan = case()
    verdict = verify(scene, malform(plan))
    assert kinds(verdict) == {Kind.MALFORMED}
    assert any(item.message.startswith(words) for item in verdict.violations)


def test_a_malformed_plan_is_not_driven(case: Any) -> None:
    scene, plan = case()
    short = of_r1(plan, state=plan.trajectories[0].state[:-1])
    for drive in (mrmg.execute, mrmg.drive):
        with pytest.raises(UsageError, match="malformed: r1: states and controls have"):
            drive(scene, short)


@pytest.mark.parametrize(
    ("kind", "control", "amount"),
    [
        (Kind.STATE_LIMIT, (-1.3, 0.0), 0.1),  # faster backwards than v_min
        (Kind.STATE_LIMIT, (0.0, 0.65), 0.05),  # steered beyond w_max to the left
        (Kind.STATE_LIMIT, (0.0, -0.65), 0.05),  # and to the right
        (Kind.CONTROL_LIMIT, (0.0, 1.25), 0.25),  # steered too fast
    ],
)
def test_every_limit_is_watched(
    kind: Kind,
    control: tuple[float, float],
    amount: float,
    make_scene: Any,
    make_plan: Any,
) -> None:
    there = 10 if kind is Kind.STATE_LIMIT else 1
    controls = [control] * there + [(-control[0], -control[1])] * there
    scene = make_scene(goals=[], robots=[{**TWO_ROBOTS[0], "pose": [20, 10, 0]}])
    plan = make_plan(scene, {"r1": controls}, {"r1": ()})
    found = [item for item in verify(scene, plan).violations if item.kind is kind]
    assert max(item.amount for item in found) == pytest.approx(amount)


def test_battery_must_hold_the_reserve_on_arrival_at_a_station(case: Any) -> None:
    scene, plan = case(stations=[STATION], tour=("s", "g"))
    spent_J = 20000.0 - plan.visits[0].energy_J
    battery = replace(scene.robots[0].battery, start_J=1000.0 + spent_J - 10.0)
    robot = replace(scene.robots[0], battery=battery)
    violation = only(verify(*asked(scene, plan, robots=(robot,))), Kind.ENERGY)
    assert violation.amount == pytest.approx(10.0)
    assert violation.time_s == pytest.approx(plan.visits[0].time_s)


def test_recharge_before_the_station_is_told_with_its_distance(case: Any) -> None:
    scene, plan = case(stations=[STATION], tour=("s", "g"))
    early = replace(plan.visits[0], step=0, time_s=0.0)
    verdict = verify(scene, replace(plan, visits=(early, *plan.visits[1:])))
    assert only(verdict, Kind.RECHARGE).amount == pytest.approx(4.0)


def test_stated_battery_content_must_be_the_recomputed_one(case: Any) -> None:
    scene, plan = case()
    rich = replace(plan.visits[0], energy_J=plan.visits[0].energy_J + 1.0)
    assert kinds(verify(scene, replace(plan, visits=(rich,)))) == {Kind.VISIT}


def test_stated_visits_are_at_their_time(case: Any) -> None:
    scene, plan = case()
    late = replace(plan.visits[0], time_s=plan.visits[0].time_s + 0.05)
    violation = only(verify(scene, replace(plan, visits=(late,))), Kind.VISIT)
    assert violation.amount == pytest.approx(0.05)


def test_a_tour_with_a_target_that_is_none_is_refused(case: Any) -> None:
    scene, plan = case()
    verdict = verify(scene, replace(plan, tours={"r1": ("g", "nowhere")}))
    violation = only(verdict, Kind.TOUR)
    assert violation.message == (
        "r1: the tour names nowhere, which the scene does not have"
    )


def test_a_robot_that_turns_on_the_spot_ends_without_turning(
    make_scene: Any, make_plan: Any
) -> None:
    robot = {"id": "r1", "model": "diffdrive", "pose": [5, 10, 0]}
    scene = make_scene(goals=[], robots=[robot])
    plan = make_plan(scene, {"r1": [(0.0, 0.5), (0.0, 0.5)]}, {"r1": ()})
    violation = only(verify(scene, plan), Kind.FINAL_REST)
    assert violation.amount == pytest.approx(0.1)
    assert "omega" in violation.message


@pytest.mark.parametrize(("heading_rad", "amount"), [(0.05, None), (0.5, 0.4)])
def test_a_finish_has_a_heading(
    heading_rad: float, amount: float | None, case: Any
) -> None:
    scene, plan = case()
    end = plan.trajectories[0].state[-1, :2]
    region = Region(center=end, radius_m=0.1, corners=np.zeros((0, 2)))
    finish = Finish(region=region, heading_rad=heading_rad, heading_tolerance_rad=0.1)
    robot = replace(scene.robots[0], finish=finish)
    verdict = verify(*asked(scene, plan, robots=(robot,)))
    assert verdict.ok == (amount is None)
    if amount is not None:
        assert only(verdict, Kind.FINISH).amount == pytest.approx(amount)


@settings(
    max_examples=150,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.lists(
        st.lists(
            st.floats(allow_nan=True) | st.floats(-20, 20), min_size=7, max_size=7
        ),
        min_size=2,
        max_size=5,
    )
)
def test_nonsense_is_judged_and_never_raises(case: Any, rows: list) -> None:
    scene, plan = case(obstacles=[WALL])
    table = np.array(rows)
    nonsense = replace(
        plan.trajectories[0], state=table[:, :5], control=table[:-1, 5:].copy()
    )
    verdict = verify(scene, with_trajectory(plan, nonsense))
    assert not verdict.ok
    with TemporaryDirectory() as folder:
        verdict.save(Path(folder))
        assert Verdict.load(Path(folder)) == verdict
