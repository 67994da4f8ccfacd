"""Derive a robot from the shipped car, and drive a mission with it.

Usage: python own_robot.py FOLDER
"""

import shutil
import sys
from pathlib import Path

import mrmg
from mrmg.shipped import models_folder

CHANGES = {
    "v_max: 2.0 ": "v_max: 1.5 ",  # m/s
    "u1_max: 1.5 ": "u1_max: 1.0 ",  # m/s^2
}
"""What robot.yaml shall say instead. Mass and geometry stand in the MJCF file, too:
`mrmg robot check FOLDER` reports where both differ."""


def main() -> None:
    """Make the robot, drive it, and print its figures."""
    folder = Path(sys.argv[1])
    robot = folder / "slow_car"
    shutil.copytree(models_folder() / "car", robot, dirs_exist_ok=True)
    text = (robot / "robot.yaml").read_text()
    for before, after in CHANGES.items():
        if before not in text:
            raise SystemExit(f"the shipped car says no longer {before!r}")
        text = text.replace(before, after)
    (robot / "robot.yaml").write_text(text)

    scene = mrmg.load_scene("quickstart").with_robot("r2", model=str(robot.resolve()))
    result = mrmg.plan(scene, seed=0)
    if result.plan is None:
        raise SystemExit(result.reason)
    log = mrmg.execute(scene, result.plan)
    account = mrmg.audit(scene, result.plan, log)
    for item in account.robots:
        fastest_m_s = log.to_arrays(item.robot)["v_m_s"].max()
        print(
            f"{item.robot}: at most {fastest_m_s:.2f} m/s, energy off by "
            f"{item.measured_error_pct:+.2f} % of the plan's"
        )
    print("mission done" if account.mission_ok else "; ".join(account.reasons))


if __name__ == "__main__":
    main()
