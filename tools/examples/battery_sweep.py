"""Plan one scene with batteries of several sizes, and plot energy and recharges.

Usage: python battery_sweep.py FOLDER
"""

import sys
from pathlib import Path

import matplotlib

import mrmg

matplotlib.use("agg")
CAPACITIES_M = (40, 50, 60, 80, 120)
"""Battery sizes, in metres of plain ground that a full battery is good for."""


def main() -> None:
    """Plan with every battery and plot the figures."""
    from matplotlib import pyplot as plt

    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    scene = mrmg.load_scene("quickstart")
    rows = []
    for capacity_m in CAPACITIES_M:
        changed = scene.with_(battery={"capacity_m": capacity_m})
        result = mrmg.plan(changed, seed=0)
        if result.plan is None:
            print(f"{capacity_m:4d} m: {result.status.value}; {result.reason}")
            continue
        assert mrmg.verify(changed, result.plan).ok
        recharges = sum(visit.kind == "station" for visit in result.plan.visits)
        rows.append((capacity_m, result.plan.cost_J / 1e3, recharges))
        print("{:4d} m: {:.2f} kJ, {} recharges".format(*rows[-1]))

    sizes_m, energies_kJ, recharges_made = zip(*rows, strict=True)
    figure, (above, below) = plt.subplots(2, sharex=True, layout="constrained")
    above.plot(sizes_m, energies_kJ, "o-")
    above.set_ylabel("energy of the fleet [kJ]")
    below.plot(sizes_m, recharges_made, "o")
    below.set_ylabel("recharges")
    below.set_yticks(range(max(recharges_made) + 1))
    below.set_xlabel("battery [m of plain ground]")
    figure.savefig(folder / "battery_sweep.png", dpi=150)
    print(folder / "battery_sweep.png")


if __name__ == "__main__":
    main()
