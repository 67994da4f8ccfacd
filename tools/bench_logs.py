"""Predict the energy of logged runs of a real robot, each by the others of its terrain.

Every folder of --folder is a terrain, every CSV file in it a run; `mrmg calibrate
--help` lists the columns. Each law of power is fitted without the run and predicts it,
with a 90 % interval from the errors of the other runs. The law with the least mean
error of the logarithm of the energy wins; `mrmg calibrate --log` uses it.

Exit code 1 unless the winner's median error is at most 10 % over all runs and 15 % on
every terrain, at least 80 % of its intervals hold, and three laws were compared.

Tables of --json: `rows` by law (`law`, `parameters`, `median_error_pct`, `holds_pct`,
`width_pct`, `mean_log_error`), `terrains` of the winner (`terrain`, `runs`,
`median_error_pct`, `holds_pct`, `width_pct`), and `runs` (`file`, `terrain`,
`energy_J`, `predicted_J`, `error_pct`, `interval_J`).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from protocol import write_document

from mrmg import shipped
from mrmg.errors import MrmgError
from mrmg.scene.loading.models import load_model
from mrmg.studies.calibration.log_calibration import calibrate_from_logs
from mrmg.studies.calibration.robot_logs import read_run

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "energy" / "borealtc"

MEDIAN_PCT, TERRAIN_PCT, HOLDS_PCT = 10.0, 15.0, 80.0
LEAST_LAWS = 3


def main() -> int:
    """Run the bench; return 1 if the winner misses what is required."""
    parser = argparse.ArgumentParser(description=__doc__, prog="tools/bench_logs")
    parser.add_argument("--folder", type=Path, default=FOLDER)
    parser.add_argument("--robot", default="husky", help="shipped model; default husky")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write a document")
    options = parser.parse_args()
    files = sorted(options.folder.glob("*/*.csv"))
    if not files:
        print(f"no logs in folders of {options.folder}", file=sys.stderr)
        return 1
    try:
        model, _ = load_model(shipped.models_folder() / options.robot)
        runs = [read_run(str(path), path.parent.name, model) for path in files]
        found = calibrate_from_logs(model, runs)
    except MrmgError as error:
        print(error, file=sys.stderr)
        return int(error.exit_code)
    laws = [
        {
            "law": item["name"],
            "parameters": item["parameters_per_terrain"],
            "median_error_pct": item["median_error_pct"],
            "holds_pct": item["intervals_hold_pct"],
            "width_pct": item["interval_width_pct"],
            "mean_log_error": item["mean_log_error"],
        }
        for item in found.laws_json()
    ]
    best = found.laws_json()[0]
    terrains = [
        {
            "terrain": name,
            "runs": item["runs"],
            "median_error_pct": item["median_error_pct"],
            "holds_pct": item["intervals_hold_pct"],
            "width_pct": item["interval_width_pct"],
        }
        for name, item in best["terrains"].items()
    ]
    _print(laws)
    print(f"\n{best['name']}: {best['formula']}\n")
    _print(terrains)
    ok = (
        best["median_error_pct"] <= MEDIAN_PCT
        and all(item["median_error_pct"] <= TERRAIN_PCT for item in terrains)
        and best["intervals_hold_pct"] >= HOLDS_PCT
        and len(laws) >= LEAST_LAWS
    )
    print(f"\n{'PASS' if ok else 'FAIL'}: {len(runs)} runs, {len(laws)} laws")
    written = [
        {**row, "file": Path(row["file"])}
        for row in (item.to_json() for item in found.runs)
    ]
    write_document(options, "bench_logs", laws, ok, terrains=terrains, runs=written)
    return 0 if ok else 1


def _print(rows: list[dict[str, object]]) -> None:
    """Print a table."""
    head = list(rows[0])
    print(" | ".join(name.removesuffix("_pct").replace("_", " ") for name in head))
    for row in rows:
        cells = (
            f"{value:.3g}" if isinstance(value, float) else str(value)
            for value in row.values()
        )
        print(" | ".join(cells))


if __name__ == "__main__":
    sys.exit(main())
