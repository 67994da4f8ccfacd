"""The look of the report page: its frame, and the few elements it is built from.

The page is one file without references to anything outside the run folder: styles,
script, data and the chart library (uPlot, MIT licence) are inside it, and it follows
the reader's light or dark scheme. Styles and script lie in the folder `page`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from mrmg.viz import style

_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>$title</title>
<style>
$styles
</style>
</head>
<body><main>
$body
</main>
<div id="tip" role="tooltip" hidden></div>
$scripts
</body>
</html>
""")
_NO_SCRIPT = (
    "<noscript><p>The charts need JavaScript; energy.png and overview.png in the run "
    "folder show the same.</p></noscript>"
)
_FEW_COLUMNS = 4


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
        parts: HTML of the body.
        colors: of the robots, in their order, on light and on dark; styles and script
            know them as `--r0`, `--r1`, ...
        data: what the page's script draws charts of; None for a page without charts.
    """
    body = "\n".join(part for part in parts if part)
    styles = [*_color_rules(list(colors)), _asset("report.css")]
    scripts = [_script(_asset("report.js"))]
    if data is not None:
        styles.insert(0, _asset("uPlot.min.css"))
        library = f"/*\n{_asset('uPlot.LICENSE.txt')}*/\n{_asset('uPlot.iife.min.js')}"
        # A closing tag inside a string would end the element that holds the data.
        text = json.dumps(data, separators=(",", ":"), allow_nan=False)
        content = text.replace("</", "<\\/")
        scripts = [
            f'<script type="application/json" id="data">{content}</script>',
            _script(library),
            *scripts,
            _NO_SCRIPT,
        ]
    return _PAGE.substitute(
        title=escape(title),
        styles="\n".join(styles),
        body=body,
        scripts="\n".join(scripts),
    )


def _asset(name: str) -> str:
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


def _script(source: str) -> str:
    return f"<script>\n{source}</script>"


def _color_rules(colors: list[tuple[str, str]]) -> list[str]:
    light = "".join(f"--r{at}:{one};" for at, (one, _) in enumerate(colors))
    dark = "".join(f"--r{at}:{one};" for at, (_, one) in enumerate(colors))
    looks = {"planned": style.PLANNED, "driven": style.DRIVEN}
    lines = "".join(
        f"--{name}-width:{look.width_em:g};--{name}-opacity:{look.opacity:g};"
        for name, look in looks.items()
    )
    return [f":root {{ {light}{lines} }}", f":root[data-theme=dark] {{ {dark} }}"]


def heading(title: str) -> str:
    """Return the page's heading with the button that changes the scheme."""
    return (
        f"<header><h1>{escape(title)}</h1>"
        '<button id="scheme" aria-label="Change between light and dark">☾ Dark</button>'
        "</header>"
    )


def section(heading: str, *parts: str) -> str:
    """Return a card with a heading; empty if all its parts are."""
    content = "\n".join(part for part in parts if part)
    if not content:
        return ""
    return f"<section>\n<h2>{escape(heading)}</h2>\n{content}\n</section>"


def verdict_line(good: bool, word: str, text: str) -> str:
    """Return the line that says how it all ended."""
    look, sign = ("good", "✔") if good else ("bad", "✘")
    return (
        f'<p class="verdict {look}" id="verdict"><b>{sign} {escape(word)}</b>'
        f"{escape(text)}</p>"
    )


def tiles(entries: Iterable[tuple[str, str, str]]) -> str:
    """Return the row of main figures from (name, value, note)."""
    boxes = [
        f'<div class="tile"><div class="name">{escape(name)}</div>'
        f'<div class="value">{escape(value)}</div>'
        f'<div class="note">{escape(note)}</div></div>'
        for name, value, note in entries
    ]
    return f'<div class="tiles">{"".join(boxes)}</div>' if boxes else ""


