"""Write seeded traffic for bench_kinodynamic: yards, swaps, crowds and narrow places.

Robots that cannot but get in each other's way, or have little room to turn, in the
format of the outside benchmarks, so that planners can be tried on cases that nobody has
seen. The same seed gives the same file.

- yard6, yard7: second-order cars of 1 x 1 m among nine boxes on 10 x 10 m.
- swap2, swap3, swap4: first-order unicycles around a point go to the opposite place.
- window: two first-order unicycles change rooms through a window 0.6 to 0.8 m wide.
- alcove: two first-order unicycles change ends of a corridor too narrow to pass in; one
  of them can wait in an alcove.
- lanes: a second-order car of 1 x 1 m drives up and down lanes 1.3 to 2.2 m wide.
- bay: such a car ends in a bay 0.1 to 0.3 m wider than itself, along it, and within
  0.5 m of a place beside the bay's middle.
- crowd4, crowd8: first-order unicycles of 0.8 x 0.8 m among ten boxes on 10 x 10 m
  start and end as close to them as 0.03 m.
- maze4, maze6: first-order unicycles change places in a maze of 5 x 5 cells, 0.6 to
  1.2 m wide.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan2, cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import yaml
from maze import drawn_maze
from protocol import run, seed_range
from scipy import ndimage
from shapely import affinity

Document = dict[str, Any]
Pose = tuple[float, float, float]

YARD_M = 10.0
"""Side of a yard."""


@dataclass(frozen=True, slots=True)
class Kind:
    """What a yard is like.

    Attributes:
        boxes: their number.
        box_m: their sides, least and largest.
        lane_m: radius of a disc that gets from everywhere to everywhere.
        size_m: length and width of a robot.
        apart_m: distance of robots from boxes where they start and must end.
    """

    boxes: int
    box_m: tuple[float, float]
    lane_m: float
    size_m: tuple[float, float]
    apart_m: float


YARD = Kind(9, (0.5, 1.4), 0.75, (1.0, 1.0), apart_m=0.4)
CROWD = Kind(10, (0.2, 2.2), 0.5, (0.8, 0.8), apart_m=0.03)

APART_M = 0.4
"""Distance of robots from each other where they start and must end."""

MAZE_CELL_M = 0.6, 1.2
"""Sides of a maze's cells, least and most."""

CELL_M = 0.1
"""Side of the cells by which that is found."""

JITTER_M, JITTER_RAD = 0.15, 0.3
"""How far swaps are off the regular polygon."""


def main() -> int:
    """Write the files."""
    parser = argparse.ArgumentParser(
        description=__doc__,
        prog="tools/generate_traffic",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path, help="receives CLASS_SEED.yaml")
    parser.add_argument("--only", default="", help="part of the class's name")
    parser.add_argument(
        "--seeds", type=seed_range, default="0-4", help="first-last, default 0-4"
    )
    options = parser.parse_args()
    makers = {name: make for name, make in CLASSES.items() if options.only in name}
    if not makers:
        print(f"no class of {', '.join(CLASSES)} is named so", file=sys.stderr)
        return 1
    options.folder.mkdir(parents=True, exist_ok=True)
    for number, (name, make) in enumerate(CLASSES.items()):
        for seed in options.seeds if name in makers else ():
            document = make(np.random.default_rng((number, seed)))
            path = options.folder / f"{name}_{seed}.yaml"
            path.write_text(yaml.safe_dump(document))
            print(path)
    return 0


def world(width: float, height: float, boxes: Sequence[Sequence[float]]) -> Document:
    """Return an environment; a box is (x, y, length, width)."""
    obstacles = [
        {"type": "box", "center": [x, y], "size": [dx, dy]} for x, y, dx, dy in boxes
    ]
    return {"min": [0, 0], "max": [width, height], "obstacles": rounded(obstacles)}


def rounded(value: Any) -> Any:
    """Return a document with plain numbers of three decimals."""
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(one) for one in value]
    return round(float(value), 3) if isinstance(value, (float, np.floating)) else value


def unicycle(start: Sequence[float], goal: Sequence[float]) -> Document:
    """Return a first-order unicycle of 0.5 x 0.25 m."""
    return rounded(
        {"type": "unicycle_first_order_0", "start": list(start), "goal": list(goal)}
    )


def car(start: Sequence[float], goal: Sequence[float]) -> Document:
    """Return a second-order car of 1 x 1 m; goals without headings leave them free."""
    x, y, theta = start
    return rounded(
        {
            "type": "kcbs_second_order_car",
            "size": [1.0, 1.0],
            "start": [x, y, 0.0, 0.0, theta],
            "goal": list(goal),
        }
    )


