"""From a scene to a plan: roadmap, routers, planners.

For planners and routers of your own: `Planner`, `Problem`, `Request`, `Attempt` and
`GivenUp`; `Router`, `RoutingProblem` and `Routing`.
"""

from mrmg.planning.attempt import Attempt, GivenUp, Request
from mrmg.planning.parameters import PROFILES, PlannerParams, profile_params
from mrmg.planning.planner import plan_mission
from mrmg.planning.planners import Planner
from mrmg.planning.problem.problem import Problem
from mrmg.planning.routers import Router
from mrmg.planning.routing.routing import Routing
from mrmg.planning.routing.routing_problem import RoutingProblem, faults_of_tours
from mrmg.planning.statistics import Improvement

__all__ = [
    "Attempt",
    "GivenUp",
    "Improvement",
    "PROFILES",
    "Planner",
    "PlannerParams",
    "Problem",
    "Request",
    "Router",
    "Routing",
    "RoutingProblem",
    "faults_of_tours",
    "plan_mission",
    "profile_params",
]