def table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    text_columns: Sequence[int] = (0,),
    sums: Sequence[int] = (),
) -> str:
    """Return a table.

    Args:
        head: column titles.
        rows: cells as HTML; escape text with `text`.
        text_columns: columns that are aligned left.
        sums: numbers of the rows printed bold.
    """

    def cell(tag: str, column: int, content: str) -> str:
        look = ' class="text"' if column in text_columns else ""
        return f"<{tag}{look}>{content}</{tag}>"

    titles = "".join(cell("th", at, escape(title)) for at, title in enumerate(head))
    lines = []
    for number, row in enumerate(rows):
        look = ' class="sum"' if number in sums else ""
        cells = "".join(cell("td", at, content) for at, content in enumerate(row))
        lines.append(f"<tr{look}>{cells}</tr>")
    if not lines:
        return ""
    # Few columns far apart would be hard to read across.
    width = ' class="narrow"' if len(head) <= _FEW_COLUMNS else ""
    return (
        f'<div class="scroll"><table{width}><thead><tr>{titles}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def beside(*parts: str) -> str:
    """Return parts next to each other, where the page is wide enough."""
    return f'<div class="beside">{"".join(part for part in parts if part)}</div>'


def bullets(items: Iterable[str]) -> str:
    """Return a list of sentences; empty if there are none."""
    lines = "".join(f"<li>{escape(item)}</li>" for item in items)
    return f"<ul>{lines}</ul>" if lines else ""


def bar(parts: Iterable[tuple[float, str, str]], full: float) -> str:
    """Return a stacked bar from (value, colour, tip); `full` is its whole width."""
    pieces = [
        f'<i style="width:{100.0 * max(value, 0.0) / full:.2f}%;background:{color}" '
        f'data-tip="{escape(tip)}"></i>'
        for value, color, tip in parts
        if full > 0.0
    ]
    return f'<div class="bar">{"".join(pieces)}</div>'


def dot(color: str, content: str) -> str:
    """Return text behind a mark of a CSS colour."""
    return f'<span class="dot" style="--c:{color}"></span>{escape(content)}'


def robot_dot(index: int, content: str) -> str:
    """Return text behind a mark of a robot's colour."""
    return dot(f"var(--r{index})", content)


def toggle(kind: str, value: str, label: str) -> str:
    """Return a ticked box that shows and hides things.

    Args:
        kind: "layer" of the map, or "owner" of lines in charts and paths on the map.
        value: name of the layer or of the owner.
        label: HTML beside the box.
    """
    return (
        f'<label><input type="checkbox" checked data-toggle-{kind}="{escape(value)}"> '
        f"{label}</label>"
    )


def controls(*parts: str) -> str:
    """Return a row of things to click."""
    return f'<div class="controls">{"".join(parts)}</div>'


def player() -> str:
    """Return the slider and the button that move the time shown on map and charts."""
    speeds = "".join(
        f'<option value="{value}"{" selected" if value == 8 else ""}>×{value}</option>'
        for value in (1, 2, 4, 8, 16, 32)
    )
    return controls(
        '<button id="play">▶ Play</button>',
        f'<label>speed <select id="speed">{speeds}</select></label>',
        '<input id="time" type="range" min="0" value="0" aria-label="Mission time">',
        '<output class="readout" id="clock"></output>',
    )


def charts(identifiers: Iterable[tuple[str, str]], *, columns: int = 1) -> str:
    """Return the places of charts from (id, title), which the page's script fills."""
    boxes = "".join(
        f'<div class="chart"><h3>{escape(title)}</h3>'
        f'<div id="chart-{escape(name)}"></div></div>'
        for name, title in identifiers
    )
    look = "charts two" if columns == 2 else "charts"
    return f'<div class="{look}">{boxes}</div>' if boxes else ""


def text(content: str) -> str:
    """Return text as HTML."""
    return escape(content)


def note(content: str) -> str:
    """Return a small remark."""
    return f'<p class="soft">{escape(content)}</p>'


def paragraph(content: str) -> str:
    """Return a plain paragraph."""
    return f"<p>{escape(content)}</p>"


def code(content: str) -> str:
    """Return a command or other literal text."""
    return f"<pre>{escape(content)}</pre>"


def video(path: Path) -> str:
    """Return a player for a video file that lies beside the page; empty if absent."""
    if not path.exists():
        return ""
    name = escape(path.name)
    return (
        f'<video controls muted playsinline preload="metadata" src="{name}"></video>'
        f'<p class="soft">Video: <a href="{name}">{name}</a></p>'
    )
