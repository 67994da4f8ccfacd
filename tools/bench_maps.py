"""Plan missions on maps that others drew; print a table, write JSONL.

Protocol: each map is scaled to a longest side of 100 m and populated once, with robots,
goals and five charging stations; what follows is that of `tools/bench`, one row a map.
The maps of the default are narrow ones.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bench
from protocol import seed_range

from mrmg import storage
from mrmg.authoring import import_map, populate
from mrmg.scene.loading import dump_scene, scene_from_document

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "maps"

NARROW = [
    FOLDER / name
    for name in ("complex3-big.txt", "warehouse.txt", "gaps.txt", "triangles.tri")
]


def main() -> int:
    """Run the bench; return 1 if any mission failed, 2 if a map is not there."""
    options = parse_options()
    missing = [str(path) for path in options.maps if not path.is_file()]
    if missing:
        print(f"no map {', '.join(missing)}; name others", file=sys.stderr)
        return 2
    print(f"{__doc__}\n{options.robots} robots, {options.goals} goals, "
          f"placement {options.placement}\n\n{bench.protocol(options)}")  # fmt: skip
    print(bench.header(options))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for path in options.maps:
            of_map = list(missions(path, Path(folder), options))
            rows += of_map
            bench.print_scene(path.stem, of_map, options)
    if options.output:
        text = "".join(json.dumps(row, sort_keys=True) + "\n" for row in rows)
        options.output.write_text(text)
    return 0 if all(row["ok"] for row in rows) else 1


def parse_options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_maps")
    parser.add_argument("maps", nargs="*", type=Path, metavar="MAP", default=NARROW)
    parser.add_argument("--robots", type=int, default=4, help="default 4")
    parser.add_argument("--goals", type=int, default=20, help="default 20")
    parser.add_argument("--placement", type=int, default=3, help="its seed, default 3")
    parser.add_argument(
        "--seeds", type=seed_range, default="0-19", help="first-last, default 0-19"
    )
    parser.add_argument("--budget", type=float, help="seconds of planning")
    parser.add_argument("--execute", action="store_true", help="drive in MuJoCo too")
    parser.add_argument("--bound", action="store_true", help="compare with a bound")
    parser.add_argument("--output", type=Path, help="JSONL file, one line a mission")
    options = parser.parse_args()
    options.profile = ["default"]
    return options


def missions(
    path: Path, folder: Path, options: argparse.Namespace
) -> Iterator[dict[str, Any]]:
    """Yield one row of the bench for each seed on a map."""
    document = populate(
        import_map(path),
        robots=options.robots,
        goals=options.goals,
        seed=options.placement,
    )
    scene = folder / f"{path.stem}.yaml"
    text = dump_scene(scene_from_document(document, source=str(path)))
    storage.write_text(scene, text)
    for row in bench.missions(str(scene), options):
        row["problem"]["source"] = str(path)
        yield row


if __name__ == "__main__":
    sys.exit(main())
