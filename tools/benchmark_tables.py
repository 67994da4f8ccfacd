"""The tables of BENCHMARKS.md: for each a function of stored results.

Each returns the head and the rows as texts; numbers that were not measured are "-".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Row = Mapping[str, Any]
Documents = Mapping[str, Mapping[str, Any]]
Table = tuple[list[str], list[list[str]]]


def num(value: float | None, digits: int = 2) -> str:
    """Return a number as text; "-" for none."""
    return "-" if value is None else f"{value:.{digits}f}"


def pair(row: Row, first: str, second: str, digits: int = 2) -> str:
    """Return two numbers of a row."""
    return f"{num(row[first], digits)}, {num(row[second], digits)}"


def of(part: int, whole: int) -> str:
    """Return a count of a whole."""
    return f"{part} of {whole}"


def ratio(row: Row, name: str, digits: int = 2) -> str:
    """Return a ratio with its interval."""
    low, high = row[f"{name}_interval"]
    text = num(row[name], digits)
    return text if low is None else f"{text} [{num(low, digits)}, {num(high, digits)}]"


def missions(documents: Documents, published: Row) -> Table:
    """Return shipped scenes planned and driven."""
    head = [
        "scene", "ok", "first plan [s]", "all planning [s]", "cost [m]",
        "tracking rms, max [m]", "metered, measured [%]", "x real time",
    ]  # fmt: skip
    return head, [
        [
            row["scene"],
            of(row["ok"], row["runs"]),
            num(row["first_s_median"]),
            num(row["plan_s_median"]),
            num(row["cost_m_median"], 0),
            pair(row, "rms_m_worst", "max_m_worst", 3),
            pair(row, "metered_pct_worst", "measured_pct_worst"),
            num(row["x_real_median"], 0),
        ]
        for row in documents["missions"]["rows"]
        if row["scene"] != "all"
    ]


def quality(documents: Documents, published: Row) -> Table:
    """Return times of first plans, and costs beside proven bounds."""
    head = [
        "scene", "verified", "first plan: median, p95 [s]",
        "cost / bound: first plan", "after 5 s", "after 30 s",
    ]  # fmt: skip
    bounds = {row["scene"]: row for row in documents["bounds"]["rows"]}
    return head, [
        [
            row["scene"],
            of(row["ok"], row["runs"]),
            pair(row, "first_s_median", "first_s_p95"),
            *(
                num(bounds[row["scene"]][f"cost_to_bound_{moment}"], 3)
                for moment in ("first", "5_s", "30_s")
            ),
        ]
        for row in documents["first_plans"]["rows"]
    ]


def table_1(documents: Documents, published: Row) -> Table:
    """Return the paper's Table I: as published, and both profiles."""
    head = [
        "scene", "published: failures, time", "`paper`: failures, time",
        "share of NRPA", "default: failures, time", "first plan: paper / default",
        "cost: paper / default",
    ]  # fmt: skip
    result = documents["table_1"]
    rows = {(row["scene"], row["profile"]): row for row in result["rows"]}
    ratios = {row["scene"]: row for row in result["ratios"]}
    table = []
    for scene in dict.fromkeys(row["scene"] for row in result["rows"]):
        default, paper = rows[scene, "default"], rows[scene, "paper"]
        known = published["table_1"]["scenes"][scene]
        time = "" if known["time_s"] is None else f", {known['time_s']} s"
        cells = [scene, f"{known['failures']}{time}"]
        for row, share in ((paper, True), (default, False)):
            failures = of(row["runs"] - row["ok"], row["runs"])
            cells.append(f"{failures}, {num(row['plan_s_median'])} s")
            cells += [num(row["solver_share_median"])] if share else []
        compared = ratios[scene]
        table.append(
            [*cells, ratio(compared, "first_plan", 1), ratio(compared, "cost")]
        )
    return head, table


def nrpa(documents: Documents, published: Row) -> Table:
    """Return profile paper with NRPA of other depths."""
    found = {
        depth: documents[f"nrpa_{depth}"]["rows"][-1]
        for depth in ("2x6", "2x12", "2x25", "2x50")
    }
    return ["levels x iterations", *found], [
        ["cost [m]", *(num(row["cost_m_median"], 0) for row in found.values())],
        ["time [s]", *(num(row["plan_s_median"]) for row in found.values())],
    ]


def maps(documents: Documents, published: Row) -> Table:
    """Return missions on maps that others drew."""
    return ["map", "verified", "first plan: median, p95 [s]", "cost [m]"], [
        [
            row["scene"],
            of(row["ok"], row["runs"]),
            pair(row, "first_s_median", "first_s_p95"),
            num(row["cost_m_median"], 0),
        ]
        for row in documents["maps"]["rows"]
    ]


