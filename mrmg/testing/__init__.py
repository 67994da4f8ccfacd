"""Contract suites: what planners, routers, controllers and motion models must keep.

They run under plain pytest. Subclass a suite in a test module of yours and return what
is to be tested:

    import mrmg.testing

    class TestMine(mrmg.testing.RouterContract):
        def router(self):
            return my_router

The suites of this package's own parts are made the same way.
"""

from mrmg.testing.controller_contract import ControllerContract
from mrmg.testing.motion_contract import MotionContract
from mrmg.testing.planner_contract import PlannerContract, sample_scene
from mrmg.testing.router_contract import RouterContract, sample_routing_problem

__all__ = [
    "ControllerContract",
    "MotionContract",
    "PlannerContract",
    "RouterContract",
    "sample_routing_problem",
    "sample_scene",
]
