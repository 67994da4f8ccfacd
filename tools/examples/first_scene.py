"""Build a scene in Python, run the whole mission, and print what came of it.

Usage: python first_scene.py FOLDER
"""

import sys
from pathlib import Path

import mrmg
from mrmg.scene.loading import dump_scene, scene_from_document

YARD = {
    "format": 1,
    "name": "yard",
    "bounds": [0, 0, 40, 30],
    "obstacles": [{"id": "shed", "box": {"center": [20, 15], "size": [6, 8]}}],
    "terrain": [
        {"id": "mud", "box": {"center": [31, 8], "size": [8, 10]}, "multiplier": 2.5}
    ],
    "goals": [
        {"id": f"g{number}", "circle": {"center": center, "radius": 1.5}}
        for number, center in enumerate([[8, 25], [33, 25], [34, 6]], start=1)
    ],
    "stations": [{"id": "s1", "circle": {"center": [26, 25], "radius": 1.8}}],
    "battery": {"capacity_m": 60},
    "robots": [
        {"id": "r1", "model": "car", "pose": [4, 6, 0]},
        {"id": "r2", "model": "car", "pose": [4, 12, 0]},
    ],
}


def main() -> None:
    """Run the mission and print its figures."""
    folder = Path(sys.argv[1])
    scene = scene_from_document(YARD, source="yard")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "yard.yaml").write_text(dump_scene(scene))  # for `mrmg scene draw`
    result = mrmg.run(scene, out=folder / "run", seed=0, video=None)
    plan, energy = result.summary["plan"], result.summary["energy"]
    print(f"status: {result.summary['status']}, exit code {int(result.exit_code)}")
    print(f"planned: {plan['cost_J'] / 1e3:.2f} kJ in {plan['makespan_s']:.0f} s")
    print(f"measured: {energy['measured_J'] / 1e3:.2f} kJ")
    print(f"report: {result.folder / 'report.html'}")


if __name__ == "__main__":
    main()
