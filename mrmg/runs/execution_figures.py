"""What `summary.json` says of a simulation: keys with types, units and meanings."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from mrmg.simulation.disturbance import Disturbance

Count = Annotated[int, Field(ge=0)]
NotNegative = Annotated[float, Field(ge=0)]


class Figures(BaseModel):
    """Figures of one subject; all keys are named."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, use_attribute_docstrings=True
    )


class SolveTimes(Figures):
    """Processor time of one kind of solve [ms]."""

    median: NotNegative
    """Median [ms]."""
    p99: NotNegative
    """99th percentile [ms]."""
    calls: Annotated[int, Field(ge=1)]
    """Number of calls."""


class ControllerTimes(Figures):
    """Processor time of one control step of one robot [ms]."""

    median: NotNegative
    """Median [ms]."""
    p99: NotNegative
    """99th percentile [ms]."""
    riccati: SolveTimes | None
    """Calls of the MPC in which no bound was active: an unconstrained solve. Null
    where it was never taken, or not recorded."""
    qp: SolveTimes | None
    """Calls of the MPC in which bounds were active: a QP solve after the
    unconstrained one. Null where it was never taken, or not recorded."""


class Tracking(Figures):
    """Distance of the reference point from the plan, over all robots [m]."""

    rms_m: NotNegative
    """Root mean square [m]."""
    max_m: NotNegative
    """Largest [m]."""


class Event(Figures):
    """What supervision saw and did."""

    time_s: NotNegative
    """Simulated time [s]."""
    cause: Literal["fault", "energy", "tracking", "rest"]
    """A robot's fault, energy or tracking out of their corridor, or the rest of the
    fleet after a stop."""
    robot: str
    """Id of the robot that caused it; empty for the fleet."""
    action: Literal["stop", "replan", "give_up", "finish", "end"]
    """The fleet was stopped, went on by a new plan, gave up goals, finished with
    all goals visited, or ended its mission without."""
    message: str
    """One sentence for people."""


class ExecutionFigures(Figures):
    """How the simulation went."""

    goals_visited: Count
    """Goals that some robot entered."""
    contacts: Count
    """Contacts other than wheel and floor."""
    gave_up: Literal["", "lost", "diverged", "stalled", "restless"]
    """Why the simulation was ended early; empty where it was not."""
    disturbance: Disturbance | None
    """Null if there was none."""
    realtime_factor: NotNegative
    """Simulated time over wall-clock time, control included [1]."""
    controller_ms: ControllerTimes
    bounded_solves: Count
    """QP solves of the MPC with active bounds, over all robots."""
    tracking: Tracking
    events: list[Event]
    """What supervision saw and did, in order of time; empty where nothing went
    wrong."""
    replans: Count
    """Number of new plans driven after the first one."""
