"""The look of the report page: its frame, and the few elements it is built from.

The page is one file without references to anything outside the run folder: styles,
script, data and the chart library (uPlot, MIT licence) are inside it, and it follows
the reader's light or dark scheme. Styles, script and templates lie in `assets`; the
elements are the macros of `elements.html.jinja`; templates escape what is not markup.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from mrmg.counted import counted
from mrmg.report.formats import distance, fixed, kJ, percent, quantity, signed
from mrmg.viz import style


def _asset(name: str) -> str:
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


_TEMPLATES = Environment(
    loader=FunctionLoader(_asset), autoescape=True, undefined=StrictUndefined
)
_FILTERS = (fixed, kJ, quantity, distance, percent, signed, counted)
_TEMPLATES.filters.update({each.__name__: each for each in _FILTERS})


def rendered(template: str, **values: Any) -> Markup:
    """Return a template of `assets` with values filled in, escaped."""
    return Markup(_TEMPLATES.get_template(template).render(values))


def page(
    title: str,
    body: Markup,
    *,
    colors: int = 0,
    data: Mapping[str, Any] | None = None,
    instead: str = "",
) -> str:
    """Return the whole page.

    Args:
        title: of the window.
        body: what it shows.
        colors: how many colours styles and script know as `--r0`, `--r1`, ...: those
            of robots in the scene's order.
        data: what the page's script draws charts of; None for a page without charts.
        instead: what is told to those whose browsers draw no charts.
    """
    text = (
        "" if data is None else json.dumps(data, separators=(",", ":"), allow_nan=False)
    )
    owners = [str(number) for number in range(colors)]
    frame = rendered(
        "page.html.jinja",
        title=title,
        body=body,
        light=style.robot_colors(owners).values(),
        dark=style.robot_colors_on_dark(owners).values(),
        looks={"planned": style.PLANNED, "driven": style.DRIVEN},
        # A closing tag inside a string would end the element that holds the data.
        data=Markup(text.replace("</", "<\\/")),
        instead=instead,
        asset=lambda name: Markup(_asset(name)),
    )
    return f"{frame}\n"
