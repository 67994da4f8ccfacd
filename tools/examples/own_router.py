"""Plan with a router of one's own: always the nearest goal, and a station before need.

Usage: python own_router.py FOLDER
"""

import sys
from math import inf
from pathlib import Path

import mrmg
from mrmg.planning import Routing, RoutingProblem, faults_of_tours


def nearest_goal(problem: RoutingProblem, seed: int) -> Routing:
    """Return tours: whichever robot is nearest to an open goal goes there next."""
    nothing = Routing(tuple(() for _ in range(problem.robots)), inf)
    tours: list[list[int]] = [[] for _ in range(problem.robots)]
    left_J = problem.start_energy_J.copy()
    goals = {goal for goal in range(problem.goals) if problem.open_goals[goal]}
    while goals:
        steps, charging = [], []
        for robot, tour in enumerate(tours):
            leg_J = problem.leg_energy_J[robot, tour[-1] if tour else problem.targets]
            spare_J = left_J[robot] - problem.reserve_J[robot] - leg_J
            for goal in goals:  # from there it must still reach a station, or its end
                if spare_J[goal] >= problem.escape_J[robot, goal]:
                    steps.append((leg_J[goal], robot, goal))
            for station in range(problem.goals, problem.targets):
                if spare_J[station] >= 0.0 and tour[-1:] != [station]:
                    charging.append((leg_J[station], robot, station))
        if not steps and not charging:
            return nothing
        leg_J, robot, target = min(steps or charging)
        if sum(map(len, tours)) > 3 * problem.targets:
            return nothing  # going round in circles
        goals.discard(target)
        tours[robot].append(target)
        left_J[robot] -= leg_J
        if target >= problem.goals:
            left_J[robot] = problem.capacity_J[robot]
    cost_J = 0.0
    for robot, tour in enumerate(tours):
        nodes = [problem.targets, *tour]
        for leg in zip(nodes, nodes[1:], strict=False):
            cost_J += problem.leg_energy_J[(robot, *leg)]
        cost_J += problem.finish_energy_J[robot, nodes[-1]]
    found = Routing(tuple(map(tuple, tours)), cost_J)
    return nothing if any(faults_of_tours(problem, found)) else found


if __name__ == "__main__":
    scene = mrmg.load_scene("quickstart")
    for router in ("search", nearest_goal):
        result = mrmg.plan(scene, router=router)
        assert result.plan is not None, result.reason
        print(f"{result.plan.router}: {result.plan.cost_J / 1e3:.2f} kJ")
        folder = Path(sys.argv[1]) / result.plan.router.replace(":", ".")
        folder.mkdir(parents=True, exist_ok=True)
        result.plan.save(folder)
