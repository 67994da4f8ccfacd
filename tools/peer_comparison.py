"""How peers compare with mrmg: ratios over the problems that both solve."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Sequence

from mission_tables import median_interval
from protocol import Row


def tabulate(rows: Sequence[Row]) -> list[Row]:
    """Print and return a row for each peer, problem and limit."""
    own = {
        (row["problem"], row["instance"]): row for row in rows if row["peer"] == "mrmg"
    }
    keys = dict.fromkeys(
        (row["problem"], row["peer"], row["limit_s"])
        for row in rows
        if row["peer"] != "mrmg"
    )
    print(
        "\nproblem | peer | limit s | ok | time s | / mrmg | cost / mrmg | better | "
        "failures"
    )
    table = []
    for problem, peer, limit_s in keys:
        found = [
            (row, own[problem, row["instance"]])
            for row in rows
            if (row["problem"], row["peer"], row["limit_s"]) == (problem, peer, limit_s)
        ]
        line = compared(found)
        table.append({"peer": peer, "problem": problem, "limit_s": limit_s, **line})
        print_row(table[-1])
    return table


def compared(pairs: Sequence[tuple[Row, Row]]) -> Row:
    """Return a peer's line: pairs of its trials and mrmg's."""
    both = [(peer, own) for peer, own in pairs if peer["ok"] and own["ok"]]
    causes = Counter(
        cause for peer, _ in pairs if not peer["ok"] for cause in peer["why"]
    )
    line: Row = {
        "ok": sum(peer["ok"] for peer, _ in pairs),
        "mrmg_ok": sum(own["ok"] for _, own in pairs),
        "runs": len(pairs),
        "failures": dict(causes.most_common()),
    }
    better = ["success"] if line["ok"] > line["mrmg_ok"] else []
    for key, name in (("time_s", "time"), ("cost", "cost")):
        ratios = [peer[key] / own[key] for peer, own in both]
        interval = median_interval(ratios)
        line |= {
            key: statistics.median(peer[key] for peer, _ in both) if both else None,
            f"mrmg_{key}": statistics.median(own[key] for _, own in both)
            if both
            else None,
            f"{name}_ratio": statistics.median(ratios) if ratios else None,
            f"{name}_ratio_interval": interval,
        }
        if interval[1] is not None and interval[1] < 1.0:
            better.append(name)
    return {**line, "better": better}


def print_row(row: Row) -> None:
    """Print a line of the table."""

    def ratio(name: str) -> str:
        low, high = row[f"{name}_interval"]
        if row[name] is None:
            return "-"
        return f"{row[name]:.4g}" + (f" [{low:.4g}, {high:.4g}]" if low else "")

    cells = [
        row["problem"],
        row["peer"],
        "-" if row["limit_s"] is None else f"{row['limit_s']:g}",
        f"{row['ok']}/{row['runs']} (mrmg {row['mrmg_ok']})",
        "-" if row["time_s"] is None else f"{row['time_s']:.3f}",
        ratio("time_ratio"),
        ratio("cost_ratio"),
        ", ".join(row["better"]) or "-",
        ", ".join(f"{cause}: {n}" for cause, n in row["failures"].items()) or "-",
    ]
    print(" | ".join(cells))
