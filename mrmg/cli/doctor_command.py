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
    if options.json:
        terminal.print_json([asdict(finding) for finding in findings])
    else:
        for finding in findings:
            mark = "ok     " if finding.ok else "MISSING"
            print(f"{mark} {finding.name:<14} {finding.found}")
            if finding.remedy:
                print(f"{'':22} remedy: {finding.remedy}")
    return ExitCode.OK if all(item.ok for item in findings) else ExitCode.MACHINE


def _licences(options: argparse.Namespace) -> int:
    """Print the packages that mrmg depends on."""
    from mrmg.licences import dependencies

    found = dependencies()
    if options.json:
        terminal.print_json([asdict(each) for each in found])
        return ExitCode.OK
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
    terminal.print_table(rows)
    return ExitCode.OK
