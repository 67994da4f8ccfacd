"""The look of the report page: its frame, and the few elements it is built from.

The page is one file without references to anything outside the run folder: styles,
script, data and the chart library (uPlot, MIT licence) are inside it, and it follows
the reader's light or dark scheme. Styles, script and templates lie in `assets`; the
elements are the macros of `elements.html.jinja`, which escape what is not markup.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from importlib.resources import files
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from mrmg.viz import style


def _asset(name: str) -> str:
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


_TEMPLATES = Environment(
    loader=FunctionLoader(_asset), autoescape=True, undefined=StrictUndefined
)


def macros(template: str) -> Any:
    """Return the macros of a template of `assets`: functions that return markup."""
    return _TEMPLATES.get_template(template).module


elements = macros("elements.html.jinja")
"""The elements of pages."""


def rendered(template: str, **values: Any) -> Markup:
    """Return a template of `assets` with values filled in, escaped."""
    return Markup(_TEMPLATES.get_template(template).render(values))


def page(
    title: str,
    parts: Iterable[str],
    *,
    colors: Iterable[tuple[str, str]] = (),
    data: Mapping[str, Any] | None = None,
) -> str:
    """Return the whole page; empty parts are left out.

    Args:
        title: of the window.
        parts: markup of the body.
        colors: of the robots, in their order, on light and on dark; styles and script
            know them as `--r0`, `--r1`, ...
        data: what the page's script draws charts of; None for a page without charts.
    """
    body = Markup("\n").join(part for part in parts if part)
    styles = [*_color_rules(list(colors)), _asset("report.css")]
    script = Markup(_asset("report.js"))
    scripts = elements.script(script)
    if data is not None:
        styles.insert(0, _asset("uPlot.min.css"))
        library = f"/*\n{_asset('uPlot.LICENSE.txt')}*/\n{_asset('uPlot.iife.min.js')}"
        # A closing tag inside a string would end the element that holds the data.
        text = json.dumps(data, separators=(",", ":"), allow_nan=False)
        content = Markup(text.replace("</", "<\\/"))
        scripts = elements.data_scripts(content, Markup(library), script)
    return str(elements.page(title, Markup("\n".join(styles)), body, scripts)) + "\n"


def _color_rules(colors: list[tuple[str, str]]) -> list[str]:
    light = "".join(f"--r{at}:{one};" for at, (one, _) in enumerate(colors))
    dark = "".join(f"--r{at}:{one};" for at, (_, one) in enumerate(colors))
    looks = {"planned": style.PLANNED, "driven": style.DRIVEN}
    lines = "".join(
        f"--{name}-width:{look.width_em:g};--{name}-opacity:{look.opacity:g};"
        for name, look in looks.items()
    )
    return [f":root {{ {light}{lines} }}", f":root[data-theme=dark] {{ {dark} }}"]
