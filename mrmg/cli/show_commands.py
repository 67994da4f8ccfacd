"""The verbs that show runs: compare, figure, view."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from mrmg import interruption
from mrmg.cli import terminal
from mrmg.errors import ExitCode
from mrmg.runs import argument_values as values

LOCAL_HOST = "127.0.0.1"
PORT = 8080


def add_show(verbs: Any) -> None:
    """Add the verbs."""
    pages = verbs.add_parser("compare", help="set runs side by side", command=compare)
    pages.add_argument(
        "runs", type=Path, nargs="+", metavar="RUN", help="run folders, two or more"
    )
    pages.add_out("PAGE.html", "page with table and plots; default compare.html")
    pages.add_trust()
    pages.add_json("the table alone")

    paper = verbs.add_parser("figure", help="draw a figure for a paper", command=figure)
    paper.add_run()
    paper.add_argument(
        "--kind",
        choices=("map", "energy", "timeline"),
        default="map",
        help="default map",
    )
    paper.add_out("FIGURE.pdf", "PDF, SVG or PNG by its suffix; default KIND.pdf")
    paper.add_trust()

    viewer = verbs.add_parser(
        "view", help="watch a run or a scene in three dimensions", command=view
    )
    viewer.add_argument(
        "source", metavar="RUN|SCENE", help="run folder, scene file or shipped scene"
    )
    viewer.add_argument(
        "--in",
        dest="place",
        choices=("window", "browser"),
        help="default: window where there is a screen, else browser",
    )
    viewer.add_argument(
        "--host", default=LOCAL_HOST, help="address the page is served on"
    )
    about = "port of the page; default 8080"
    viewer.add_value("--port", None, about, values.port, PORT)
    viewer.add_trust()


def compare(options: argparse.Namespace) -> None:
    """Set runs side by side: a table, and a page with their courses."""
    from mrmg.report.compare import compare_runs
    from mrmg.report.compare_page import write_comparison

    comparison = compare_runs(options.runs, trust_code=options.trust_code)
    page = options.out or Path("compare.html")
    write_comparison(comparison, page)
    lines = [comparison.to_text(), "", str(page)]
    terminal.print_result(options, comparison.to_json(), lines)


def figure(options: argparse.Namespace) -> None:
    """Draw one figure of a run for a paper."""
    from mrmg.viz.figure import draw_figure

    out = options.out or Path(f"{options.kind}.pdf")
    draw_figure(options.run, options.kind, out, trust_code=options.trust_code)
    print(out)


def view(options: argparse.Namespace) -> int:
    """Show a run or a scene in three dimensions, until stopped."""
    from mrmg.scene.loading import load_scene
    from mrmg.viz.replay import replay_of

    if (Path(options.source) / "run.json").exists():
        replay = replay_of(Path(options.source), trust_code=options.trust_code)
        scene = replay.film.scene
    else:
        replay = None
        scene = load_scene(options.source, trust_code=options.trust_code)
    if (options.place or ("window" if _has_screen() else "browser")) == "window":
        from mrmg.viz.native_view import open_window

        open_window(scene, replay)
        return ExitCode.OK
    from mrmg.viz.browser_view import BrowserView

    page = BrowserView(scene, replay, host=options.host, port=options.port)
    try:
        address = f"open {page.address} in a browser"
        print(f"{scene.name}: {address}; Ctrl-C ends", flush=True)
        page.run()
    except KeyboardInterrupt:
        interruption.accept()
        return interruption.EXIT_CODE
    finally:
        page.close()
    return ExitCode.OK


def _has_screen() -> bool:
    named = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return bool(named) or sys.platform in ("darwin", "win32")
