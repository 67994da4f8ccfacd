"""What every custom motion model must keep."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mrmg.motion import _kernels
from mrmg.motion.user_motion import UserMotion, user_motion
from mrmg.planning.roadmap._fleet_kernels import FLEET

State = tuple[float, float, float, float, float]


class MotionContract:
    """Tests of a custom motion model; subclasses return its file from `motion_file`.

    Attributes:
        length: the model's `wheelbase` [m].
        limits: v_min [m/s], v_max [m/s], w_max, u1_max and u2_max, as robot.yaml has
            them.
        dt_s: time step of plans [s].
        rests_within_s: time within which braking must end from any state [s].
        arrives_within_s: time in which the robot gets to a point 10 m ahead [s].
    """

    length = 1.2
    limits = (-1.0, 2.0, 0.5, 1.0, 1.0)
    dt_s = 0.1
    rests_within_s = 5.0
    arrives_within_s = 60.0

    def motion_file(self) -> Path:
        """Return the Python file of the motion model."""
        raise NotImplementedError("return the path of your motion model here")

    def motion(self) -> UserMotion:
        """Return the motion model."""
        return user_motion(str(self.motion_file()))

    def states(self) -> Iterator[tuple[State, tuple[float, float]]]:
        """Yield states with controls, within the limits."""
        v_min, v_max, w_max, u1_max, u2_max = self.limits
        rng = np.random.default_rng(5)
        for _ in range(300):
            x, y = rng.uniform(-50.0, 50.0, 2)
            theta = rng.uniform(-math.pi, math.pi)
            v, w = rng.uniform(v_min, v_max), rng.uniform(-w_max, w_max)
            u1, u2 = rng.uniform(-u1_max, u1_max), rng.uniform(-u2_max, u2_max)
            yield (x, y, theta, v, w), (u1, u2)

    def steer(self, state: State, waypoint: tuple[float, float], share: float) -> State:
        """Return the state one step later, steered to a waypoint."""
        motion = self.motion()
        control = motion.steer(
            state, waypoint, share, self.limits, self.length, self.dt_s
        )
        assert np.isfinite(control).all(), f"control {control} at {state}"
        after = motion.step(state, control, self.length, self.dt_s)
        assert np.isfinite(after).all(), f"state {after} after {state}, {control}"
        return after  # type: ignore[return-value]

    def test_a_step_is_a_function_of_its_arguments(self) -> None:
        """Plans are replayed, moved and verified by the same steps."""
        step = self.motion().step
        cases = list(self.states())
        first = [step(*case, self.length, self.dt_s) for case in cases]
        again = [step(*case, self.length, self.dt_s) for case in reversed(cases)]
        assert again[::-1] == first, "equal steps lead to different states"

    def test_compiled_it_moves_as_in_python(self) -> None:
        """The planner steps with the compiled form, the verifier with the other."""
        motion = self.motion()
        robot = np.zeros(1, FLEET)
        robot["model"], robot["wheelbase"] = _kernels.USER, self.length
        robot["step_at"], robot["steer_at"] = motion.compiled(self.limits)
        after = np.empty(5)
        for state, (u1, u2) in self.states():
            _kernels.step(robot[0], np.array(state), u1, u2, self.dt_s, after)
            own = motion.step(state, (u1, u2), self.length, self.dt_s)
            assert np.allclose(after, own, rtol=0.0, atol=1e-9), f"{state}: {own}"
            wanted = _kernels.steer_user(robot[0], np.array(state), 1.0, 2.0, 0.5, 0.1)
            given = motion.steer(state, (1.0, 2.0), 0.5, self.limits, self.length, 0.1)
            assert np.allclose(wanted, given, rtol=0.0, atol=1e-9), f"{state}: {given}"

    def test_no_time_leads_nowhere(self) -> None:
        """The pose after no time is the pose before."""
        step = self.motion().step
        for state, control in self.states():
            after = step(state, control, self.length, 0.0)
            assert np.allclose(after[:3], state[:3], rtol=0.0, atol=1e-9), f"{state}"

    def test_half_a_step_twice_is_a_step(self) -> None:
        """Within a centimetre and a hundredth of a radian."""
        step = self.motion().step
        for state, control in self.states():
            middle = step(state, control, self.length, 0.5 * self.dt_s)
            twice = step(middle, control, self.length, 0.5 * self.dt_s)
            once = step(state, control, self.length, self.dt_s)
            assert np.allclose(twice[:3], once[:3], rtol=0.0, atol=0.01), f"{state}"

    def test_it_moves_as_fast_as_its_state_says(self) -> None:
        """Energy is charged for the state's speed: other motion would cost too little.

        The way of a step lies between what the speeds at both its ends lead over.
        """
        step = self.motion().step
        for state, control in self.states():
            after = step(state, control, self.length, self.dt_s)
            way_m = math.dist(state[:2], after[:2])
            slow, fast = sorted((abs(state[3]), abs(after[3])))
            if state[3] * after[3] < 0.0:
                slow = 0.0
            least_m, most_m = 0.98 * slow * self.dt_s, 1.02 * fast * self.dt_s
            detail = f"{way_m:.4f} m of {least_m:.4f} to {most_m:.4f} m at {state}"
            assert least_m - 1e-6 <= way_m <= most_m + 1e-6, detail

    def test_it_brakes_to_rest(self) -> None:
        """Steered at share 0 it stands before long, and stays where it is."""
        for state, _ in self.states():
            here = state
            for _ in range(round(self.rests_within_s / self.dt_s)):
                here = self.steer(here, (state[0], state[1]), 0.0)
            assert max(abs(here[3]), abs(here[4])) < 1e-9, f"still moving: {here}"
            later = self.steer(here, (state[0], state[1]), 0.0)
            assert np.allclose(later, here, rtol=0.0, atol=1e-6), f"drifts: {here}"

    def test_it_gets_to_a_waypoint_ahead(self) -> None:
        """And keeps its limits of speed on the way, and drives nearly as fast.

        Searches for motions reckon with the top speed: for a slower robot they look
        about near its start, and find no way round others.
        """
        v_min, v_max, w_max, _, _ = self.limits
        for theta in (0.0, 0.5, -0.5):
            here: State = (0.0, 0.0, theta, 0.0, 0.0)
            nearest_m, fastest = 10.0, 0.0
            for _ in range(round(self.arrives_within_s / self.dt_s)):
                here = self.steer(here, (10.0, 0.0), 1.0)
                assert v_min - 1e-6 <= here[3] <= v_max + 1e-6, f"speed: {here}"
                assert abs(here[4]) <= w_max + 1e-6, f"w: {here}"
                nearest_m = min(nearest_m, math.dist(here[:2], (10.0, 0.0)))
                fastest = max(fastest, here[3])
            assert nearest_m < 1.0, f"comes no nearer than {nearest_m:.2f} m"
            assert fastest > 0.8 * v_max, f"at most {fastest:.2f} m/s"
