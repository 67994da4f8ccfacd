"""How planning can end: every status with the sentence that gives the reason.

`infeasible` is a proof: no plan exists that the verifier accepts. `timeout` is a budget
that was set and is over. `no_plan_found` is everything else: a search that ended
without a plan and without a proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mrmg.plans import PlanStatus

MAX_LISTED = 8
"""Names that a sentence lists at most."""


@dataclass(frozen=True, slots=True)
class Ending:
    """One way in which planning ends.

    Attributes:
        name: short name.
        status: what `planning.json` states; it decides the exit code.
        sentence: the reason, as a format string.
    """

    name: str
    status: PlanStatus
    sentence: str = ""

    def reason(self, **facts: object) -> str:
        """Return the sentence with its facts filled in."""
        return self.sentence.format(**facts)


SOLVED = Ending("a plan", PlanStatus.SOLVED)
GOAL_CUT_OFF = Ending(
    "a goal is cut off",
    PlanStatus.INFEASIBLE,
    "goal {goal} is unreachable: for every robot it is cut off from the start by "
    "obstacles with no gap as wide as the robot{gap}",
)
GOAL_OUT_OF_ENERGY = Ending(
    "a goal is out of every battery's reach",
    PlanStatus.INFEASIBLE,
    "goal {goal} is out of energy's reach: even on the shortest path, over every "
    "station that can be reached, each robot that can get there is short of at least "
    "{missing} above its reserve",
)
FINISH_CUT_OFF = Ending(
    "a finish is cut off",
    PlanStatus.INFEASIBLE,
    "the finish of {robot} is unreachable: it is cut off from the start by obstacles "
    "with no gap as wide as the robot{gap}",
)
FINISH_OUT_OF_ENERGY = Ending(
    "a finish is out of its battery's reach",
    PlanStatus.INFEASIBLE,
    "the finish of {robot} is out of energy's reach: even on the shortest path, over "
    "every station that can be reached, its battery would have to hold at least {more}",
)
FINISHES_CROWDED = Ending(
    "two finishes are too near",
    PlanStatus.INFEASIBLE,
    "{first} and {second} cannot both stand at their finishes: no two points of these "
    "are {needed_m:.2f} m apart, as the robots' bodies need",
)
NO_TOURS = Ending(
    "no tours exist",
    PlanStatus.INFEASIBLE,
    "no tours exist that keep every battery above its reserve: even on the shortest "
    "paths, with any recharging and in any order, the fleet visits at most {served} of "
    "{goals}, for example all but {left_out}; every battery would have to hold "
    "at least {more}",
)
TOO_LATE = Ending(
    "the time limit is too short",
    PlanStatus.INFEASIBLE,
    "the time limit of {limit_s:g} s is too short: even at top speed on the shortest "
    "paths no plan is over before {least} s",
)
NO_TIMELY_TOURS = Ending(
    "no tours exist in time",
    PlanStatus.INFEASIBLE,
    "no tours exist that keep every battery above its reserve and the time limit of "
    "{limit_s:g} s: even at top speed on the shortest paths, with any recharging, "
    "whatever share of the goals each robot visits",
)
NO_PATH = Ending(
    "the roadmap finds no path",
    PlanStatus.NO_PLAN_FOUND,
    "no path was found to {places}, and no proof that there is none: {passages}",
)
NO_TOURS_FOUND = Ending(
    "the router finds no tours",
    PlanStatus.NO_PLAN_FOUND,
    "no tours were found that keep every battery above its reserve, and no proof that "
    "there are none; the best ones on the roadmap {left_out}, and {remedy}",
)
NO_TOURS_IN_TIME = Ending(
    "the router finds no tours in time",
    PlanStatus.NO_PLAN_FOUND,
    "no tours were found that keep every battery above its reserve and the time limit "
    "of {limit_s:g} s, and no proof that there are none; the best ones on the roadmap "
    "{left_out}, and {remedy}",
)
LATE = Ending(
    "every plan found is late",
    PlanStatus.NO_PLAN_FOUND,
    "plans were found, but none in time: the earliest is over at {earliest} s, the "
    "time limit is {limit_s:g} s, and {margin_s:g} s of it are kept for execution",
)
NO_PROGRESS = Ending(
    "no plan along the tours",
    PlanStatus.NO_PLAN_FOUND,
    "tours were found, but no plan along them: {blocked}{searched}",
)
HEADINGS = Ending(
    "no motions to the headings",
    PlanStatus.NO_PLAN_FOUND,
    "tours were found, but no motions along them that get to {places} with the heading "
    "wanted there{searched}; without headings there are some: other headings, a larger "
    "heading_tolerance or more room to turn would help",
)
BUDGET_FOR_ROADMAP = Ending(
    "the budget ends with the roadmap",
    PlanStatus.TIMEOUT,
    "the budget of {budget_s:g} s was over before the first tours were found: building "
    "the roadmap alone took {init_s:.2f} s",
)
BUDGET_OVER = Ending(
    "the budget ends without a plan",
    PlanStatus.TIMEOUT,
    "the budget of {budget_s:g} s was over after {attempts}: {so_far}",
)

ENDINGS = (
    SOLVED,
    GOAL_CUT_OFF,
    GOAL_OUT_OF_ENERGY,
    FINISH_CUT_OFF,
    FINISH_OUT_OF_ENERGY,
    FINISHES_CROWDED,
    NO_TOURS,
    TOO_LATE,
    NO_TIMELY_TOURS,
    NO_PATH,
    NO_TOURS_FOUND,
    NO_TOURS_IN_TIME,
    LATE,
    NO_PROGRESS,
    HEADINGS,
    BUDGET_FOR_ROADMAP,
    BUDGET_OVER,
)
"""All of them. A mission without robots, or a file that is invalid, is not planned but
raises `SceneError` (exit code 3); an interrupt without a plan ends with 130, and one
during a budget keeps the best plan so far."""


def listed(names: Sequence[str]) -> str:
    """Return names in words, the first ones of many."""
    more = len(names) - MAX_LISTED
    return ", ".join(names[:MAX_LISTED]) + (f" and {more} more" if more > 0 else "")
