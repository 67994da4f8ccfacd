"""What all tests share: the quick ones run before the slow ones."""

from __future__ import annotations

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the slow tests last, so that a broken build is told early."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is not None)
