"""What `summary.json` says of a run: its keys with their types, units and meanings.

`summary.schema.json` beside this module is what `mrmg scene schema --summary` prints.
Keys with a default are left out by older versions, or by planners that lack them.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core.core_schema import WithDefaultSchema

from mrmg.runs.execution_figures import Count, ExecutionFigures, Figures, NotNegative
from mrmg.scene.margins import NarrowPassage


class SkippedGoal(Figures):
    """A goal that is proven out of reach and was left out."""

    goal: str
    """Its id."""
    proof: str
    """Why no plan serves it."""


class ImprovedValue(Figures):
    """What a plan is better by."""

    name: str
    """As plan.objective.name."""
    unit: str
    """As plan.objective.unit."""
    value: float
    """As plan.objective.value, of this plan."""
    bound: NotNegative | None
    """What no plan's value undercuts, proven; null if it is not known."""


class Improvement(Figures):
    """A plan that was better than all before it."""

    time_s: NotNegative
    """From the start to this plan [s]."""
    cost_J: float
    """Its energy [J]."""
    makespan_s: NotNegative
    """Its makespan [s]."""
    bound_J: NotNegative | None
    """As plan.bound_J."""
    gap: float | None
    """As plan.gap, of this plan."""
    objective: ImprovedValue


class ObjectiveFigures(Figures):
    """What plans are compared by; less is better."""

    name: Literal["energy", "makespan", "blend"]
    """'energy', 'makespan', or 'blend' of both."""
    unit: Literal["J", "s", "1"]
    """Unit of the value: 'J', 's', or '1' for a blend."""
    energy_weight: NotNegative
    """Weight of the energy [1/J]."""
    makespan_weight: NotNegative
    """Weight of the makespan [1/s]."""
    value: float
    """energy_weight cost_J + makespan_weight makespan_s."""
    bound: NotNegative | None
    """What no plan's value undercuts, proven; null if it is not known."""


class PlanningTimes(Figures):
    """Wall-clock time of the planner [s]."""

    init: NotNegative
    """Roadmap, distances and lookup tables [s]."""
    routing: NotNegative
    """All calls of the router [s]."""
    first_solution: NotNegative
    """From the start to the first plan [s]."""
    total: NotNegative
    """From the start to the returned plan [s]."""


class KeptMargins(Figures):
    """Distances that a robot keeps at the time steps."""

    obstacle_m: float
    """From obstacles and bounds [m]."""
    robot_m: float
    """From other robots [m]; of two the larger one counts."""


class PlanFigures(Figures):
    """What the planner found and what it took."""

    cost_J: float
    """Energy the plan draws from all batteries [J]."""
    bound_J: NotNegative | None
    """Energy that no plan of the mission undercuts which keeps its time limit,
    proven [J]; null if it was not computed."""
    gap: float | None
    """Value of the objective / its proven bound - 1: the plan is at most this share
    worse than the best there is [1]; null without a bound above 0. With the
    objective 'energy' that is cost_J / bound_J - 1."""
    makespan_s: NotNegative
    """Time until the last robot has come to rest [s]."""
    bound_s: NotNegative | None
    """Makespan that no plan of the mission undercuts, proven [s]; null if it was
    not computed, as for the objective 'energy'."""
    time_limit_s: Annotated[float, Field(gt=0)] | None
    """Largest makespan that the scene allows [s]; null for any."""
    objective: ObjectiveFigures
    margins: dict[str, KeptMargins] = {}
    """Distances that each robot keeps, by id."""
    margins_kept: list[str] = []
    """The same in words, with where margins come from."""
    narrow_passages: list[NarrowPassage] = []
    """Where robots keep less than their margin from obstacles, as no wider way
    leads on."""
    improvements: list[Improvement]
    """Every plan that was better than all before it, in the order they were found;
    the last one is the plan."""
    path_following_plans: Count
    """How often the fleet was driven along paths of its tours, without a motion
    tree."""
    vertices: Count
    """Vertices of the motion trees; 0 where following paths was enough."""
    groups: Count
    """Groups of the motion trees."""
    router_calls: Count
    """Tours computed by the router."""
    time_s: PlanningTimes
    iterations: Count | None = None
    """Iterations of the guided tree; only of that planner."""
    iteration_cap: Annotated[int, Field(ge=1)] | None = None
    """Hard cap on them; only of that planner."""


