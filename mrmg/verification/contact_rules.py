"""Rules of space: no footprint meets an obstacle, the bounds or another footprint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from mrmg.plans import Trajectory
from mrmg.scene.types import Obstacle, Robot, Scene
from mrmg.verification.clearance import (
    BoundsGap,
    Gap,
    GapMinimum,
    ObstacleGap,
    PairGap,
    bounded_minimum,
)
from mrmg.verification.distances import boxes_apart_m
from mrmg.verification.motion_rules import changing_steps, worst_of_runs
from mrmg.verification.swept_footprint import SweptFootprint
from mrmg.verification.verdict import Violation, ViolationKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Contacts:
    """What one check of space found.

    Attributes:
        clearance_m: certified smallest distance, 0 on contact; inf if there is nothing
            to keep clear of.
        violations: contacts, consecutive ones merged.
    """

    clearance_m: float = np.inf
    violations: Sequence[Violation] = ()


def check_obstacles(
    scene: Scene, robot: Robot, trajectory: Trajectory
) -> list[Contacts]:
    """Return the robot's contacts with obstacles, then with the bounds."""
    footprint = SweptFootprint(robot.model, trajectory)
    contacts = [_bounds_contacts(robot.id, footprint, scene.bounds)]
    obstacles = [item for item in scene.barriers if item.stops(robot.id)]
    if obstacles:
        contacts.append(_obstacle_contacts(robot.id, footprint, obstacles))
    return contacts


def _least_gap(gap: Gap, footprint: SweptFootprint) -> GapMinimum:
    """Return the certified minimum of a gap to what stands still.

    Steps that are like the one before them are looked at only where there is contact.
    """
    control = footprint.control
    distinct = np.flatnonzero(changing_steps(footprint.state, control))
    found = bounded_minimum(gap, distinct, footprint.dt_s)
    if len(found.contact_step) and len(distinct) < len(control):
        return bounded_minimum(gap, np.arange(len(control)), footprint.dt_s)
    return found


def check_robots(scene: Scene, trajectories: Sequence[Trajectory]) -> list[Contacts]:
    """Return the contacts of every pair of robots.

    Of pairs that are farther apart than another pair comes to each other, the clearance
    is what circles around their footprints, or boxes around their motions, are apart.

    Args:
        scene: gives the footprints.
        trajectories: of equal length, one per robot.
    """
    footprints = [
        SweptFootprint(scene.robot(item.robot).model, item) for item in trajectories
    ]
    first, second = np.triu_indices(len(footprints), 1)
    reach_m = np.array([one.reach_m for one in footprints])
    apart_m = boxes_apart_m(trajectories) - reach_m[:, None] - reach_m
    bounds_m = apart_m[first, second].tolist()
    contacts = [Contacts(clearance_m=least_m) for least_m in bounds_m]
    nearest_m = np.inf
    for i in np.argsort(bounds_m, kind="stable").tolist():
        if bounds_m[i] > nearest_m:
            break  # all others are farther apart
        pair = footprints[first[i]], footprints[second[i]]
        gap = PairGap(*pair)
        least_m = gap.least_apart_m()
        contacts[i] = Contacts(clearance_m=least_m)
        if least_m <= nearest_m:
            touched = bounded_minimum(gap, gap.close_steps(), pair[0].dt_s)
            robot, other = (trajectories[k[i]].robot for k in (first, second))
            contacts[i] = _pair_contacts((robot, other), pair, touched)
            nearest_m = min(nearest_m, contacts[i].clearance_m)
    return contacts


