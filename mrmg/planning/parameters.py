"""Every parameter of the planners, with its symbol in the paper and its limits."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace

from mrmg import extensions, storage
from mrmg.errors import UsageError, require_known, require_types
from mrmg.planning.routing.routing import RouterParams
from mrmg.plans import LONGEST_STEP_S
from mrmg.ranges import Range, require_ranges
from mrmg.scene.margins import STATES_NONE, Margins

PROFILES = ("default", "paper")

PATH_FOLLOWING, GUIDED_TREE = PLANNERS = extensions.BUILT_IN[extensions.PLANNERS]
"""Planners of this package: path following along tours, with a search for motions where
that fails; and the paper's method (`guided_tree`)."""

THOROUGH = 6
"""Refinements of each plan when there is a budget to be spent."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidedTreeParams:
    """Parameters of the paper's Algorithms 1-3 (`guided_tree`).

    Attributes:
        iterations: hard cap on the iterations of Algorithm 1.
        k: steps of dt for which Algorithm 3 holds its controls, at most.
        alpha: of eq. (5); beta follows from it (`_tree_kernels`).
        decline: lambda of eq. (5), in (0, 1).
        bias: probability of selecting the group of largest weight instead of drawing.
        vertex_spread_m: distance to the target by which a vertex becomes less likely
            than another one of its group by a factor of e [m].
        decay_start: Decay(0), the probability of steering in a new group.
        decay_rate: factor by which Decay nears decay_least for each expansion of the
            group, in (0, 1).
        decay_least: what Decay falls to.
        ahead_least_m, ahead_most_m: range from which SampleTarget draws how far along
            its path a robot's target lies [m].
        target_spread_m: radius of the disc about that point in which it lies [m].
    """

    iterations: int = 300_000
    k: int = 5
    alpha: float = 1.0
    decline: float = 0.9997
    bias: float = 0.9
    vertex_spread_m: float = 1.0
    decay_start: float = 0.98
    decay_rate: float = 0.99
    decay_least: float = 0.3
    ahead_least_m: float = 1.5
    ahead_most_m: float = 6.0
    target_spread_m: float = 0.5

    def __post_init__(self) -> None:
        what = "parameters of the guided tree"
        require_ranges(self, GUIDED_TREE_RANGES, what)
        between = {
            "decay_least": Range(0.0, self.decay_start, ends="[)"),
            "ahead_least_m": Range(0.0, self.ahead_most_m),
        }
        require_ranges(self, between, what)


GUIDED_TREE_RANGES = {
    "iterations": Range(1, whole=True),
    "k": Range(1, 200, whole=True),
    "alpha": Range(ends="(]"),
    "decline": Range(0.0, 1.0, ends="()"),
    "bias": Range(0.0, 1.0),
    "vertex_spread_m": Range(ends="(]"),
    "decay_start": Range(0.0, 1.0, ends="(]"),
    "decay_rate": Range(0.0, 1.0, ends="()"),
    "decay_least": Range(),
    "ahead_least_m": Range(),
    "ahead_most_m": Range(),
    "target_spread_m": Range(),
}
"""What they may be."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParams:
    """Parameters of roadmap, router and planners.

    Attributes:
        profile: "default", or "paper" for the paper's method and parameters.
        planner: name of the planner (`planners.find_planner`).
        guided_tree: parameters of the planner of that name.
        samples: free samples of the roadmap (ConstructPRM).
        neighbours: nearest vertices joined in the roadmap.
        router: name and parameters of the router; the planner guided_tree takes nrpa.
        dt_s: step of the motion model, dt [s].
        trees: attempts at most; one that fails is followed by one with new draws.
        improvements: attempts after the one with the first plan; the best plan counts.
        follow_paths: follow paths along tours, without a search where that succeeds.
        soc_margin: share of every battery's capacity that plans leave above the reserve
            where they can, for robots that take more than their models say. With a
            tenth, a robot that uses all it may on one charge can take 12 % more.
        refinements: times that the plan of an attempt is smoothed and driven again,
            as long as that saves energy.
        obstacle_margin_m: distance kept from obstacles at the time steps [m], by every
            robot; None for each robot's own (`kept_margins`). Between two steps no
            corner of the car moves more than 0.16 m from both ends, so that its default
            keeps it clear in between, too; where a margin is less than that, robots are
            followed through each step.
        robot_margin_m: distance kept between robots at the time steps [m], likewise.
        route_margin: surcharge on roadmap energies in routing, for what the roadmap
            does not see: turns, corrections, speed changes.
        budget_s: time limit [s]; None for none. With a limit only validity is promised,
            without one the plan is a function of scene, seed and parameters.
    """

    profile: str = "default"
    planner: str = PATH_FOLLOWING
    guided_tree: GuidedTreeParams = field(default_factory=GuidedTreeParams)
    samples: int = 1500
    neighbours: int = 12
    router: RouterParams = field(default_factory=RouterParams)
    dt_s: float = 0.1
    trees: int = 12
    improvements: int = 1
    follow_paths: bool = True
    soc_margin: float = 0.1
    refinements: int = 2
    obstacle_margin_m: float | None = None
    robot_margin_m: float | None = None
    route_margin: float = 0.08
    budget_s: float | None = None

    def __post_init__(self) -> None:
        require_known("profile", self.profile, PROFILES)
        require_types((self.guided_tree, GuidedTreeParams), (self.router, RouterParams))
        require_ranges(self, RANGES, "planner parameters")
        if self.planner == GUIDED_TREE and self.router.method != "nrpa":
            raise UsageError(
                f"planner {GUIDED_TREE} finds its tours by router nrpa alone, not by "
                f"{self.router.method}; name router nrpa, or plan with {PATH_FOLLOWING}"
            )
        if self.profile == "paper" and self.planner != GUIDED_TREE:
            raise UsageError(
                f"profile paper is planner {GUIDED_TREE} with router nrpa; leave the "
                f"profile out to plan with {self.planner}"
            )

    @property
    def margins(self) -> Margins:
        """The margins that are stated for every robot."""
        return Margins(obstacle_m=self.obstacle_margin_m, robot_m=self.robot_margin_m)

    def with_margins(self, margins: Margins) -> PlannerParams:
        """Return the parameters with margins for every robot, as far as stated."""
        stated = margins.over(self.margins)
        return replace(
            self, obstacle_margin_m=stated.obstacle_m, robot_margin_m=stated.robot_m
        )

    @property
    def digest(self) -> str:
        """Fingerprint of all parameters that decide the plan."""
        values = asdict(self)
        del values["budget_s"]
        return storage.digest(storage.canonical_json(values))


