"""The two stories of the README: files to begin with, the commands, and the pictures.

The files are made up: an occupancy map of a hall as SLAM would leave it, with masks to
keep out and to slow down, a URDF, and an elevation model in degrees.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[2]
FREE, UNKNOWN, OCCUPIED = 254, 205, 0
CELL_M = 0.05

MAP = """image: {name}.pgm
mode: {mode}
resolution: {cell}
origin: [-2.0, -1.5, 0.0]
negate: 0
occupied_thresh: {occupied}
free_thresh: {free}
"""

WHEEL = """
  <link name="{side}_wheel">
    <inertial><mass value="0.8"/>
      <inertia ixx="0.001" iyy="0.002" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin rpy="1.5708 0 0"/>
      <geometry><cylinder radius="0.08" length="0.04"/></geometry></collision>
  </link>
  <joint name="{side}_wheel_joint" type="continuous">
    <parent link="base_link"/><child link="{side}_wheel"/>
    <origin xyz="0 {y} 0.08"/><axis xyz="0 1 0"/><limit velocity="12" effort="4"/>
  </joint>"""

URDF = """<robot name="cart">
  <link name="base_link">
    <inertial><origin xyz="0.02 0 0.15"/><mass value="12"/>
      <inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.02 0 0.18"/>
      <geometry><box size="0.5 0.34 0.22"/></geometry></collision>
    <collision><origin xyz="0.18 0 0.04"/>
      <geometry><sphere radius="0.04"/></geometry></collision>
  </link>{wheels}
</robot>
"""


def write_hall(folder: Path) -> None:
    """Write `hall.yaml`, the masks `keepout.yaml` and `speed.yaml`, and `cart.urdf`."""
    rng = np.random.default_rng(5)
    rows, columns = 320, 520
    y, x = np.mgrid[0:rows, 0:columns] * CELL_M
    wall = np.ones((rows, columns), dtype=bool)
    wall[14:-14, 16:-16] = False
    for left in (6.0, 10.0, 14.0, 18.0):  # rows of shelves
        wall |= (abs(x - left) < 0.5) & (abs(y - 5.0) < 2.4)
        wall |= (abs(x - left) < 0.5) & (abs(y - 11.6) < 2.0)
    wall |= (np.hypot(x - 22.4, y - 8.2) < 0.5) | (abs(x - 3.2) + abs(y - 8.0) < 0.6)
    near = wall ^ np.roll(wall, 1, axis=0) | wall ^ np.roll(wall, 1, axis=1)
    wall ^= near & (rng.random(wall.shape) < 0.3)  # as a scanner sees its edges
    grey = np.where(wall, OCCUPIED, FREE)
    grey[:10], grey[-10:], grey[:, :12], grey[:, -12:] = (UNKNOWN,) * 4
    keepout = np.where((x > 20.5) & (y < 4.0) & ~wall, OCCUPIED, FREE)
    speed = np.where(abs(y - 8.3) < 0.6, 128, 255)
    for name, values, keys in (
        ("hall", grey, ("trinary", 0.65, 0.196)),
        ("keepout", keepout, ("trinary", 0.65, 0.196)),
        ("speed", speed, ("scale", 1.0, 0.0)),
    ):
        Image.fromarray(values.astype(np.uint8)).save(folder / f"{name}.pgm")
        mode, occupied, free = keys
        text = MAP.format(
            name=name, mode=mode, cell=CELL_M, occupied=occupied, free=free
        )
        (folder / f"{name}.yaml").write_text(text)
    wheels = "".join(
        WHEEL.format(side=side, y=y) for side, y in (("left", 0.19), ("right", -0.19))
    )
    (folder / "cart.urdf").write_text(URDF.format(wheels=wheels))


def write_field(folder: Path) -> None:
    """Write `field.tif`, heights of 90 m x 70 m in degrees, with a pond of no data."""
    import rasterio
    from rasterio.transform import from_origin

    row, column = np.mgrid[0:78, 0:120]
    heights = 430 + 2.0 * np.sin(column / 22) + 1.4 * np.cos(row / 14 + column / 40)
    heights[np.hypot(row - 50, 0.7 * (column - 44)) < 8] = -9999
    keys = {"driver": "GTiff", "width": 120, "height": 78, "count": 1, "nodata": -9999}
    place = from_origin(8.33, 47.85, 1e-5, 0.9e-5)
    with rasterio.open(
        folder / "field.tif",
        "w",
        dtype="float32",
        crs="EPSG:4326",
        transform=place,
        **keys,
    ) as file:
        file.write(heights.astype("float32"), 1)


def stories() -> tuple[list[str], list[str]]:
    """Return the commands of the README's two stories, without `$ mrmg`."""
    text = (ROOT / "README.md").read_text()
    section = text.partition("## From your map")[2].partition("\n## ")[0]
    first, second = re.findall(r"(?:^    \$ mrmg .*\n)+", section, re.MULTILINE)
    lines = [
        re.findall(r"^    \$ mrmg (.*)", part, re.MULTILINE) for part in (first, second)
    ]
    return lines[0], lines[1]


def main() -> None:
    """Run both stories in a new folder, and keep the pictures of their missions."""
    folder = ROOT / "runs" / "stories"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    write_hall(folder)
    write_field(folder)
    for story, name in zip(stories(), ("hall", "field"), strict=True):
        for line in story:
            words = [sys.executable, "-m", "mrmg", *shlex.split(line)]
            subprocess.run(words, cwd=folder, check=True)
        picture = folder / "runs" / name / "overview.png"
        shutil.copy(picture, ROOT / "tools" / "pictures" / f"{name}.png")


if __name__ == "__main__":
    main()
