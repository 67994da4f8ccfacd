"""Make BENCHMARKS.md of stored results; with --run, run the benches that store them.

Results are what benches write with --json: `tools/results/VERSION/NAME.json`, where
`unreleased` is the version at work (a release renames that folder), and
`tools/results/published.json` has figures of others with their sources. Each section of
the page names the command, commit, date and machine of its result; every version is a
row of its history. The page is a function of these files alone.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from benchmark_history import HISTORY, Documents, Row, named, num
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from packaging.version import Version

TOOLS = Path(__file__).parent
RESULTS = TOOLS / "results"
PAGE = TOOLS.parent / "BENCHMARKS.md"
UNRELEASED = "unreleased"

SHIPPED = (
    "quickstart scene1 scene2 scene3 scene4 scene5 scene6 scene6_r1 scene6_r2 "
    "scene6_r6 scene6_r8 mixed diffdrive hills"
)

COMMANDS = {
    "first_plans": "bench --seeds 0-49",
    "bounds": "bench --bound --budget 30 --seeds 0-9",
    "table_1": "bench --seeds 0-49 --profile default paper --energy paper",
    "fleet_sizes": "bench --scenes scene6_r1 scene6_r2 scene6 scene6_r6 scene6_r8 "
    "--seeds 0-9 --profile default paper --energy paper",
    "missions": f"bench --scenes {SHIPPED} --seeds 0-4 --execute",
    "maps": "bench_maps",
    "docks_car": "bench_docks --model car --halls 0-31 --execute",
    "docks_diffdrive": "bench_docks --halls 0-31 --execute",
    "headings_car": "bench_headings --yards 0-31 --execute",
    "headings_diffdrive": "bench_headings --model diffdrive --yards 0-31 --execute",
    "bays_car": "bench_headings --bays 3 --yards 0-31 --execute",
    "random": "bench_random --missions 2000-2099",
    "clmapf": "bench_clmapf --seeds 0-2",
    "kinodynamic": "bench_kinodynamic",
    "routing": "bench_routing",
    "routing_large": "bench_routing --large",
    "growth": "bench_growth --figure tools/pictures/growth.svg",
    "physics": "bench_physics --disturb",
    "controllers": "bench_controllers --trials 2",
    "foreign_tyre": "bench_plant",
    "energy_logs": "bench_logs",
    "campaigns": "bench_campaign --cluster",
    "peers": "peers",
    "faults": "bench_faults",
} | {
    f"nrpa_{depth}": "bench --scenes scene1 scene2 --seeds 1000-1009 --profile paper "
    f"--energy paper --nrpa {depth}"
    for depth in ("2x6", "2x12", "2x25", "2x50")
}  # fmt: skip
"""The whole bench of each result; what is stored may be a part of it."""


def main() -> int:
    """Make the page, or run benches; return the exit code of the last that failed."""
    options = parse_options()
    code = 0
    for name in options.run or ():
        target = RESULTS / UNRELEASED / f"{name}.json"
        line = [*COMMANDS[name].split(), *options.arguments.split()]
        print(f"tools/{' '.join(line)}", flush=True)
        # The environment is there already, except that of the peers.
        tool = (
            ["tools/peers"]
            if name == "peers"
            else [sys.executable, f"tools/{line[0]}.py"]
        )
        call = [*tool, *line[1:], "--json", str(target)]
        code = subprocess.run(call, cwd=TOOLS.parent, check=False).returncode or code
    PAGE.write_text(page())
    print(PAGE.name)
    return code


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/benchmarks",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--run", nargs="+", choices=COMMANDS, metavar="NAME",
        help=f"results to measure anew: {', '.join(COMMANDS)}",
    )  # fmt: skip
    parser.add_argument(
        "--arguments",
        default="",
        metavar="TEXT",
        help='more arguments of these benches, such as "--seeds 0-1" for a part',
    )
    return parser.parse_args()


def versions() -> list[str]:
    """Return the versions that have results, newest first."""
    released = {path.name for path in RESULTS.iterdir() if path.is_dir()} - {UNRELEASED}
    found = sorted(released, key=Version, reverse=True)
    return [UNRELEASED, *found] if (RESULTS / UNRELEASED).is_dir() else found


def read(version: str) -> Documents:
    """Return the stored results of a version by name."""
    files = sorted((RESULTS / version).glob("*.json"))
    return {path.stem: json.loads(path.read_text()) for path in files}


def page() -> str:
    """Return the page of all stored results."""
    stored = {version: read(version) for version in versions()}
    documents: dict[str, Row] = {}
    for each in reversed(stored.values()):  # newer results replace older ones
        documents |= each
    environment = Environment(
        loader=FileSystemLoader(TOOLS),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.globals |= {
        "published": json.loads((RESULTS / "published.json").read_text()),
        "versions": list(stored.items()),
        "documents": documents,
        "machines": machines(documents),
        "stored": lambda *names: set(names) <= set(documents),
        "measured": partial(measured, documents),
        "history": HISTORY,
        "num": num,
        "named": named,
        "ratio": ratio,
        "causes": causes,
        "median": statistics.median,
    }
    return environment.get_template("benchmarks.md.j2").render()


def machines(documents: Documents) -> list[str]:
    """Return the distinct machines with versions that results were measured with."""
    protocols = [each["protocol"] for each in documents.values()]
    found = {
        f"{of['machine']}; "
        + ", ".join(f"{name} {it}" for name, it in sorted(of["versions"].items())): None
        for of in protocols
        if "versions" in of
    }
    return list(found)


def measured(documents: Documents, *names: str) -> str:
    """Return the commands of results with commit, date and load."""
    lines = []
    for name in names:
        of = documents[name]["protocol"]
        made = [f"commit {of['commit']}", of["date"]]
        made += [f"load {of['load']:.1f}"] if "load" in of else []
        made += [of["source"]] if "source" in of else []
        lines.append(f"`{of['command']}` ({', '.join(made)})")
    return "; ".join(lines)


def ratio(row: Row, name: str, decimals: int | None = None) -> str:
    """Return a ratio with its interval, in three digits or so many decimals."""
    numbers = [row[name], *row[f"{name}_interval"]]
    shown = ".3g" if decimals is None else f".{decimals}f"
    texts = [f"{number:{shown}}" for number in numbers if number is not None]
    return texts[0] + f" [{', '.join(texts[1:])}]" * (len(texts) > 1) if texts else "-"


def causes(failures: Mapping[str, int]) -> str:
    """Return failures by cause."""
    return ", ".join(f"{x.replace('_', ' ')}: {n}" for x, n in failures.items()) or "-"


if __name__ == "__main__":
    sys.exit(main())
