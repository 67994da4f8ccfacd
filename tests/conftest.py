"""What all tests share: a kernel cache that survives, and quick tests before slow ones."""

from __future__ import annotations

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the slow tests last, so that a broken build is told early."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is not None)
