"""The summary page of a campaign: shares, energies and times by each factor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrmg.report.page import page, rendered


def campaign_html(figures: Mapping[str, Any]) -> str:
    """Return the page of the content of a campaign's `summary.json`."""
    body = rendered("campaign.html.jinja", figures=figures)
    return page(f"Campaign {figures['campaign']}", body)
