"""The section of the report about trials under disturbances."""

from __future__ import annotations

import shlex

from mrmg.report.page import elements as html
from mrmg.runs.record import RunRecord
from mrmg.studies.outcomes import CONFIDENCE, Study, wilson_interval


def robustness(record: RunRecord) -> list[str]:
    """Return one row a study, and how to repeat the worst cases."""
    studies = record.studies
    if not studies:
        return []
    head = ["Driven with", "Feasible", f"{CONFIDENCE:.0%} interval", "Least charge"]
    head += ["Median", "Nearest obstacle", "Nearest robots", "Failures"]
    commands = [
        shlex.join(["mrmg", "execute", "RUN", *study.replay_options(study.worst)])
        for study in studies
    ]
    return [
        html.table(head, [_row(study) for study in studies], text_columns=(0, 7)),
        html.note(
            "Each trial drives the plan with robots that differ from their models "
            "in another way, and is feasible when all goals are visited without "
            "contact and no battery falls below its reserve. Charges and distances are "
            "the least of a trial, over all robots. The worst case of each row, "
            "repeated:"
        ),
        html.code("\n".join(commands)),
    ]


def _row(study: Study) -> list[str]:
    count = len(study.trials)
    low, high = wilson_interval(study.feasible, count)
    figures = study.to_json()
    margins, failures = figures["margins"], figures["failures"]
    charge = margins["charge_fraction"]
    return [
        _options(study),
        f"{study.feasible} of {count}",
        f"{100.0 * low:.1f} to {100.0 * high:.1f} %",
        *(f"{100.0 * charge[key]:.1f} %" for key in ("worst", "median")),
        _metres(margins, "obstacle_clearance_m"),
        _metres(margins, "robot_distance_m"),
        (
            ", ".join(f"{cause} {number}" for cause, number in sorted(failures.items()))
            or "none"
        ),
    ]


def _options(study: Study) -> str:
    words = ["default disturbances"]
    for name, value in study.options.items():
        if name == "disturb":
            words += [str(value)] if value else []
        else:
            words.append(name if value is True else f"{name} {value}")
    return ", ".join(words)


def _metres(margins: dict[str, dict[str, float]], name: str) -> str:
    return f"{margins[name]['worst']:.2f} m" if name in margins else "–"
