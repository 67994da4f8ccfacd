"""From a scene to a plan: roadmap, routers, planners."""

from mrmg.planning.parameters import (
    PROFILES as PROFILES,
)
from mrmg.planning.parameters import (
    PlannerParams as PlannerParams,
)
from mrmg.planning.parameters import (
    profile_params as profile_params,
)
from mrmg.planning.planner import plan_mission as plan_mission
from mrmg.planning.statistics import Improvement as Improvement

__all__ = ["Improvement", "PROFILES", "PlannerParams", "plan_mission", "profile_params"]