def yard(rng: np.random.Generator, cars: int) -> Document:
    """Return a dense yard."""
    place, starts, goals = drawn_yard(rng, YARD, cars)
    ends = [goal[:2] for goal in goals]
    return {"environment": place, "robots": [*map(car, starts, ends)]}


def crowd(rng: np.random.Generator, robots: int) -> Document:
    """Return unicycles that start and end close to boxes."""
    place, starts, goals = drawn_yard(rng, CROWD, robots)
    size = {"size": list(CROWD.size_m)}
    placed = [size | unicycle(*ends) for ends in zip(starts, goals, strict=True)]
    return {"environment": place, "robots": placed}


def drawn_yard(
    rng: np.random.Generator, kind: Kind, robots: int
) -> tuple[Document, list[Pose], list[Pose]]:
    """Return a yard, starts and goals; drawn anew until there is room for everybody."""
    while True:
        sides = rng.uniform(*kind.box_m, (kind.boxes, 2))
        center = rng.uniform(0.5, YARD_M - 0.5, (kind.boxes, 2))
        boxes = np.hstack([center, sides])
        shapes = shapely.union_all([box_of(box) for box in boxes])
        lanes = free_lanes(shapes, kind.lane_m)
        starts = drawn_poses(rng, kind, robots, shapes, lanes)
        goals = drawn_poses(rng, kind, robots, shapes, lanes)
        if len(starts) == len(goals) == robots:
            return world(YARD_M, YARD_M, boxes.tolist()), starts, goals


def box_of(box: Sequence[float]) -> shapely.Polygon:
    """Return a box's shape."""
    x, y, dx, dy = box
    return shapely.box(x - dx / 2, y - dy / 2, x + dx / 2, y + dy / 2)


def free_lanes(obstacles: shapely.Geometry, lane_m: float) -> np.ndarray:
    """Return the cells in the largest part that a disc of a radius gets around in."""
    at = np.arange(0.5 * CELL_M, YARD_M, CELL_M)
    x, y = np.meshgrid(at, at)
    free = shapely.distance(shapely.points(x, y), obstacles) > lane_m
    part, _ = ndimage.label(free)
    sizes = np.bincount(part.ravel())
    sizes[0] = 0
    return np.asarray(part == sizes.argmax())


def drawn_poses(
    rng: np.random.Generator,
    kind: Kind,
    robots: int,
    obstacles: shapely.Geometry,
    lanes: np.ndarray,
) -> list[Pose]:
    """Return poses with room around each; fewer if there is too little."""
    poses: list[Pose] = []
    body, taken = box_of((0.0, 0.0, *kind.size_m)), shapely.Polygon()
    cells = np.argwhere(lanes)
    for row, column in rng.permutation(cells)[:200]:
        x, y = (column + 0.5) * CELL_M, (row + 0.5) * CELL_M
        theta = float(rng.uniform(-pi, pi))
        if not 0.6 < min(x, y) <= max(x, y) < YARD_M - 0.6:
            continue
        turned = affinity.rotate(body, theta, (0.0, 0.0), use_radians=True)
        placed = affinity.translate(turned, x, y)
        free = placed.distance(obstacles) > kind.apart_m
        if free and not placed.distance(taken) <= APART_M and len(poses) < robots:
            poses.append((x, y, theta))
            taken = taken.union(placed)
    return poses


def swap(rng: np.random.Generator, robots: int) -> Document:
    """Return unicycles on a circle, each with the opposite place as its goal."""
    turn = rng.uniform(0.0, 2.0 * pi)
    placed = []
    for r in range(robots):
        angle = turn + 2.0 * pi * r / robots + rng.uniform(-JITTER_RAD, JITTER_RAD) / 2
        off = rng.uniform(-JITTER_M, JITTER_M, 2)
        x, y = 2.5 + 1.5 * cos(angle) + off[0], 2.5 + 1.5 * sin(angle) + off[1]
        facing = angle + pi + rng.uniform(-JITTER_RAD, JITTER_RAD)
        goal = (5.0 - x, 5.0 - y, facing)
        placed.append(unicycle((x, y, facing), goal))
    return {"environment": world(5.0, 5.0, []), "robots": placed}


