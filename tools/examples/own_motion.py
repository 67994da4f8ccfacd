"""Plan for a robot with a motion of one's own, which the planner takes as a black box.

Usage: python own_motion.py FOLDER
"""

import shutil
import sys
from pathlib import Path

import mrmg
from mrmg.shipped import models_folder

MOTION = '''
from math import atan2, cos, hypot, pi, sin

def step(state, control, length, dt):
    """Return the state after dt: the control is the speed and the yaw rate."""
    x, y, theta, _, _ = state
    v, w = control
    middle = theta + 0.5 * w * dt
    return x + v * dt * cos(middle), y + v * dt * sin(middle), theta + w * dt, v, w

def steer(state, waypoint, share, limits, length, dt):
    """Return the control towards a waypoint; share 0 means to brake."""
    if share == 0.0:
        return 0.0, 0.0
    dx, dy = waypoint[0] - state[0], waypoint[1] - state[1]
    off = atan2(dy, dx) - state[2]
    off -= 2.0 * pi * round(off / (2.0 * pi))
    v = share * limits[3] * max(0.0, cos(off)) ** 3
    return min(v, hypot(dx, dy) / dt), max(-limits[4], min(limits[4], off / dt))
'''
"""What `mrmg.testing.MotionContract` tests. The file is code: scenes that name it are
loaded with `trust_code=True`, or `--trust-code`."""

CHANGES = {
    "motion_model: unicycle": "motion_model: motion.py",
    "mjcf: diffdrive.xml": "",  # planned for, not simulated
    "v_max: 1.6": "v_max: 0.8",
    "u1_max: 1.2": "u1_max: 0.8",  # m/s: its controls are speeds
    "u2_max: 2.0": "u2_max: 1.2",  # rad/s
}
"""What robot.yaml shall say instead."""


if __name__ == "__main__":
    robot = Path(sys.argv[1]) / "glider"
    shutil.copytree(models_folder() / "diffdrive", robot, dirs_exist_ok=True)
    text = (robot / "robot.yaml").read_text()
    for before, after in CHANGES.items():
        text = text.replace(before, after)
    (robot / "robot.yaml").write_text(text)
    (robot / "motion.py").write_text(MOTION)

    scene = mrmg.load_scene("diffdrive")
    scene = scene.with_robot("r2", model=str(robot.resolve()), trust_code=True)
    plan = mrmg.plan(scene, seed=0).plan
    print(f"{plan.cost_J:.0f} J; verified: {mrmg.verify(scene, plan).ok}")
    plan.save(Path(sys.argv[1]))
