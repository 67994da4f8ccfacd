"""Run a mission, read its log by the names of the columns, and write it as CSV.

Usage: python read_log.py FOLDER
"""

import sys
from pathlib import Path

import numpy as np

import mrmg


def main() -> None:
    """Run, read and write the log."""
    folder = Path(sys.argv[1])
    result = mrmg.run("quickstart", out=folder / "run", seed=0, video=None)
    log = mrmg.ExecutionLog.load(result.folder)
    for robot in log.robots:
        arrays, units = log.to_arrays(robot), log.columns(robot)
        step_m = np.hypot(np.diff(arrays["x_m"]), np.diff(arrays["y_m"]))
        work_J = np.nansum(arrays["work_driving_J"])
        print(f"{robot}: {step_m.sum():.1f} m driven with {work_J / 1e3:.2f} kJ")
        table = folder / f"{robot}.csv"
        np.savetxt(
            table,
            np.column_stack(list(arrays.values())),
            delimiter=",",
            header=",".join(units),
            comments="",
            fmt="%.9g",
        )
        print(f"  {len(arrays)} columns: {table}")

    plan = mrmg.Plan.load(result.folder)
    for trajectory in plan.trajectories:
        print(trajectory.robot, "plans", ", ".join(trajectory.columns))
    # With pandas installed: log.to_dataframe("r1").plot(x="time_s", y="v_m_s")


if __name__ == "__main__":
    main()