RANGES = {
    "samples": Range(whole=True),
    "neighbours": Range(1, whole=True),
    "dt_s": Range(0.0, LONGEST_STEP_S, ends="(]"),
    "trees": Range(1, whole=True),
    "improvements": Range(whole=True),
    "refinements": Range(whole=True),
    "soc_margin": Range(0.0, 1.0, ends="[)"),
    "obstacle_margin_m": Range(0.0, 1.0, optional=True),
    "robot_margin_m": Range(0.0, 2.0, optional=True),
    "route_margin": Range(0.0, 1.0),
    "budget_s": Range(ends="(]", optional=True),
}
"""What the numbers among them may be."""


def kernels_of(planner: str) -> str:
    """Return the name of the part of all kernels that a planner needs."""
    return GUIDED_TREE if planner == GUIDED_TREE else PATH_FOLLOWING


def profile_params(
    profile: str = "default",
    *,
    planner: str | None = None,
    router: str | None = None,
    budget_s: float | None = None,
    trees: int | None = None,
    soc_margin: float | None = None,
    margins: Margins = STATES_NONE,
) -> PlannerParams:
    """Return the parameters of a profile.

    Args:
        profile: "default" or "paper", which is planner guided_tree with router nrpa.
        planner: name of the planner; None for the profile's.
        router: name of the router; None for the planner's.
        budget_s: time limit [s]; None for none.
        trees: number of trees to grow, all of them; None for the profile's.
        soc_margin: share of every battery's capacity that plans leave above the reserve
            where they can; None for the profile's.
        margins: distances that every robot keeps, in place of its own.

    Raises:
        UsageError: if a name is unknown, names contradict each other, or a number is
            out of range.
    """
    if planner is not None:
        extensions.require(extensions.PLANNERS, planner)
    if router is not None:
        extensions.require(extensions.ROUTERS, router)
    guided = planner == GUIDED_TREE or (planner is None and profile == "paper")
    params = paper_params() if guided else PlannerParams()
    if profile != "default":
        params = replace(params, profile=profile)
    if planner is not None:
        params = replace(params, planner=planner)
    if router is not None:
        params = replace(params, router=replace(params.router, method=router))
    params = replace(params, budget_s=budget_s).with_margins(margins)
    if params.refinements and (budget_s is not None or trees is not None):
        params = replace(params, refinements=THOROUGH)
    if soc_margin is not None:
        params = replace(params, soc_margin=soc_margin)
    if trees is not None:
        return replace(params, trees=trees, improvements=trees)
    return params


def paper_params() -> PlannerParams:
    """Return the parameters of the paper's method: one tree, as its first plan is."""
    return PlannerParams(
        profile="paper",
        planner=GUIDED_TREE,
        router=RouterParams(method="nrpa", levels=2, iterations=12, rounds=0),
        trees=1,
        improvements=0,
        soc_margin=0.0,
        refinements=0,
    )
