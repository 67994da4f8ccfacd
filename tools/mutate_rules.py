"""Take each rule of the verifier and of the planner out, and see which test fails.

`tools/rules.toml` states every rule as a piece of code of one module and what stands in
its place without the rule. Nothing on disk is changed: the tests of a rule run in a
process of their own, whose import of that module compiles the changed text. Kernels run
uncompiled there, as compiled ones are kept for the text on disk.

First all tests that are to notice something must pass with every rule in its place.
Exit codes: 0 each rule has a test that fails without it, 1 a rule survives, 2 tests
fail with all rules, a rule's code is not found exactly once, or --only names no rule.
"""

from __future__ import annotations

import argparse
import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import re
import subprocess
import sys
import time
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

CHECKOUT = Path(__file__).resolve().parents[1]
RULES = Path(__file__).with_name("rules.toml")
LONGEST_S = 120
"""Time after which a test that does not end without a rule counts as failed."""

VARIABLE = "MRMG_RULE_TAKEN_OUT"
"""Environment variable with number of the rule that a process of tests is without."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """A rule, and what the package is without it.

    Attributes:
        group: whose rule it is.
        rule: what it demands.
        module: file below `mrmg/`.
        code: text that occurs once in the module.
        without: what takes its place.
        tests: files or tests below `tests/` that are to notice it.
        options: of pytest.
    """

    group: str
    rule: str
    module: str
    code: str
    without: str
    tests: tuple[str, ...]
    options: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the module as Python imports it."""
        return ".".join(["mrmg", *Path(self.module).with_suffix("").parts])

    @property
    def uncompiled(self) -> bool:
        """Whether the rule stands in a kernel."""
        return Path(self.module).stem.endswith("_kernels")

    def text(self) -> str:
        """Return the module's text without the rule.

        Raises:
            ValueError: if the rule's code is not there, or more than once.
        """
        text = (CHECKOUT / "mrmg" / self.module).read_text()
        if (found := text.count(self.code)) != 1:
            raise ValueError(
                f"{self.module}: code of the rule '{self.rule}' occurs {found} times; "
                f"state it in {RULES.name} so that it occurs once:\n{self.code}"
            )
        return text.replace(self.code, self.without)


def read_rules(path: Path = RULES) -> list[Rule]:
    """Return all rules; those of a group have its tests unless they name others."""
    rules = []
    for group in tomllib.loads(path.read_text())["group"]:
        shared = {key: group.get(key, ()) for key in ("tests", "options")}
        for stated in group["rules"]:
            given: dict[str, Any] = {**shared, **stated, "group": group["name"]}
            lists = {key: tuple(given[key]) for key in shared}
            rules.append(Rule(**{**given, **lists}))
    return rules


class Lacking(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
    """Imports one module without a rule."""

    def __init__(self, rule: Rule) -> None:
        self._rule = rule

    def find_spec(
        self, fullname: str, path: object, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return how the module is imported; see `importlib`."""
        if fullname != self._rule.name:
            return None
        place = CHECKOUT / "mrmg" / self._rule.module
        spec = importlib.util.spec_from_loader(fullname, self, origin=str(place))
        if spec:
            spec.has_location = True
        return spec

    def get_source(self, fullname: str) -> str:
        """Return the text without the rule."""
        return self._rule.text()

    def get_code(self, fullname: str) -> Any:
        """Return the module's code without the rule."""
        place = str(CHECKOUT / "mrmg" / self._rule.module)
        return compile(self.get_source(fullname), place, "exec")


def failing_test(
    number: int | None, rules: Sequence[Rule], tests: Sequence[str]
) -> str | None:
    """Return the first of some tests that fails; None if all pass.

    Args:
        number: of the rule that is taken out; None leaves all in their place.
        rules: all rules; the first one decides how tests run where none is taken out.
        tests: what to run.
    """
    rule = rules[number or 0]
    environment = {
        **os.environ,
        "PYTHONPATH": f"{CHECKOUT}{os.pathsep}{CHECKOUT}/tools",
    }
    limit = []
    if number is not None:
        environment[VARIABLE] = str(number)
        limit = ["--timeout", f"{LONGEST_S}"]
    if rule.uncompiled:
        environment["NUMBA_DISABLE_JIT"] = "1"
    command = [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "--tb=no"]
    command += ["-p", "mutate_rules", "-p", "no:cacheprovider", *rule.options]
    ended = subprocess.run(
        [*command, *limit, *(f"tests/{name}" for name in tests)],
        cwd=CHECKOUT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    if ended.returncode == 0:
        return None
    found = re.search(r"^(?:FAILED|ERROR) (?:tests/)?(\S+)", ended.stdout, re.MULTILINE)
    if found is None or ended.returncode not in (1, 2):
        raise RuntimeError(f"the tests of '{rule.rule}' did not run:\n{ended.stdout}")
    return found[1]


def tests_that_fail(rules: Sequence[Rule]) -> list[str]:
    """Return tests that fail with all rules in their place, one of each way to run."""
    kinds = sorted({(rule.uncompiled, rule.options, rule.tests) for rule in rules})
    of_kind = {(r.uncompiled, r.options, r.tests): r for r in rules}
    failures = (failing_test(None, [of_kind[kind]], kind[2]) for kind in kinds)
    return [failure for failure in failures if failure is not None]


def main(words: Sequence[str] | None = None) -> int:
    """Take the rules out one by one, print a table, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="print the rules alone")
    parser.add_argument("--only", metavar="TEXT", help="rules with this text alone")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(words)
    rules = read_rules()
    numbers = [
        number
        for number, rule in enumerate(rules)
        if (options.only or "") in f"{rule.group} {rule.rule} {rule.module}"
    ]
    if not numbers:
        print(f"no rule has '{options.only}' in its text", file=sys.stderr)
        return 2
    try:
        for number in numbers:
            rules[number].text()
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    if options.list:
        for number in numbers:
            print(f"{rules[number].group:<10} {rules[number].rule}")
        return 0
    if broken := tests_that_fail([rules[number] for number in numbers]):
        print(f"tests fail with all rules: {', '.join(broken)}", file=sys.stderr)
        return 2
    rows, began = [], time.monotonic()
    for number in numbers:
        rule = rules[number]
        test = failing_test(number, rules, rule.tests)
        rows.append({"group": rule.group, "rule": rule.rule, "test": test})
        if not options.json:
            shown = test or "SURVIVES"
            print(f"{rule.group:<10} {rule.rule:<66} {shown}", flush=True)
    survivors = [row for row in rows if row["test"] is None]
    if options.json:
        print(json.dumps({"rules": rows, "survivors": len(survivors)}, indent=1))
    else:
        spent_s = time.monotonic() - began
        print(f"{len(rows)} rules, {len(survivors)} survive; {spent_s:.0f} s")
    return 1 if survivors else 0


if VARIABLE in os.environ and __name__ != "__main__":
    sys.meta_path.insert(0, Lacking(read_rules()[int(os.environ[VARIABLE])]))

if __name__ == "__main__":
    raise SystemExit(main())
