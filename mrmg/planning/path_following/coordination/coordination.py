"""Motions of a whole fleet along its tours, found robot by robot.

Each robot's motion is found by a search over its own motions (`_search_kernels`), and
who has priority over whom by a search over the orders of robots (`priorities`). All
that is found can be driven exactly, and keeps clear at every step.

What is promised: every plan found keeps all margins. A round of the search ends without
a plan when no order of the robots that may matter has one, with cells as fine and
searches as long as the round allows, or when it has looked at as many nodes as it may.
Rounds are finer and longer, then they begin anew with other motions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from mrmg import seeding
from mrmg.planning.path_following._following_kernels import Course
from mrmg.planning.path_following.band import Path
from mrmg.planning.path_following.coordination import _search_kernels, leads, priorities
from mrmg.planning.path_following.coordination._guide_kernels import guide_at
from mrmg.planning.path_following.coordination._motion_kernels import Traffic
from mrmg.planning.path_following.coordination._node_kernels import (
    NODE,
    Nodes,
    Scratch,
    Setting,
    Task,
)
from mrmg.planning.path_following.coordination.fields import NO_GUIDE, UNKNOWN, Fields
from mrmg.planning.path_following.coordination.rounds import (
    LEAST_INFLATION,
    LONGEST,
    ROUNDS,
    ROUNDS_ALONE,
    SEARCHES,
    SHORTENING_MOST,
    UNTIMED_SHARE,
    YIELDING_S,
    YIELDING_WEIGHT,
    Round,
)
from mrmg.planning.path_following.coordination.tasks import (
    arrival_poses,
    horizon_steps,
    is_one_pose,
    task_of,
)
from mrmg.planning.path_following.coordination.traffic import (
    FleetTraffic,
    trajectories_of,
)
from mrmg.planning.path_following.tracking import (
    Drive,
    Motion,
    course_of,
    empty_path,
)
from mrmg.planning.problem.problem import Problem
from mrmg.planning.roadmap._fleet_kernels import MOST_CORNERS
from mrmg.plans import Trajectory

MOST_CURVE_NODES = 1500
"""Nodes of the curve that a robot drives home along, at most."""

BRAKING_SHARE = 0.8
"""Share of the largest deceleration that it brakes with at the end."""


def empty_nodes(task: Task) -> Nodes:
    """Return room for a search.

    The table has more places than there are ways on from all nodes, wherever they lead:
    it must never be full.
    """
    most, ways_on = task.most, len(task.motion) + _search_kernels.WAYS_ON
    return Nodes(
        state=np.empty((most, 5)),
        node=np.empty(most, NODE),
        key=np.empty(2 * most + 2),
        entry=np.empty(2 * most + 2, np.int64),
        table=np.full(1 << (ways_on * most).bit_length(), -1, np.int64),
        size=np.array([0, 0, -1]),
        weight=np.array([task.weight]),
    )


class _Planning:
    """Finds motions of one problem's robots in one round."""

    def __init__(
        self,
        problem: Problem,
        tours: Sequence[Sequence[int]],
        paths: Sequence[Path],
        drives: Sequence[Drive | None],
        horizon: int,
    ) -> None:
        self._problem = problem
        self._fields = Fields(problem)
        self._tours, self._paths = tours, paths
        self._courses = leads.courses(problem, paths, drives)
        self._arrivals = cache(lambda r: arrival_poses(problem, r, tours[r]))
        self._follows = [  # whether it has driven along a path to all its targets
            drive is not None and 0 < len(tour) == len(path.target)
            for tour, path, drive in zip(tours, paths, drives, strict=True)
        ]
        self._traffic = FleetTraffic(problem, horizon)
        self._control = np.zeros((horizon, 2))
        self._unmoved = [Motion(x[None], self._control[:0]) for x in problem.start]
        self._room = Scratch(
            state=np.zeros((horizon + 1, 5)),
            control=np.zeros((horizon, 2)),
            corner=np.empty((2, MOST_CORNERS, 2)),
            near=np.empty(len(tours), np.int64),
            curve=Course(
                node=empty_path(MOST_CURVE_NODES),
                size=np.zeros(1, np.int64),
                ease=0.0,
                stiffness=1.0,
            ),
        )
        self.round, self.nodes = ROUNDS[0], 0
        self._answers: dict[tuple[object, ...], Motion | None] = {}
        """Motions found, and None where there was none, by what was asked for."""
        self._known: dict[tuple[int, bytes], Motion] = {}
        """Motions kept, by robot and states: equal ones are one object, so that
        the same question is told by the identities of the motions in it."""

    def find(
        self,
        r: int,
        motions: Sequence[Motion | None],
        above: np.ndarray,
        *,
        yielding: bool = False,
        since: int = 0,
    ) -> Motion | None:
        """Return a motion of robot r without conflicts with the robots marked."""
        self.nodes += 1
        asked = (r, self.round, yielding, since, above.tobytes(), *map(id, motions))
        if asked not in self._answers:
            begun = motions[r] or self._unmoved[r]
            # A copy, as the kernel is compiled for arrays that can be written.
            self._begun = begun.state[: since + 1].copy()
            self._control[:since] = begun.control[:since]
            found = self._found(r, motions, above, yielding)
            self._answers[asked] = None if found is None else self.kept(r, found)
        return self._answers[asked]

    def kept(self, r: int, motion: Motion) -> Motion:
        """Return a motion of robot r that is kept; equal ones are one object."""
        return self._known.setdefault((r, motion.state.tobytes()), motion)

    def _found(
        self,
        r: int,
        motions: Sequence[Motion | None],
        above: np.ndarray,
        yielding: bool,
    ) -> Motion | None:
        now = self.round
        if yielding:
            now = replace(now, weight=YIELDING_WEIGHT, soft_s=YIELDING_S)
        tour, traffic = self._tours[r], self._traffic.around(r, motions, above)
        hard = traffic.robot["hard"]
        fields = self._fields.in_time(r, tour, traffic)
        known = fields.are_timed(r, tour, traffic)
        if hard.any() and not known:
            # Those that it must not meet may stand long before all others do.
            traffic = traffic._replace(end=int(traffic.robot["last"][hard].max()))
        follows = self._follows[r]
        arrivals, path = self._arrivals(r), self._paths[r]
        task = task_of(self._problem, r, tour, path, arrivals, now, driven=follows)

        def along_path() -> Motion | None:
            share = UNTIMED_SHARE if len(tour) > 1 and not yielding else 1
            longer = task._replace(most=min(share * now.most, LONGEST))
            longer = self._along_path(r, longer, now)
            return self._search(r, traffic, longer, self._courses[r])

        if not known:
            return along_path()
        for inflation in dict.fromkeys((now.inflation, LEAST_INFLATION)):
            timed, way = self._in_time(r, task, fields, traffic, inflation)
            if np.isfinite(guide_at(timed.guide, 0, 0, *self._problem.start[r, :2])):
                break
        else:
            return None  # others stand in its only way
        found = along_path() if follows and len(tour) > 1 else None
        return found or self._search(r, traffic, timed, way)

    def _in_time(
        self, r: int, task: Task, fields: Fields, traffic: Traffic, inflation: float
    ) -> tuple[Task, Course]:
        """Return a task with costs-to-go that know when the others are where.

        It does without the path. Robots that turn on the spot have the way down the
        costs-to-go instead. Where others stand close together, inflated ones leave no
        way between them.
        """
        problem, tour = self._problem, self._tours[r]
        costs = task.hold_share, task.soft_s / (task.steps * problem.dt_s)
        guide, way = fields.timed(r, tour, task.stay, traffic, costs, inflation)
        turning = fields.turning(r, tour) if self.round.turning else UNKNOWN
        task = task._replace(
            along=np.full(len(task.along), np.inf),
            home_along=False,
            guide=guide._replace(turning=turning),
        )
        return task, course_of(problem, r, leads.rounded_path(problem, r, way))

    def _along_path(self, r: int, task: Task, now: Round) -> Task:
        """Return a task with costs-to-go along the path, or among obstacles alone."""
        problem, path, tour = self._problem, self._paths[r], self._tours[r]
        led = len(path.target) == len(tour) or is_one_pose(problem, r, tour)
        led &= bool(np.isfinite(task.along).all())
        guide, rest_s = NO_GUIDE, 0.0
        if not (led and now.most == ROUNDS[0].most):
            turning = self._fields.turning(r, tour) if now.turning else UNKNOWN
            guide = self._fields.static(r, tour)._replace(turning=turning)
        if task.finish >= 0 and not task.home_along:
            rest_s = float(guide_at(guide, len(task.leg), 0, *path.node[-1]))
        return task._replace(guide=guide, rest_s=rest_s)

    def _search(
        self, r: int, traffic: Traffic, task: Task, course: Course
    ) -> Motion | None:
        mission = self._problem.mission
        search = Setting(
            own=mission.fleet[r : r + 1],
            spaces=mission.spaces,
            terrain=mission.terrain,
            targets=mission.targets,
            zones=mission.zones,
            course=course,
            traffic=traffic,
            task=task,
            dt=self._problem.dt_s,
        )
        curve = self._room.curve._replace(
            ease=float(BRAKING_SHARE * mission.fleet["limit"][r, 3]),
            stiffness=self._courses[r].stiffness,
        )
        nodes, room = empty_nodes(task), self._room._replace(curve=curve)
        count = _search_kernels.find_motion(
            search, nodes, room, self._begun, self._control
        )
        self.nodes += int(nodes.size[0])
        if count < 0:
            return None
        found = self._problem.trajectory(r, self._control[:count])
        return Motion(found.state, found.control)

    def find_alone(
        self,
        order: Sequence[int],
        drives: Sequence[Drive | None],
        first: Round,
        halt: np.ndarray,
    ) -> list[Motion] | None:
        """Return motions of all robots that may meet, None where one has none.

        Each makes what room it can for those that found theirs before it. One that
        finds none is searched for harder, and without regard to them.

        Args:
            order: in which robots that have not been driven are looked at.
            drives: of those that have.
            first: round that is tried first.
            halt: shape (1,); the search ends soon after it has turned true.
        """
        harder = [one for one in ROUNDS if one.most > first.most]
        motions = [None if drive is None else drive.motion for drive in drives]
        nobody, unseen = np.zeros(len(motions), bool), [None] * len(motions)
        for r in order:
            for self.round in [first, *harder][:ROUNDS_ALONE]:
                if motions[r] is None and not halt[0]:
                    seen = motions if self.round is first else unseen
                    motions[r] = self.find(r, seen, nobody)
            if motions[r] is None:
                return None
        self.round = first
        return [motion for motion in motions if motion is not None]

    def conflicts(self, r: int, motions: Sequence[Motion]) -> np.ndarray:
        """Return the step of r's first conflict with each robot, inf for never."""
        return self._traffic.conflicts(r, motions)


