"""Texts made from templates that lie beside the code that fills them in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import Any


def rendered(
    package: str,
    template: str,
    filters: Mapping[str, Callable[..., Any]],
    **values: Any,
) -> str:
    """Return a template of a package with values filled in.

    Args:
        package: name of the package it lies in.
        template: name of its file.
        filters: functions that it applies to values, by name.
        values: what it names; all of it is given.
    """
    from jinja2 import Environment, StrictUndefined  # not needed by most commands

    environment = Environment(
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(filters)
    text = (files(package) / template).read_text(encoding="utf-8")
    return environment.from_string(text).render(values)
