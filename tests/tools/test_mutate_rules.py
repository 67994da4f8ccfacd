"""Rules that can be taken out are those of the code, and taking one out is noticed."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from mutate_rules import Rule, main, read_rules

RULES = read_rules()
TESTS = Path(__file__).parents[1]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: f"{rule.group}: {rule.rule}")
def test_a_rule_is_code_that_can_be_taken_out(rule: Rule) -> None:
    ast.parse(rule.text())
    assert rule.tests
    assert all((TESTS / name).exists() for name in rule.tests)


def test_rules_have_names_of_their_own() -> None:
    names = [(rule.group, rule.rule) for rule in RULES]
    assert len(set(names)) == len(names)


@pytest.mark.slow
def test_a_rule_that_is_taken_out_is_noticed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--only", "preference then the energy"]) == 0
    assert "the_cheaper_is_better" in capsys.readouterr().out


def test_a_text_that_no_rule_has_is_refused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--only", "no such rule"]) == 2
    assert "no rule has 'no such rule'" in capsys.readouterr().err