def coordinated(
    problem: Problem,
    tours: Sequence[Sequence[int]],
    paths: Sequence[Path],
    halt: np.ndarray,
    *,
    seed: int = 0,
    rounds: Sequence[Round] = ROUNDS,
    drives: Sequence[Drive | None] | None = None,
) -> tuple[Trajectory, ...]:
    """Return trajectories of all robots along their tours; empty if none were found.

    Args:
        problem: the mission.
        tours: targets of each robot; a finish comes last.
        paths: of each robot, with its stays; empty ones where there are none.
        halt: shape (1,); the search ends soon after it has turned true.
        seed: of the orders in which robots are looked at.
        rounds: that are made one after the other.
        drives: along their paths, of robots that have driven them alone.
    """
    robots = len(tours)
    drives = [None] * robots if drives is None else drives
    lasting = [0 if drive is None else len(drive.motion.control) for drive in drives]
    horizon = max(horizon_steps(problem, tours, paths), 2 * max(lasting))
    planning = _Planning(problem, tours, paths, drives, horizon)
    rng = seeding.stream(seed, "coordination")
    for now in rounds:
        order = rng.permutation(robots).tolist()
        alone = planning.find_alone(order, drives, now, halt)
        if alone is None:
            return ()
        most = SEARCHES * now.most * robots
        found = priorities.search_priorities(alone, planning, most, halt)
        if found is not None:
            planning.round = replace(now, most=max(now.most, SHORTENING_MOST))
            found = priorities.shortened(found, alone, planning, halt)
            return trajectories_of(problem, found)
    return ()