def window(rng: np.random.Generator) -> Document:
    """Return two unicycles in two rooms that a window joins."""
    gap, middle = rng.uniform(0.6, 0.8), rng.uniform(1.2, 2.8)
    low, high = middle - gap / 2, middle + gap / 2
    boxes = [(3.0, low / 2, 0.3, low), (3.0, (4.0 + high) / 2, 0.3, 4.0 - high)]
    left = (rng.uniform(0.8, 1.6), rng.uniform(0.8, 3.2), rng.uniform(-pi, pi))
    right = (rng.uniform(4.4, 5.2), rng.uniform(0.8, 3.2), rng.uniform(-pi, pi))
    robots = [unicycle(left, right), unicycle(right, left)]
    return {"environment": world(6.0, 4.0, boxes), "robots": robots}


def alcove(rng: np.random.Generator) -> Document:
    """Return two unicycles at the ends of a corridor with an alcove."""
    floor, corridor = 0.5, 0.55
    deep, wide = rng.uniform(0.8, 1.0), rng.uniform(0.9, 1.2)
    at = rng.uniform(2.0, 4.0)
    low, high = at - wide / 2, at + wide / 2
    top = floor + corridor + deep
    y, middle = top - deep / 2, floor + corridor / 2
    boxes = [(low / 2, y, low, deep), ((6.0 + high) / 2, y, 6.0 - high, deep)]
    # The bounds are those of centres: bodies may reach beyond them, but not into a box.
    boxes.append((3.0, floor / 2, 6.0, floor))
    robots = [unicycle((0.6, middle, 0.0), (5.4, middle, 0.0))]
    robots.append(unicycle((5.4, middle, pi), (0.6, middle, pi)))
    return {"environment": world(6.0, top, boxes), "robots": robots}


def lanes(rng: np.random.Generator) -> Document:
    """Return a car that drives up one lane and down the next, to the last one."""
    wide, wall = rng.uniform(1.3, 2.2), 0.3
    long, left, boxes = YARD_M - wide, wide, list[tuple[float, ...]]()
    while left + wall + wide <= YARD_M:
        y = long / 2 + len(boxes) % 2 * wide
        boxes.append((left + wall / 2, y, wall, long))
        left += wall + wide
    start = (wide / 2, rng.uniform(1.0, 9.0), rng.choice([-pi / 2, pi / 2]))
    goal = (left + wide / 2, rng.uniform(1.0, 9.0))
    place = world(left + wide, YARD_M, boxes)
    return {"environment": place, "robots": [car(start, goal)]}


def bay(rng: np.random.Generator) -> Document:
    """Return a car that ends in a bay, beside its middle."""
    wide, deep, at = 1.0 + rng.uniform(0.1, 0.3), rng.uniform(1.5, 2.5), 5.0
    y = YARD_M - deep / 2
    boxes = [(at + side * (wide / 2 + 0.5), y, 1.0, deep) for side in (-1.0, 1.0)]
    start = (rng.uniform(2.0, 8.0), rng.uniform(1.5, 4.0), rng.uniform(-pi, pi))
    goal = (at + rng.uniform(-0.3, 0.3), y, rng.choice([-pi / 2, pi / 2]))
    place = world(YARD_M, YARD_M, boxes)
    return {"environment": place, "robots": [car(start, goal)]}


def maze(rng: np.random.Generator, robots: int) -> Document:
    """Return unicycles that change places in a maze."""
    drawn = drawn_maze(rng, rng.uniform(*MAZE_CELL_M))

    def pose(cell: int) -> Pose:
        """Return a pose in a cell, which faces one that no wall parts from it."""
        pairs = drawn.joined[(drawn.joined == cell).any(axis=1)]
        x, y = drawn.middle[cell]
        dx, dy = drawn.middle[rng.choice(pairs[pairs != cell])] - drawn.middle[cell]
        return float(x), float(y), atan2(dy, dx)

    starts, goals = rng.choice(len(drawn.middle), (2, robots), replace=False)
    placed = [unicycle(pose(a), pose(b)) for a, b in zip(starts, goals, strict=True)]
    place = world(drawn.side_m, drawn.side_m, drawn.wall.tolist())
    return {"environment": place, "robots": placed}


CLASSES: dict[str, Callable[[np.random.Generator], Document]] = {
    "yard6": lambda rng: yard(rng, 6),
    "yard7": lambda rng: yard(rng, 7),
    "swap2": lambda rng: swap(rng, 2),
    "swap3": lambda rng: swap(rng, 3),
    "swap4": lambda rng: swap(rng, 4),
    "window": window,
    "alcove": alcove,
    "lanes": lanes,
    "bay": bay,
    "crowd4": lambda rng: crowd(rng, 4),
    "crowd8": lambda rng: crowd(rng, 8),
    "maze4": lambda rng: maze(rng, 4),
    "maze6": lambda rng: maze(rng, 6),
}
"""What makes a file of each class."""


if __name__ == "__main__":
    run(main)
