"""The page of a campaign shows each factor with more than one value, escaped."""

from __future__ import annotations

from mrmg.report.campaign_page import campaign_html
from mrmg.studies.campaigns.figures import MEASURES, PARTS, RESULTS, campaign_figures

MARKUP = "<b>bold</b>"


def page_of(values: list[str]) -> str:
    factors = [{"scene": value, "plant": "default"} for value in values]
    rows = [
        {**dict.fromkeys(RESULTS), **own, "status": "solved", "feasible": at > 0}
        | dict.fromkeys(MEASURES[:4], 1000.0 * (at + 1))
        for at, own in enumerate(factors)
    ]
    times = [{f"{part}_s": 0.5 for part in PARTS} for _ in rows]
    return campaign_html(campaign_figures(MARKUP, factors, rows, times))


def test_factors_are_shown_by_value() -> None:
    page = page_of(["hall", "field", "hall"])
    assert "<h2>By scene</h2>" in page
    assert "<h2>By plant</h2>" not in page
    assert "The same in all: plant default." in page
    assert "66.7 %" in page
    assert "20.8 to 93.9 %" in page  # Wilson, 2 of 3


def test_names_with_markup_are_text() -> None:
    page = page_of([MARKUP, "plain"])
    assert MARKUP not in page
    assert "&lt;b&gt;bold&lt;/b&gt;" in page


def test_energies_are_compared_where_all_else_is_equal() -> None:
    factors = [
        {"planner": planner, "seed": seed} for planner in "ab" for seed in (0, 1, 2)
    ]
    costs_J = [100.0, 200.0, None, 110.0, 240.0, 50.0]
    rows = [
        {**dict.fromkeys(RESULTS), **own, "status": "solved", "feasible": True}
        | {"cost_J": cost_J}
        for own, cost_J in zip(factors, costs_J, strict=True)
    ]
    times = [{f"{part}_s": None for part in PARTS} for _ in rows]
    found = campaign_figures("name", factors, rows, times)["by"]["planner"]
    assert found[0]["cost_to_first"] == {"median": 1.0, "pairs": 2}
    assert found[1]["cost_to_first"]["pairs"] == 2
    assert abs(found[1]["cost_to_first"]["median"] - 1.15) < 1e-12
    assert found[0]["plan_s"] is None
