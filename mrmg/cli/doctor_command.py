"""The verb that checks the machine, and lists the packages mrmg depends on."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from mrmg.cli import terminal
from mrmg.errors import ExitCode


def add_doctor(verbs: Any) -> None:
    """Add the verb `doctor`."""
    verb = verbs.add_parser(
        "doctor", help="check this machine, with remedies", command=doctor
    )
    packages = "list the packages mrmg depends on, with their licences"
    verb.add_flag("--licences", packages)
    verb.add_json("the findings alone")


def doctor(options: argparse.Namespace) -> int:
    """Report what this machine has and what is missing."""
    if options.licences:
        return _licences(options)
    from mrmg.doctor import examine

    findings = examine()
    lines = []
    for finding in findings:
        mark = "ok     " if finding.ok else "MISSING"
        lines.append(f"{mark} {finding.name:<14} {finding.found}")
        if finding.remedy:
            lines.append(f"{'':22} remedy: {finding.remedy}")
    found = [{**asdict(each), "ok": each.ok} for each in findings]
    terminal.print_result(options, found, lines)
    return ExitCode.OK if all(item.ok for item in findings) else ExitCode.MACHINE


def _licences(options: argparse.Namespace) -> int:
    """Print the packages that mrmg depends on."""
    from mrmg.licences import dependencies

    found = dependencies()
    rows = [("package", "version", "licence", "extra")]
    rows += [
        (
            each.package,
            each.version or "-",
            each.licence or ("not stated" if each.version else "not installed"),
            each.extra,
        )
        for each in found
    ]
    lines = terminal.table_lines(rows)
    terminal.print_result(options, [asdict(each) for each in found], lines)
    return ExitCode.OK
