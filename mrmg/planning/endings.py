"""How planning can end without a plan: the sentences that give the reason, to format.

`infeasible` is a proof: no plan exists that the verifier accepts. `timeout` is a budget
that was set and is over. `no_plan_found` is everything else: a search that ended
without a plan and without a proof. A mission without robots, or a file that is invalid,
is not planned but raises `SceneError` (exit code 3); an interrupt without a plan ends
with 130, and one during a budget keeps the best plan so far.
"""

from __future__ import annotations

from collections.abc import Sequence

MAX_LISTED = 8
"""Names that a sentence lists at most."""


GOAL_CUT_OFF = (
    "goal {goal} is unreachable: for every robot it is cut off from the start by "
    "obstacles, or ground too steep, with no gap as wide as the robot{gap}"
)
GOAL_OUT_OF_ENERGY = (
    "goal {goal} is out of energy's reach: even on the shortest path, over every "
    "station that can be reached, each robot that can get there is short of at least "
    "{missing} above its reserve"
)
FINISH_CUT_OFF = (
    "the finish of {robot} is unreachable: it is cut off from the start by "
    "obstacles, or ground too steep, with no gap as wide as the robot{gap}"
)
NO_ROOM = (
    "{place} is unreachable: wherever in it {robot} stood{heading}, the body would "
    "meet an obstacle or leave the map; {remedy} would help"
)
LITTLE_ROOM = (
    "{place} has too little room for {robot}: {depth_m:.2f} m deep in it, where plans "
    "lead, the body{heading} is at most {most} m from obstacles, and plans keep at "
    "least {least} m from them; {remedy} would help"
)
FINISH_OUT_OF_ENERGY = (
    "the finish of {robot} is out of energy's reach: even on the shortest path, over "
    "every station that can be reached, its battery would have to hold at least {more}"
)
FINISHES_CROWDED = (
    "{first} and {second} cannot both stand at their finishes: no two points of these "
    "are {needed_m:.2f} m apart, as the robots' bodies need"
)
FINISHES_IN_STATION = (
    "{first} and {second} cannot both stand at their finishes: these lie in {station}, "
    "which is for one robot at a time"
)
NO_TOURS = (
    "no tours exist that keep every battery above its reserve: even on the shortest "
    "paths, with any recharging and in any order, the fleet visits at most {served} of "
    "{goals}, for example all but {left_out}; every battery would have to hold "
    "at least {more}"
)
TOO_LATE = (
    "the time limit of {limit_s:g} s is too short: even at top speed on the shortest "
    "paths no plan is over before {least} s"
)
NO_TIMELY_TOURS = (
    "no tours exist that keep every battery above its reserve and the time limit of "
    "{limit_s:g} s: even at top speed on the shortest paths, with any recharging, "
    "whatever share of the goals each robot visits"
)
NO_PATH = "no path was found to {places}, and no proof that there is none: {passages}"
NO_TOURS_FOUND = (
    "no tours were found that keep every battery above its reserve{limit}, and no "
    "proof that there are none; the best ones on the roadmap {left_out}, and {remedy}"
)
LATE = (
    "plans were found, but none in time: the earliest is over at {earliest} s, the "
    "time limit is {limit_s:g} s, and {margin_s:g} s of it are kept for execution"
)
NO_PROGRESS = "tours were found, but no plan along them: {blocked}{searched}"
REFUSED = "tours and motions along them were found, but {refused}{blocked}"
HEADINGS = (
    "tours were found, but no motions along them that get to {places} with the heading "
    "wanted there{searched}; without headings there are some: other headings, a larger "
    "heading_tolerance or more room to turn would help"
)
BUDGET_FOR_ROADMAP = (
    "the budget of {budget_s:g} s was over before the first tours were found: building "
    "the roadmap alone took {init_s:.2f} s"
)
BUDGET_OVER = "the budget of {budget_s:g} s was over after {attempts}: {so_far}"


def listed(names: Sequence[str]) -> str:
    """Return names in words, the first ones of many."""
    more = len(names) - MAX_LISTED
    return ", ".join(names[:MAX_LISTED]) + (f" and {more} more" if more > 0 else "")