def clmapf(documents: Documents, published: Row) -> Table:
    """Return CL-MAPF by cell, beside CL-CBS."""
    head = [
        "map, cars", "solved", "first plan: median, worst [s]", "files CL-CBS solved",
        "first plan there: mrmg, CL-CBS [s]", "makespan: mrmg [s], CL-CBS [steps]",
    ]  # fmt: skip
    return head, [
        [
            row["cell"].replace("_", " "),
            of(row["solved"], row["runs"]),
            pair(row, "plan_s_median", "plan_s_worst"),
            of(row["reference_solved"], row["files"]),
            pair(row, "plan_s", "reference_plan_s"),
            pair(row, "makespan_s", "reference_makespan_s", 1),
        ]
        for row in documents["clmapf"]["rows"]
    ]


def kinodynamic(documents: Documents, published: Row) -> Table:
    """Return kinodynamic benchmarks, beside published planners."""
    head = [
        "file", "solved", "first plan: median, p95 [s]", "makespan [s]",
        "/ straight line", "K-CBS: runs, median time",
    ]  # fmt: skip
    others = published["kinodynamic"]["files"]
    table = []
    for row in documents["kinodynamic"]["rows"]:
        cells = [row["file"], of(row["solved"], row["runs"])]
        cells.append(pair(row, "plan_s_median", "plan_s_p95"))
        makespan = num(row["makespan_s_median"], 1)
        cells.append(makespan if row["status"] is None else row["status"])
        cells.append(num(row["to_straight_line"]))
        table.append([*cells, others.get(row["file"], "-")])
    return head, table


def routers(documents: Documents, published: Row) -> Table:
    """Return routers beside exact tours."""
    head = ["router", "within 1 %", "optimal", "worst gap [%]", "median, slowest [s]"]
    return head, [
        [
            f"`{row['router']}`",
            of(row["within_1_pct"], row["missions"]),
            str(row["optimal"]),
            num(row["worst_gap_pct"]),
            pair(row, "median_s", "slowest_s", 3),
        ]
        for row in documents["routing"]["rows"]
    ]


def green_vrp(documents: Documents, published: Row) -> Table:
    """Return Green VRP instances beside proven optima."""
    return ["instance", "proven optimum [miles]", "found", "routes", "time [s]"], [
        [
            row["instance"],
            num(row["proven"]),
            num(row["found"]),
            str(row["routes"]),
            num(row["seconds"]),
        ]
        for row in documents["routing"]["instances"]
    ]


def ablations(documents: Documents, published: Row) -> Table:
    """Return what router and bound lose without one mechanism."""
    return ["without", "what", "change"], [
        [row["without"], row["what"], row["change"]]
        for row in documents["ablations"]["rows"]
    ]


def growth(documents: Documents, published: Row) -> Table:
    """Return how first plans grow with missions."""
    head = [
        "grows", "robots", "goals", "obstacles", "verified",
        "first plan: median, worst [s]", "routing [s]", "memory [MB]",
    ]  # fmt: skip
    return head, [
        [
            row["series"],
            *(str(row[key]) for key in ("robots", "goals", "obstacles")),
            of(row["ok"], row["missions"]),
            pair(row, "first_plan_s_median", "first_plan_s_worst"),
            num(row["routing_s_median"]),
            num(row["memory_MB"], 0),
        ]
        for row in documents["growth"]["rows"]
    ]


def physics(documents: Documents, published: Row) -> Table:
    """Return what the physics is held to."""
    return ["figure", "found", "asked", "verdict"], figures_of(documents["physics"])


def figures_of(document: Row) -> list[list[str]]:
    """Return figures with verdicts."""
    return [
        [row["what"], row["found"], row["asked"], "PASS" if row["holds"] else "FAIL"]
        for row in document["figures"]
    ]


def robustness(documents: Documents, published: Row) -> Table:
    """Return shares of feasible drives under disturbances."""
    head = [
        "scene", "plans", "disturbance", "replanning", "feasible", "95 % interval",
        "least charge: worst, median [%]", "failures",
    ]  # fmt: skip
    return head, [
        [
            row["scene"],
            str(row["plans"]),
            row["disturb"],
            "yes" if row["replan"] else "no",
            of(row["feasible"], row["trials"]),
            "[{:.2f}, {:.2f}]".format(*row["interval_95"]),
            ", ".join(
                "-" if row[key] is None else num(100.0 * row[key], 1)
                for key in ("charge_worst", "charge_median")
            ),
            causes(row["failures"]),
        ]
        for row in documents["physics"]["disturbances"]
    ]