def _obstacle_contacts(
    robot: str, footprint: SweptFootprint, obstacles: Sequence[Obstacle]
) -> Contacts:
    touched = _least_gap(ObstacleGap(footprint, obstacles), footprint)
    shapes = _footprints_on_contact(footprint, touched)
    tree = shapely.STRtree([obstacle.shape for obstacle in obstacles])
    # Contacts that lie below the resolution do not intersect; their nearest counts.
    nearest = tree.query_nearest(shapes, all_matches=False)
    crossing = tree.query(shapes, predicate="intersects")
    pairs = np.unique(np.concatenate([nearest, crossing], axis=1), axis=1)
    violations = []
    for index in np.unique(pairs[1]):
        obstacle = obstacles[index]
        contacts = pairs[0, pairs[1] == index]
        overlap_m2 = np.full(len(shapes), -np.inf)
        overlap_m2[contacts] = shapely.area(
            shapely.intersection(shapes[contacts], obstacle.shape)
        )
        partner = (ViolationKind.OBSTACLE, obstacle.id)
        violations += _violations(robot, footprint, touched, partner, overlap_m2)
    return Contacts(clearance_m=touched.clearance_m, violations=violations)


def _bounds_contacts(
    robot: str, footprint: SweptFootprint, bounds: tuple[float, float, float, float]
) -> Contacts:
    gap = BoundsGap(footprint, bounds)
    touched = _least_gap(gap, footprint)
    inside_m = gap.at(touched.contact_step, touched.contact_time_s)
    partner = (ViolationKind.BOUNDS, "bounds")
    outside_m = np.maximum(-inside_m, 0.0)
    violations = _violations(robot, footprint, touched, partner, outside_m)
    return Contacts(clearance_m=touched.clearance_m, violations=violations)


def _pair_contacts(
    robots: tuple[str, str],
    footprints: tuple[SweptFootprint, SweptFootprint],
    touched: GapMinimum,
) -> Contacts:
    shapes = [_footprints_on_contact(item, touched) for item in footprints]
    overlap_m2 = shapely.area(shapely.intersection(*shapes))
    partner = (ViolationKind.ROBOT, robots[1])
    violations = _violations(robots[0], footprints[0], touched, partner, overlap_m2)
    return Contacts(clearance_m=touched.clearance_m, violations=violations)


def _message(robot: str, kind: ViolationKind, other: str, amount: float) -> str:
    if kind is ViolationKind.BOUNDS:
        return f"{robot}: reaches {amount:.3g} m beyond the bounds"
    overlap = f", overlapping by {amount:.3g} m^2" if amount > 0.0 else ""
    return f"{robot}: touches {kind.value} {other}{overlap}"


def _footprints_on_contact(
    footprint: SweptFootprint, touched: GapMinimum
) -> np.ndarray:
    corners = footprint.corners_at(touched.contact_step, touched.contact_time_s)
    shapes: np.ndarray = shapely.polygons(corners)
    return shapes


def _violations(
    robot: str,
    footprint: SweptFootprint,
    touched: GapMinimum,
    partner: tuple[ViolationKind, str],
    amount: np.ndarray,
) -> list[Violation]:
    """Return the worst contact of each run of consecutive steps.

    Args:
        robot: id of the robot.
        footprint: of the robot.
        touched: instants of contact.
        partner: kind and id of what is touched.
        amount: by how much at each of these instants; -inf where it is not touched.
    """
    kind, other = partner
    step = touched.contact_step
    by_step = np.full(len(footprint.state), -np.inf)
    np.maximum.at(by_step, step, amount)
    violations = []
    for worst_step in worst_of_runs(by_step, by_step > -np.inf):
        worst = int(np.flatnonzero((step == worst_step) & (amount == by_step[step]))[0])
        within_s = touched.contact_time_s[worst : worst + 1]
        state = footprint.states_at(step[worst : worst + 1], within_s)[0]
        violations.append(
            Violation(
                kind=kind,
                robot=robot,
                other=other,
                time_s=float(worst_step * footprint.dt_s + within_s[0]),
                x_m=float(state[0]),
                y_m=float(state[1]),
                amount=float(amount[worst]),
                message=_message(robot, kind, other, float(amount[worst])),
            )
        )
    return violations
