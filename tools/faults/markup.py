"""Markup in names and texts, none of which may become an element of a page."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import yaml

from faults.commands import Outcome
from faults.inputs import files
from faults.named import Case
from faults.runs import SITE

MARK = "</script></title><img src=x onerror=alert(1)>\"'&<b>"

Way = tuple[str | int, ...]
"""Keys and indices that lead to a text of a document."""


def markup(runs: Path) -> Mapping[str, Case]:
    """Return cases by name, some of them in copies of finished runs."""
    return {**_in_runs(runs), **_in_scenes()}


def _in_runs(runs: Path) -> Mapping[str, Case]:
    """Return cases that put markup into every text of every file of a run."""
    cases = {}
    for path in (*sorted(runs.glob("run/*.json")), *sorted(runs.glob("other/*.json"))):
        name, text = str(path.relative_to(runs)), path.read_text()
        for way in sorted(_texts(json.loads(text))):
            marked = {name: json.dumps(_marked(json.loads(text), way))}
            place = f"{name} {'/'.join(map(str, way))}"
            for command in (
                f"report {path.parent.name}",
                "compare run other -o compare.html",
            ):
                cases[f"{command.split()[0]}: {place}"] = Case(
                    write=files(marked, command, runs),
                    codes=(0, 2, 3, 4, 5, 6),
                    check=_pages_are_clean,
                )
    return cases


def _texts(value: Any, way: Way = ()) -> set[Way]:
    """Return the paths of a document's texts, of lists those of the first entry."""
    if isinstance(value, str):
        return {way}
    if not isinstance(value, (dict, list)):
        return set()
    items = value.items() if isinstance(value, dict) else enumerate(value[:1])
    return {found for key, item in items for found in _texts(item, (*way, key))}


def _marked(document: Any, way: Way) -> Any:
    """Return a document with the mark at the end of one of its texts."""
    *parents, last = way
    parent = document
    for key in parents:
        parent = parent[key]
    parent[last] += MARK
    return document


def _in_scenes() -> Mapping[str, Case]:
    changes: Mapping[str, Callable[[Any], None]] = {
        "scene": lambda it: it.update(name=MARK),
        "goal": lambda it: it["goals"][0].update(id=MARK),
        "station": lambda it: it["stations"][0].update(id=MARK),
        "robot": lambda it: it["robots"][0].update(id=MARK),
        "model": lambda it: it["robots"][0].update(model=MARK),
    }
    campaign = {"scenes": [{"scene": "s.yaml", "name": f"x{MARK}"}]}
    cases = {}
    for what, change in changes.items():
        scene = yaml.safe_load(SITE)
        change(scene)
        written = {"s.yaml": yaml.safe_dump(scene), "c.yaml": yaml.safe_dump(campaign)}
        for command in (
            "run s.yaml --no-video --out out",
            "campaign c.yaml --out out",
        ):
            cases[f"{command.split()[0]}: name of a {what}"] = Case(
                write=files(written, command),
                codes=(0, 2, 3),
                check=_pages_are_clean,
            )
    return cases


class _Elements(HTMLParser):
    """Notes whether a page has the element that the mark would be."""

    found = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found = self.found or ("src", "x") in attrs


def _pages_are_clean(place: Path, outcome: Outcome) -> str:
    for page in sorted(place.rglob("*.html")):
        parser = _Elements()
        parser.feed(page.read_text())
        if parser.found:
            return f"{page.relative_to(place)} has the element of a name"
    return ""