def causes(failures: Mapping[str, int]) -> str:
    """Return failures by cause."""
    named = (f"{cause.replace('_', ' ')}: {n}" for cause, n in failures.items())
    return ", ".join(named) or "-"


def controllers(documents: Documents, published: Row) -> Table:
    """Return the tracking controllers side by side."""
    head = [
        "scene", "disturbances", "controller", "feasible", "tracking rms, max [m]",
        "least distance to an obstacle [m]", "energy / plan - 1 [%]", "a call [ms]",
        "calls with a bound active [%]",
    ]  # fmt: skip
    return head, [
        [
            row["scene"],
            row["disturbance"],
            row["controller"],
            of(row["feasible"], row["trials"]),
            f"{num(row['rms_m'], 4)}, {num(row['max_m'], 3)}",
            num(row["obstacle_m"], 3),
            num(row["energy_pct"]),
            num(row["call_ms"], 3),
            num(row["bounded_pct"], 1),
        ]
        for row in documents["controllers"]["rows"]
    ]


def foreign_tyre(documents: Documents, published: Row) -> Table:
    """Return errors on a foreign ground contact, before and after calibration."""
    head = [
        "scene", "robots", "before: median, worst [%]", "feasible",
        "calibrated: median, worst [%]", "feasible",
    ]  # fmt: skip
    table = []
    for row in documents["foreign_tyre"]["rows"]:
        cells = [row["scene"], str(row["robots"])]
        for stage in ("before", "after"):
            cells.append(pair(row, f"{stage}_median_pct", f"{stage}_worst_pct", 1))
            cells.append(of(row[f"{stage}_feasible"], row["missions"]))
        table.append(cells)
    return head, table


def energy_logs(documents: Documents, published: Row) -> Table:
    """Return laws of power fitted to logs of a real robot."""
    head = [
        "law", "parameters per terrain", "median error [%]", "90 % intervals hold [%]",
        "median width [% of the prediction]",
    ]  # fmt: skip
    return head, [
        [
            row["law"],
            str(row["parameters"]),
            num(row["median_error_pct"], 1),
            num(row["holds_pct"], 0),
            num(row["width_pct"], 0),
        ]
        for row in documents["energy_logs"]["rows"]
    ]


def log_terrains(documents: Documents, published: Row) -> Table:
    """Return the best law's errors by terrain."""
    return ["terrain", "runs", "median error [%]", "90 % intervals hold [%]"], [
        [
            row["terrain"].lower(),
            str(row["runs"]),
            num(row["median_error_pct"], 1),
            num(row["holds_pct"], 0),
        ]
        for row in documents["energy_logs"]["terrains"]
    ]


def peers(documents: Documents, published: Row) -> Table:
    """Return peers beside mrmg."""
    head = [
        "problem", "peer", "limit [s]", "solved: peer, mrmg", "time [s]",
        "time / mrmg", "cost / mrmg", "the peer is better at", "failures",
    ]  # fmt: skip
    return head, [
        [
            row["problem"],
            row["peer"],
            "-" if row["limit_s"] is None else f"{row['limit_s']:g}",
            f"{row['ok']}, {row['mrmg_ok']} of {row['runs']}",
            num(row["time_s"], 3),
            scaled(row, "time_ratio"),
            ratio(row, "cost_ratio", 3),
            " and ".join(f"**{name}**" for name in row["better"]) or "-",
            causes(row["failures"]),
        ]
        for row in documents["peers"]["rows"]
    ]


def scaled(row: Row, name: str) -> str:
    """Return a ratio of any size with its interval, in three digits."""
    if row[name] is None:
        return "-"
    low, high = row[f"{name}_interval"]
    text = f"{row[name]:.3g}"
    return text if low is None else f"{text} [{low:.3g}, {high:.3g}]"


def faults(documents: Documents, published: Row) -> Table:
    """Return what was broken on purpose."""
    return ["row", "cases", "failed", "required", "verdict"], [
        [
            row["row"],
            str(row["cases"]),
            str(row["failed"]),
            row["required"],
            "PASS" if row["holds"] else "FAIL",
        ]
        for row in documents["faults"]["rows"]
    ]


TABLES: Mapping[str, Callable[[Documents, Row], Table]] = {
    function.__name__: function
    for function in (
        missions, quality, table_1, nrpa, maps, clmapf, kinodynamic, routers, green_vrp,
        ablations, growth, physics, robustness, controllers, foreign_tyre, energy_logs,
        log_terrains, peers, faults,
    )
}  # fmt: skip
"""Tables by name."""
