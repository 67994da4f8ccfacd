"""The look of the report page: its frame, and the few elements it is built from.

The page is one file without references to anything outside the run folder: styles and
pictures are inside it, and it follows the reader's light or dark scheme.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template

_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<title>$title</title>
<style>
:root { --page:#f4f5f7; --card:#fff; --ink:#1f2328; --soft:#5f6773; --line:#e1e4e8;
  --good:#0b6e4f; --good-bg:#e2f4ec; --bad:#b00020; --bad-bg:#fbe6e8;
  --accent:#0072b2; }
@media (prefers-color-scheme: dark) { :root { --page:#101418; --card:#1a2027;
  --ink:#e8ebef; --soft:#a4adba; --line:#323b46; --good:#6fd6ac; --good-bg:#12352a;
  --bad:#ff8a80; --bad-bg:#40191d; --accent:#66b8e8; } }
* { box-sizing:border-box; }
body { margin:0; background:var(--page); color:var(--ink);
  font:15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width:1160px; margin:0 auto; padding:28px 20px 60px; }
h1 { font-size:26px; margin:0 0 12px; }
h2 { font-size:18px; margin:0 0 12px; }
h3 { font-size:15px; margin:18px 0 6px; }
section { background:var(--card); border:1px solid var(--line); border-radius:10px;
  padding:18px 20px; margin-top:18px; }
.verdict { border-radius:10px; padding:14px 18px; font-size:17px; border:1px solid; }
.verdict b { margin-right:6px; }
.good { color:var(--good); background:var(--good-bg); }
.bad { color:var(--bad); background:var(--bad-bg); }
.tiles { display:grid; grid-template-columns:repeat(auto-fit,minmax(140px,1fr));
  gap:12px; margin-top:18px; }
.tile { background:var(--card); border:1px solid var(--line); border-radius:10px;
  padding:12px 14px; }
.tile .name { color:var(--soft); font-size:13px; }
.tile .value { font-size:22px; font-weight:650; font-variant-numeric:tabular-nums; }
.tile .note { color:var(--soft); font-size:13px; }
.scroll { overflow-x:auto; }
table { border-collapse:collapse; width:100%; font-variant-numeric:tabular-nums; }
th, td { padding:5px 10px; border-bottom:1px solid var(--line); text-align:right;
  white-space:nowrap; }
th { color:var(--soft); font-weight:600; font-size:13px; }
th:first-child, td:first-child, .text { text-align:left; }
tr.sum td { font-weight:650; }
td.text.long { white-space:normal; }
img, video { width:100%; height:auto; border-radius:6px; background:#fff;
  display:block; }
video { background:#000; }
.dot { display:inline-block; width:11px; height:11px; border-radius:3px;
  margin-right:7px; vertical-align:-1px; }
.bar { display:flex; height:12px; border-radius:3px; overflow:hidden; min-width:180px; }
.bar i { display:block; height:100%; }
pre { background:var(--page); border:1px solid var(--line); border-radius:6px;
  padding:10px 12px; overflow-x:auto; margin:0 0 12px;
  font:13px/1.5 ui-monospace, "DejaVu Sans Mono", monospace; }
p { margin:0 0 10px; } .soft { color:var(--soft); font-size:13.5px; }
ul { margin:6px 0 0; padding-left:20px; } a { color:var(--accent); }
@media print { section, .tile { break-inside:avoid; } }
</style>
</head>
<body><main>
$body
</main></body>
</html>
""")


def page(title: str, parts: Iterable[str]) -> str:
    """Return the whole page; empty parts are left out."""
    body = "\n".join(part for part in parts if part)
    return _PAGE.substitute(title=escape(title), body=body)


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
    return (
        f'<div class="scroll"><table><thead><tr>{titles}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def bullets(items: Iterable[str]) -> str:
    """Return a list of sentences; empty if there are none."""
    lines = "".join(f"<li>{escape(item)}</li>" for item in items)
    return f"<ul>{lines}</ul>" if lines else ""


def bar(parts: Iterable[tuple[float, str, str]], full: float) -> str:
    """Return a stacked bar from (value, colour, name); `full` is its whole width."""
    pieces = [
        f'<i style="width:{100.0 * max(value, 0.0) / full:.2f}%;background:{color}" '
        f'title="{escape(name)}"></i>'
        for value, color, name in parts
        if full > 0.0
    ]
    return f'<div class="bar">{"".join(pieces)}</div>'


def dot(color: str, content: str) -> str:
    """Return text behind a coloured mark."""
    return f'<span class="dot" style="background:{color}"></span>{escape(content)}'


def text(content: str) -> str:
    """Return text as HTML."""
    return escape(content)


def note(content: str) -> str:
    """Return a small remark."""
    return f'<p class="soft">{escape(content)}</p>'


def code(content: str) -> str:
    """Return a command or other literal text."""
    return f"<pre>{escape(content)}</pre>"


def picture(path: Path, description: str) -> str:
    """Return a PNG file as part of the page; empty if there is no such file."""
    if not path.exists():
        return ""
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<img alt="{escape(description)}" src="data:image/png;base64,{data}">'


def video(path: Path) -> str:
    """Return a player for a video file that lies beside the page; empty if absent."""
    if not path.exists():
        return ""
    name = escape(path.name)
    return (
        f'<video controls muted playsinline preload="metadata" src="{name}"></video>'
        f'<p class="soft">Video: <a href="{name}">{name}</a></p>'
    )
