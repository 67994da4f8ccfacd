"""Damage to missions: visits, tours, goals, stations, energies and who takes part."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from random import Random

import numpy as np

from faults.changes import (
    Case,
    InapplicableError,
    Make,
    amount,
    circle,
    swapped,
    with_robot,
    with_scene,
    with_trajectory,
)
from mrmg.energy.ledger import EnergyLedger
from mrmg.plans import Plan, Visit
from mrmg.scene.types import Finish, Scene


def change_visit(change: Callable[[Visit, Random], Sequence[Visit]]) -> Make:
    """Return what puts the visits that a function returns in a visit's place."""

    def make(scene: Scene, plan: Plan, random: Random) -> Case:
        if not plan.visits:
            raise InapplicableError
        at = random.randrange(len(plan.visits))
        changed = change(plan.visits[at], random)
        visits = [*plan.visits[:at], *changed, *plan.visits[at + 1 :]]
        return scene, replace(plan, visits=tuple(visits))

    return make


def other_step(visit: Visit, random: Random) -> list[Visit]:
    """Return the visit at another step."""
    return [replace(visit, step=visit.step + random.choice((-3, -1, 1, 9)))]


def other_time(visit: Visit, random: Random) -> list[Visit]:
    """Return the visit at another time."""
    return [replace(visit, time_s=visit.time_s + amount(random, 1e-6, 99))]


def other_charge(visit: Visit, random: Random) -> list[Visit]:
    """Return the visit with another charge."""
    energy_J = visit.energy_J + amount(random, 1e-4, 1e4)
    return [replace(visit, energy_J=energy_J)]


def other_target(visit: Visit, random: Random) -> list[Visit]:
    """Return the visit of an unknown target."""
    return [replace(visit, target=f"{visit.target}x")]


def other_robot(visit: Visit, random: Random) -> list[Visit]:
    """Return the visit by an unknown robot."""
    return [replace(visit, robot="nobody")]


def claim_recharge(scene: Scene, plan: Plan, random: Random) -> Case:
    """Say that the visit of a goal was one of a station."""
    goals = [visit for visit in plan.visits if visit.kind == "goal"]
    chosen = random.choice(goals)
    visits = swapped(plan.visits, chosen, replace(chosen, kind="station"))
    return scene, replace(plan, visits=visits)


def change_tour(scene: Scene, plan: Plan, random: Random) -> Case:
    """Name an unknown target in a tour, or turn the tour round."""
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


def leave_out_tour(scene: Scene, plan: Plan, random: Random) -> Case:
    """Leave out a robot's tour."""
    robot = random.choice([*plan.tours])
    left = {name: tour for name, tour in plan.tours.items() if name != robot}
    return scene, replace(plan, tours=left)


def move_goal(scene: Scene, plan: Plan, random: Random) -> Case:
    """Move a goal to where no robot comes."""
    goal = random.choice(scene.goals)
    low, high = np.reshape(scene.bounds, (2, 2))
    driven_to = np.concatenate([item.state[:, :2] for item in plan.trajectories])
    for _ in range(200):
        center = np.array(
            [random.uniform(*pair) for pair in zip(low, high, strict=True)]
        )
        if np.hypot(*(driven_to - center).T).min() > 0.2:
            moved = replace(goal, region=circle(center, 0.1))
            return with_scene(scene, plan, goals=swapped(scene.goals, goal, moved))
    raise InapplicableError


def lengthen_dwell(scene: Scene, plan: Plan, random: Random) -> Case:
    """Ask a robot to stay at a goal for longer than the mission takes."""
    goal = random.choice(scene.goals)
    longer = replace(goal, dwell_s=plan.makespan_s + random.uniform(1, 1e4))
    return with_scene(scene, plan, goals=swapped(scene.goals, goal, longer))


def shorten_time_limit(scene: Scene, plan: Plan, random: Random) -> Case:
    """Ask for an end of the mission before its plan ends."""
    limit_s = plan.makespan_s * random.uniform(0.01, 0.999)
    return with_scene(scene, plan, time_limit_s=limit_s)


def move_finish(scene: Scene, plan: Plan, random: Random) -> Case:
    """Ask a robot to end elsewhere, or facing elsewhere."""
    trajectory = random.choice(plan.trajectories)
    x, y, yaw = trajectory.state[-1, :3].tolist()
    off_m = random.choice((0.0, random.uniform(0.2, 9.0)))
    region = circle(np.array([x + off_m, y]), 0.1)
    heading = yaw + random.choice((-1, 1)) * random.uniform(0.11, 3.0)
    finish = Finish(region=region, heading_rad=heading, heading_tolerance_rad=0.1)
    return with_robot(scene, plan, trajectory.robot, finish=finish)


def share_station(scene: Scene, plan: Plan, random: Random) -> Case:
    """Let a station for one robot stand where two robots are at once."""
    if len(plan.trajectories) < 2 or not scene.stations:
        raise InapplicableError
    one, other = random.sample(plan.trajectories, 2)
    step = random.randrange(min(len(one.state), len(other.state)))
    middle = (one.state[step, :2] + other.state[step, :2]) / 2
    radius_m = float(np.hypot(*(one.state[step, :2] - middle))) + 1.0
    region = circle(middle, radius_m)
    station = replace(scene.stations[0], region=region, one_at_a_time=True)
    changed, again = with_scene(scene, plan, stations=(station, *scene.stations[1:]))
    tours = {item.robot: (*plan.tours[item.robot], station.id) for item in (one, other)}
    return changed, replace(again, tours={**plan.tours, **tours})


def drain_battery(scene: Scene, plan: Plan, random: Random) -> Case:
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
    return with_robot(scene, plan, robot.id, battery=battery)


def change_ledger(scene: Scene, plan: Plan, random: Random) -> Case:
    """Leave out, add, rename or change an entry of the ledger."""
    entries = [*plan.ledger.entries]
    at = max(range(len(entries)), key=lambda number: abs(entries[number].energy_J))
    match random.randrange(4):
        case 0:
            del entries[at]
        case 1:
            entries.append(replace(entries[at], energy_J=amount(random, 1e-4, 1e4)))
        case 2:
            entries[at] = replace(entries[at], part="another")
        case _:
            more = entries[at].energy_J + amount(random, 1e-4, 1e4)
            entries[at] = replace(entries[at], energy_J=more)
    return scene, replace(plan, ledger=EnergyLedger(tuple(entries)))


def name_other_scene(scene: Scene, plan: Plan, random: Random) -> Case:
    """Say that the plan is one for another scene."""
    return scene, replace(plan, scene_digest=f"{random.getrandbits(64):016x}")


def change_robots(scene: Scene, plan: Plan, random: Random) -> Case:
    """Leave out a robot's motion, or name an unknown robot."""
    trajectory = random.choice(plan.trajectories)
    if random.random() < 0.5:
        rest = tuple(item for item in plan.trajectories if item is not trajectory)
        return scene, replace(plan, trajectories=rest)
    return scene, with_trajectory(plan, trajectory, robot="stranger")
