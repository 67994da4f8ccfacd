"""Damage to plans by kind, each with the rule of the verifier that must catch it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random
from typing import Any

import numpy as np

from faults.posts import thin_post
from mrmg.energy.ledger import EnergyLedger
from mrmg.plans import Plan, Trajectory, Visit
from mrmg.scene.types import Finish, Region, Scene
from mrmg.verification.motion_rules import plain_step
from mrmg.verification.verdict import ViolationKind as Kind

Case = tuple[Scene, Plan]


class InapplicableError(Exception):
    """A plan has nothing that this damage could be done to."""


@dataclass(frozen=True, kw_only=True)
class Damage:
    """One way to break a plan.

    Attributes:
        what: is damaged.
        rule: that must catch it.
        make: returns the scene and the plan, one of them changed.
    """

    what: str
    rule: Kind
    make: Callable[[Scene, Plan, Random], Case]


def _with(plan: Plan, trajectory: Trajectory) -> Plan:
    return replace(
        plan,
        trajectories=tuple(
            trajectory if item.robot == trajectory.robot else item
            for item in plan.trajectories
        ),
    )


def _asked(scene: Scene, plan: Plan, **changes: Any) -> Case:
    """Return a changed scene, and the plan as if it had been made for that."""
    changed = replace(scene, **changes)
    return changed, replace(plan, scene_digest=changed.digest)


def _moving(plan: Plan, random: Random) -> Trajectory:
    moving = [item for item in plan.trajectories if np.ptp(item.state[:, :2]) > 1.0]
    if not moving:
        raise InapplicableError
    return random.choice(moving)


def _amount(random: Random, least: float, most: float) -> float:
    """Return a number of either sign whose logarithm is uniform."""
    size = float(np.exp(random.uniform(np.log(least), np.log(most))))
    return random.choice((-size, size))


def _state(column: int) -> Callable[[Scene, Plan, Random], Case]:
    def make(scene: Scene, plan: Plan, random: Random) -> Case:
        trajectory = _moving(plan, random)
        state = trajectory.state.copy()
        step = random.randrange(1, len(state))
        least = 8 * np.spacing(max(1.0, abs(state[step, column])))
        state[step, column] += _amount(random, least, 1.0)
        return scene, _with(plan, replace(trajectory, state=state))

    return make


def _control(scene: Scene, plan: Plan, random: Random) -> Case:
    trajectory = _moving(plan, random)
    control = trajectory.control.copy()
    step, column = random.randrange(len(control)), random.randrange(2)
    control[step, column] += _amount(random, 1e-9, 1.0)
    return scene, _with(plan, replace(trajectory, control=control))


def _exceeding_control(scene: Scene, plan: Plan, random: Random) -> Case:
    trajectory = _moving(plan, random)
    limits = scene.robot(trajectory.robot).model.limits
    column = random.randrange(2)
    limit = (limits.u1_max_m_s2, limits.u2_max)[column]
    control = trajectory.control.copy()
    step = random.randrange(len(control))
    excess = abs(_amount(random, 1e-6, 10.0))
    control[step, column] = random.choice((-1, 1)) * (limit + excess)
    return scene, _with(plan, driven(scene, trajectory, control))


def driven(
    scene: Scene, trajectory: Trajectory, control: np.ndarray, start: Any = None
) -> Trajectory:
    """Return the motion under other controls, or from another start."""
    model = scene.robot(trajectory.robot).model
    step = plain_step(model)
    states = [tuple((trajectory.state[0] if start is None else start).tolist())]
    for pair in control.tolist():
        states.append(
            step(*states[-1], *pair, float(model.wheelbase_m), trajectory.dt_s)
        )
    return replace(trajectory, state=np.array(states), control=control)


def _exceeding_state(name: str, column: int) -> Callable[[Scene, Plan, Random], Case]:
    def make(scene: Scene, plan: Plan, random: Random) -> Case:
        trajectory = _moving(plan, random)
        reached = float(np.abs(trajectory.state[:, column]).max())
        if reached < 0.01:
            raise InapplicableError
        robot = scene.robot(trajectory.robot)
        limit = reached * (1.0 - abs(_amount(random, 1e-6, 0.5)))
        limits = replace(robot.model.limits, **{name: limit})
        model = replace(robot.model, limits=limits)
        return _with_robot(scene, plan, robot.id, model=model)

    return make


def _with_robot(scene: Scene, plan: Plan, robot_id: str, **changes: Any) -> Case:
    robots = tuple(
        replace(robot, **changes) if robot.id == robot_id else robot
        for robot in scene.robots
    )
    return _asked(scene, plan, robots=robots)


def _start(scene: Scene, plan: Plan, random: Random) -> Case:
    robot = random.choice(scene.robots)
    pose = list(robot.pose)
    pose[random.randrange(3)] += _amount(random, 1e-9, 1.0)
    return _with_robot(scene, plan, robot.id, pose=tuple(pose))


def _cut_off(scene: Scene, plan: Plan, random: Random) -> Case:
    fast = np.abs(_moving(plan, random).state[:, 3]) > 0.01
    steps = [int(step) for step in np.flatnonzero(fast) if step > 0]
    end = random.choice(steps)
    cut = tuple(
        replace(item, state=item.state[: end + 1], control=item.control[:end])
        for item in plan.trajectories
    )
    return scene, replace(plan, trajectories=cut)


def _clock(scene: Scene, plan: Plan, random: Random) -> Case:
    dt_s = plan.dt_s * (1.0 + _amount(random, 1e-6, 0.5))
    slower = tuple(replace(item, dt_s=dt_s) for item in plan.trajectories)
    return scene, replace(plan, dt_s=dt_s, trajectories=slower)


def _clock_of_one(scene: Scene, plan: Plan, random: Random) -> Case:
    trajectory = random.choice(plan.trajectories)
    wrong = random.choice((trajectory.dt_s * 2, 0.0, float("nan"), -0.1))
    return scene, _with(plan, replace(trajectory, dt_s=wrong))


def _shape(scene: Scene, plan: Plan, random: Random) -> Case:
    trajectory = _moving(plan, random)
    state, control = trajectory.state, trajectory.control
    other = random.choice(
        (
            {"state": state[:-1]},
            {"control": control[:-1]},
            {"state": state[:, :4]},
            {"control": control[:, :1]},
            {"state": state.ravel()},
            {"state": state[:0], "control": control[:0]},
            {"state": state + 1e13},
        )
    )
    return scene, _with(plan, replace(trajectory, **other))


def _not_finite(scene: Scene, plan: Plan, random: Random) -> Case:
    trajectory = _moving(plan, random)
    name = random.choice(("state", "control"))
    values = getattr(trajectory, name).copy()
    values.flat[random.randrange(values.size)] = random.choice((np.nan, np.inf))
    return scene, _with(plan, replace(trajectory, **{name: values}))


def _visit(
    change: Callable[[Any, Random], Any],
) -> Callable[[Scene, Plan, Random], Case]:
    def make(scene: Scene, plan: Plan, random: Random) -> Case:
        if not plan.visits:
            raise InapplicableError
        at = random.randrange(len(plan.visits))
        changed = change(plan.visits[at], random)
        visits = [*plan.visits[:at], *changed, *plan.visits[at + 1 :]]
        return scene, replace(plan, visits=tuple(visits))

    return make


def _other_charge(visit: Visit, random: Random) -> list[Visit]:
    energy_J = visit.energy_J + _amount(random, 1e-4, 1e4)
    return [replace(visit, energy_J=energy_J)]


def _false_recharge(scene: Scene, plan: Plan, random: Random) -> Case:
    goals = [visit for visit in plan.visits if visit.kind == "goal"]
    chosen = random.choice(goals)
    visits = tuple(
        replace(visit, kind="station") if visit is chosen else visit
        for visit in plan.visits
    )
    return scene, replace(plan, visits=visits)


def _low_battery(scene: Scene, plan: Plan, random: Random) -> Case:
    """Let a battery hold less at the start than the way to its first target takes."""
    robots = sorted({visit.robot for visit in plan.visits})
    robot = scene.robot(random.choice(robots))
    first = min(
        (visit for visit in plan.visits if visit.robot == robot.id),
        key=lambda visit: visit.step,
    )
    drawn_J = robot.battery.start_J - first.energy_J
    if drawn_J < 1.0:
        raise InapplicableError
    battery = replace(robot.battery, start_J=drawn_J * random.uniform(0.05, 0.95))
    return _with_robot(scene, plan, robot.id, battery=battery)


def _ledger(scene: Scene, plan: Plan, random: Random) -> Case:
    entries = [*plan.ledger.entries]
    at = max(range(len(entries)), key=lambda number: abs(entries[number].energy_J))
    match random.randrange(4):
        case 0:
            del entries[at]
        case 1:
            entries.append(replace(entries[at], energy_J=_amount(random, 1e-4, 1e4)))
        case 2:
            entries[at] = replace(entries[at], part="another")
        case _:
            more = entries[at].energy_J + _amount(random, 1e-4, 1e4)
            entries[at] = replace(entries[at], energy_J=more)
    return scene, replace(plan, ledger=EnergyLedger(tuple(entries)))


def _tour(scene: Scene, plan: Plan, random: Random) -> Case:
    robots = [robot for robot, tour in plan.tours.items() if len(set(tour)) > 1]
    if not robots:
        raise InapplicableError
    robot = random.choice(robots)
    tour = [*plan.tours[robot]]
    at = random.randrange(len(tour) - 1)
    if random.random() < 0.5:
        tour[at] = "nowhere"
    else:
        tour = tour[::-1]
    if tour == [*plan.tours[robot]]:
        raise InapplicableError
    return scene, replace(plan, tours={**plan.tours, robot: tuple(tour)})


def _no_tour(scene: Scene, plan: Plan, random: Random) -> Case:
    robot = random.choice([*plan.tours])
    left = {name: tour for name, tour in plan.tours.items() if name != robot}
    return scene, replace(plan, tours=left)


def _goal(scene: Scene, plan: Plan, random: Random) -> Case:
    """Move a goal to where no robot comes."""
    at = random.randrange(len(scene.goals))
    goal = scene.goals[at]
    low, high = np.reshape(scene.bounds, (2, 2))
    driven_to = np.concatenate([item.state[:, :2] for item in plan.trajectories])
    for _ in range(200):
        center = np.array(
            [random.uniform(*pair) for pair in zip(low, high, strict=True)]
        )
        if np.hypot(*(driven_to - center).T).min() > 0.2:
            ring = np.zeros((0, 2))
            region = Region(center=center, radius_m=0.1, corners=ring)
            goals = (
                *scene.goals[:at],
                replace(goal, region=region),
                *scene.goals[at + 1 :],
            )
            return _asked(scene, plan, goals=goals)
    raise InapplicableError


def _dwell(scene: Scene, plan: Plan, random: Random) -> Case:
    at = random.randrange(len(scene.goals))
    longer = replace(scene.goals[at], dwell_s=plan.makespan_s + random.uniform(1, 1e4))
    goals = (*scene.goals[:at], longer, *scene.goals[at + 1 :])
    return _asked(scene, plan, goals=goals)


def _late(scene: Scene, plan: Plan, random: Random) -> Case:
    limit_s = plan.makespan_s * random.uniform(0.01, 0.999)
    return _asked(scene, plan, time_limit_s=limit_s)


def _finish(scene: Scene, plan: Plan, random: Random) -> Case:
    trajectory = random.choice(plan.trajectories)
    x, y, yaw = trajectory.state[-1, :3].tolist()
    off_m = random.choice((0.0, random.uniform(0.2, 9.0)))
    center = np.array([x + off_m, y])
    region = Region(center=center, radius_m=0.1, corners=np.zeros((0, 2)))
    heading = yaw + random.choice((-1, 1)) * random.uniform(0.11, 3.0)
    finish = Finish(region=region, heading_rad=heading, heading_tolerance_rad=0.1)
    return _with_robot(scene, plan, trajectory.robot, finish=finish)


def _bounds(scene: Scene, plan: Plan, random: Random) -> Case:
    """Draw the bounds in until the reference point of a robot is outside."""
    state = _moving(plan, random).state
    axis = random.randrange(2)
    bounds = [*scene.bounds]
    low, high = float(state[:, axis].min()), float(state[:, axis].max())
    if high - low < 0.5:
        raise InapplicableError
    inside = low + random.uniform(0.05, 0.95) * (high - low)
    bounds[axis + random.choice((0, 2))] = inside
    return _asked(scene, plan, bounds=tuple(bounds))


def _post(scene: Scene, plan: Plan, random: Random) -> Case:
    """Put a post where no pose of the plan touches it, but motion between two does."""
    trajectory = _moving(plan, random)
    post = thin_post(scene.robot(trajectory.robot).model, trajectory, random)
    if post is None:
        raise InapplicableError
    return _asked(scene, plan, obstacles=(*scene.obstacles, post))


def _other_robot(scene: Scene, plan: Plan, random: Random) -> Case:
    """Let one robot make its motion from a start that leads it into another one."""
    if len(plan.trajectories) < 2:
        raise InapplicableError
    one, other = random.sample(plan.trajectories, 2)
    steps = min(len(one.state), len(other.state))
    step = random.randrange(steps)
    start = one.state[0].copy()
    jitter = [random.uniform(-0.1, 0.1) for _ in range(2)]
    start[:2] += other.state[step, :2] - one.state[step, :2] + jitter
    moved = driven(scene, one, one.control, start)
    pose = tuple(start[:3].tolist())
    return _with_robot(scene, _with(plan, moved), one.robot, pose=pose)


def _station(scene: Scene, plan: Plan, random: Random) -> Case:
    """Let a station for one robot stand where two robots are at once."""
    if len(plan.trajectories) < 2 or not scene.stations:
        raise InapplicableError
    one, other = random.sample(plan.trajectories, 2)
    step = random.randrange(min(len(one.state), len(other.state)))
    middle = (one.state[step, :2] + other.state[step, :2]) / 2
    radius_m = float(np.hypot(*(one.state[step, :2] - middle))) + 1.0
    region = Region(center=middle, radius_m=radius_m, corners=np.zeros((0, 2)))
    station = replace(scene.stations[0], region=region, one_at_a_time=True)
    changed, again = _asked(scene, plan, stations=(station, *scene.stations[1:]))
    tours = {item.robot: (*plan.tours[item.robot], station.id) for item in (one, other)}
    return changed, replace(again, tours={**plan.tours, **tours})


def _other_scene(scene: Scene, plan: Plan, random: Random) -> Case:
    return scene, replace(plan, scene_digest=f"{random.getrandbits(64):016x}")


def _stranger(scene: Scene, plan: Plan, random: Random) -> Case:
    trajectory = random.choice(plan.trajectories)
    if random.random() < 0.5:
        rest = tuple(item for item in plan.trajectories if item is not trajectory)
        return scene, replace(plan, trajectories=rest)
    named = tuple(
        replace(item, robot="stranger") if item is trajectory else item
        for item in plan.trajectories
    )
    return scene, replace(plan, trajectories=named)


DAMAGES = tuple(
    Damage(what=what, rule=rule, make=make)
    for what, rule, make in (
        ("states: x", Kind.DYNAMICS, _state(0)),
        ("states: y", Kind.DYNAMICS, _state(1)),
        ("states: speed", Kind.DYNAMICS, _state(3)),
        ("states: steering or yaw rate", Kind.DYNAMICS, _state(4)),
        ("states: not finite", Kind.MALFORMED, _not_finite),
        ("states: another shape", Kind.MALFORMED, _shape),
        ("states: another start", Kind.START, _start),
        ("states: cut off while driving", Kind.FINAL_REST, _cut_off),
        ("headings", Kind.DYNAMICS, _state(2)),
        ("headings at the finish", Kind.FINISH, _finish),
        ("controls", Kind.DYNAMICS, _control),
        ("limits of controls", Kind.CONTROL_LIMIT, _exceeding_control),
        ("limits of speed", Kind.STATE_LIMIT, _exceeding_state("v_max_m_s", 3)),
        ("limits of steering", Kind.STATE_LIMIT, _exceeding_state("w_max", 4)),
        ("clocks: the plan's step", Kind.DYNAMICS, _clock),
        ("clocks: one robot's step", Kind.MALFORMED, _clock_of_one),
        ("clocks: time limit", Kind.LATE, _late),
        (
            "visits: step",
            Kind.VISIT,
            _visit(lambda v, r: [replace(v, step=v.step + r.choice((-3, -1, 1, 9)))]),
        ),
        (
            "visits: time",
            Kind.VISIT,
            _visit(lambda v, r: [replace(v, time_s=v.time_s + _amount(r, 1e-6, 99))]),
        ),
        (
            "visits: charge",
            Kind.VISIT,
            _visit(_other_charge),
        ),
        (
            "visits: target",
            Kind.VISIT,
            _visit(lambda v, r: [replace(v, target=f"{v.target}x")]),
        ),
        ("visits: left out", Kind.VISIT, _visit(lambda v, r: [])),
        ("visits: twice", Kind.VISIT, _visit(lambda v, r: [v, v])),
        (
            "visits: of nobody",
            Kind.MALFORMED,
            _visit(lambda v, r: [replace(v, robot="nobody")]),
        ),
        ("visits: a recharge away from stations", Kind.RECHARGE, _false_recharge),
        ("visits: tour", Kind.TOUR, _tour),
        ("visits: no tour", Kind.MALFORMED, _no_tour),
        ("visits: a goal elsewhere", Kind.GOAL_MISSED, _goal),
        ("visits: dwell time", Kind.DWELL, _dwell),
        ("visits: two at a station for one", Kind.OCCUPIED, _station),
        ("energies: less in the battery", Kind.ENERGY, _low_battery),
        ("ledgers", Kind.LEDGER, _ledger),
        *[("posts between two poses", Kind.OBSTACLE, _post)] * 3,
        ("bounds", Kind.BOUNDS, _bounds),
        *[("other robots on the path", Kind.ROBOT, _other_robot)] * 2,
        ("another scene", Kind.SCENE_MISMATCH, _other_scene),
        ("robots left out or unknown", Kind.MALFORMED, _stranger),
    )
)
