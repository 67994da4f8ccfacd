"""Every parameter of the planner, with its symbol in the paper and its limits."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace

from mrmg import storage
from mrmg.errors import UsageError
from mrmg.planning.routing.routing import RouterParams

PROFILES = ("default", "paper")

THOROUGH = 6
"""Refinements of each plan when there is a budget to be spent."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParams:
    """Parameters of roadmap, router and motion tree.

    Attributes:
        profile: "default", or "paper" for the method to the letter.
        samples: free samples of the roadmap (ConstructPRM).
        neighbours: nearest vertices joined in the roadmap.
        router: parameters of NRPA.
        dt_s: step of the motion model, dt [s].
        steps: steps of one expansion, k.
        max_vertices: size of one tree at which it is given up.
        trees: trees grown at most; a tree that fails is followed by one with new draws.
        improvements: further trees grown after the first plan; the cheapest plan
            counts.
        drafts: drive along tours without a tree where that succeeds.
        spare: share of every battery's capacity that plans leave above the reserve
            where they can, for robots that take more than their models say. With a
            tenth, a robot that uses all it may on one charge can take 12 % more.
        refinements: times that the plan of each tree is drawn tight and driven again,
            as long as that saves energy.
        group_alpha, group_beta, group_lambda: alpha, beta, lambda of eq. (5).
        group_bias: probability of taking the group of largest weight instead of
            drawing.
        steer_start, steer_decay, steer_least: probability that an expansion steers
            instead of applying random controls: first value, factor per expansion,
                floor.
        obstacle_margin_m: distance kept from obstacles at the time steps [m]. Between
            two steps of 0.1 s no corner of the car moves more than 0.16 m from both
            ends, so the default also keeps the motion in between clear, and leaves room
            for tracking errors.
        robot_margin_m: distance kept between robots at the time steps [m].
        region_m: side of the square regions that tell groups apart [m].
        route_margin: surcharge on roadmap energies in routing, for what the roadmap
            does
            not see: turns, corrections, speed changes.
        budget_s: time limit [s]; None for none. With a limit only validity is promised,
            without one the plan is a function of scene, seed and parameters.
    """

    profile: str = "default"
    samples: int = 1500
    neighbours: int = 12
    router: RouterParams = field(default_factory=RouterParams)
    dt_s: float = 0.1
    steps: int = 15
    max_vertices: int = 6000
    trees: int = 12
    improvements: int = 1
    drafts: bool = True
    spare: float = 0.1
    refinements: int = 2
    group_alpha: float = 1.0
    group_beta: float = 4.0
    group_lambda: float = 0.98
    group_bias: float = 0.95
    steer_start: float = 1.0
    steer_decay: float = 0.9995
    steer_least: float = 0.97
    obstacle_margin_m: float = 0.25
    robot_margin_m: float = 0.5
    region_m: float = 6.0
    route_margin: float = 0.08
    budget_s: float | None = None

    def __post_init__(self) -> None:
        allowed = {
            "profile": self.profile in PROFILES,
            "samples": self.samples >= 0,
            "neighbours": self.neighbours >= 1,
            "dt_s": 0.0 < self.dt_s <= 0.2,
            "steps": 1 <= self.steps <= 200,
            "max_vertices": self.max_vertices >= 2,
            "trees": self.trees >= 1,
            "improvements": self.improvements >= 0,
            "refinements": self.refinements >= 0,
            "spare": 0.0 <= self.spare < 1.0,
            "group_lambda": 0.0 < self.group_lambda <= 1.0,
            "group_bias": 0.0 <= self.group_bias <= 1.0,
            "steer_start": 0.0 <= self.steer_start <= 1.0,
            "steer_decay": 0.0 < self.steer_decay <= 1.0,
            "steer_least": 0.0 <= self.steer_least <= 1.0,
            "obstacle_margin_m": 0.0 <= self.obstacle_margin_m <= 1.0,
            "robot_margin_m": 0.0 <= self.robot_margin_m <= 2.0,
            "region_m": self.region_m > 0.0,
            "route_margin": 0.0 <= self.route_margin <= 1.0,
            "budget_s": self.budget_s is None or self.budget_s > 0.0,
        }
        wrong = [name for name, fine in allowed.items() if not fine]
        if wrong:
            values = ", ".join(f"{name} = {getattr(self, name)!r}" for name in wrong)
            raise UsageError(f"planner parameters out of range: {values}")

    @property
    def digest(self) -> str:
        """Fingerprint of all parameters that decide the plan."""
        values = asdict(self)
        del values["budget_s"]
        return storage.digest(storage.canonical_json(values))


def profile_params(
    profile: str,
    *,
    budget_s: float | None = None,
    trees: int | None = None,
    spare: float | None = None,
) -> PlannerParams:
    """Return the parameters of a profile.

    Args:
        profile: "default" or "paper".
        budget_s: time limit [s]; None for none.
        trees: number of trees to grow, all of them; None for the profile's.
        spare: share of every battery's capacity that plans leave above the reserve
            where they can; None for the profile's.

    Raises:
        UsageError: if the profile is unknown, or a number is out of range.
    """
    params = _profile(profile, budget_s)
    if params.refinements and (budget_s is not None or trees is not None):
        params = replace(params, refinements=THOROUGH)
    if spare is not None:
        params = replace(params, spare=spare)
    if trees is not None:
        return replace(params, trees=trees, improvements=trees)
    return params


def _profile(profile: str, budget_s: float | None) -> PlannerParams:
    base = PlannerParams(profile=profile, budget_s=budget_s)
    if profile == "paper":
        # A new tour at every reached goal, one control held for the whole expansion.
        return replace(
            base,
            router=RouterParams(levels=2, iterations=20, rounds=0),
            steps=5,
            max_vertices=60_000,
            trees=2,
            improvements=0,
            drafts=False,
            spare=0.0,
            refinements=0,
            steer_decay=0.9999,
            steer_least=0.5,
        )
    return base