class VerdictFigures(Figures):
    """What the verifier says of the plan."""

    ok: bool
    """True if no rule is broken."""
    min_obstacle_clearance_m: NotNegative | None
    """Certified least distance of a footprint to an obstacle or the bounds, between
    steps too [m]; 0 on contact, null if the plan is malformed."""
    min_robot_distance_m: NotNegative | None
    """Certified least distance of two footprints [m]; null with one robot, or if
    the plan is malformed."""
    violations: Count
    """Number of violations; verdict.json lists them."""


class EnergyFigures(Figures):
    """Three meters of the fleet's energy."""

    planned_J: float
    """Energy model over the plan [J]."""
    metered_J: float
    """Energy model over the simulated motion [J]."""
    measured_J: float
    """From the work of the simulated drives [J]."""
    metered_error_pct: float
    """(metered - planned) / planned of the robot where it is largest in magnitude
    [%]."""
    measured_error_pct: float
    """(measured - planned) / planned of the robot where it is largest in magnitude
    [%]."""
    balance_residual_pct: float | None
    """Work of a robot's actuators that neither motion nor friction nor contacts
    account for, where it is largest in magnitude [% of the work of its drives];
    null where the log has no balance."""
    min_charge_fraction: float
    """Least measured battery content of any robot over its capacity [1]."""
    recharges: Count
    """Stations entered in the simulation by robots that had them on their tour."""


class Summary(Figures):
    """The figures of one run, in joules, seconds and metres.

    A section is null where the run did not come that far.
    """

    status: Literal[
        "solved",
        "model_mismatch",
        "energy_imbalance",
        "infeasible",
        "timeout",
        "no_plan_found",
        "invalid_scene",
        "cancelled",
    ]
    """How planning ended: infeasible is a proof, timeout a budget that was set and
    is over, no_plan_found a search that ended without a plan and without a proof.
    Or model_mismatch, where a plan was found and driven without any disturbance,
    and a robot took another energy than planned, by more than the tolerance: its
    model does not describe it. Or energy_imbalance, where motion, friction and
    contacts do not account for the work of a robot's drives: what was measured
    cannot be trusted."""
    mission_ok: bool
    """True if the plan is valid and its simulation visited all goals, without
    contact, with every battery at or above its reserve, and, if it was driven as
    planned and undisturbed, with the planned energy within the tolerance."""
    scene: str
    """Name of the scene."""
    seed: Count
    """Seed of the planner."""
    robots: Count
    """Number of robots in the scene."""
    goals: Count
    """Number of goals in the scene."""
    stations: Count
    """Number of recharging stations in the scene."""
    hints: list[str] = []
    """Sentences on the plan, such as which robots it leaves unused."""
    skipped_goals: list[SkippedGoal] = []
    """Goals that are proven out of reach and were left out (--skip-unreachable)."""
    plan: PlanFigures | None
    """Null without a plan."""
    verdict: VerdictFigures | None
    """Null without a plan."""
    execution: ExecutionFigures | None
    """Null if nothing was simulated."""
    energy: EnergyFigures | None
    """Null if nothing was audited."""
    versions: dict[str, str]
    """Versions that decide the result, by package."""


class _WithoutNoise(GenerateJsonSchema):
    """No titles that repeat keys, no defaults: what is left out is unknown."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False

    def default_schema(self, schema: WithDefaultSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])


def summary_schema() -> dict[str, Any]:
    """Return the JSON Schema of `summary.json`."""
    schema = Summary.model_json_schema(
        mode="serialization", schema_generator=_WithoutNoise
    )
    return {"$schema": GenerateJsonSchema.schema_dialect, **schema}
