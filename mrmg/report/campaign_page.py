"""The summary page of a campaign: shares, energies and times by each factor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrmg.report.page import elements as html
from mrmg.report.page import page


def campaign_html(figures: Mapping[str, Any]) -> str:
    """Return the page of the content of a campaign's `summary.json`."""
    title = f"Campaign {figures['campaign']}"
    return page(title, [html.heading(title)])
