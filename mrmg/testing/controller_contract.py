"""What every tracking controller must keep."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from mrmg.motion.dynamics import NX
from mrmg.motion.user_motion import plain_step
from mrmg.scene.loading.models import load_model, model_folder
from mrmg.scene.robot_model import RobotModel
from mrmg.simulation.controller import HORIZON, HORIZON_STEP_S, Controller

TICK_S = 0.02
"""Step of the motions that controllers are tested on [s]."""

TICKS_A_CALL = 2
"""Ticks from call to call: 25 Hz."""

TICKS_A_STEP = round(HORIZON_STEP_S / TICK_S)

SWITCHING_S = 0.7
"""For how long the controls of the reference are held [s]."""

DURATION_S = 20.0
"""Length of the reference [s]."""


class ControllerContract:
    """Tests of a tracking controller; subclasses return one from `controller`.

    Attributes:
        models: names of shipped robot models, or folders of others, that it drives.
        at_rest: greatest correction on a straight reference that needs none.
        astray_m: greatest distance from the reference, begun without an error.
    """

    models: tuple[str, ...] = ("car", "diffdrive")
    at_rest = 1e-4
    astray_m = 0.05

    def controller(self, model: RobotModel) -> Controller:
        """Return a new controller of a robot."""
        raise NotImplementedError("return your controller here")

    def robots(self) -> Iterator[RobotModel]:
        """Yield the models of the robots that it drives."""
        for name in self.models:
            yield load_model(model_folder(name, None))[0]

    def test_a_correction_is_two_finite_numbers(self) -> None:
        """Even far from the reference, and at the limits of the state."""
        rng = np.random.default_rng(2)
        for model in self.robots():
            limits = model.limits
            low = (-9.0, -9.0, -math.pi, limits.v_min_m_s, -limits.w_max)
            high = (9.0, 9.0, math.pi, limits.v_max_m_s, limits.w_max)
            controller = self.controller(model)
            reference = straight(0.75 * limits.v_max_m_s)
            for _ in range(50):
                correction = controller.correct(rng.uniform(low, high), reference)
                assert np.shape(correction) == (2,), model.name
                assert np.isfinite(correction).all(), f"{model.name}: {correction}"

    def test_on_a_straight_reference_nothing_is_corrected(self) -> None:
        """Forwards, backwards and at rest."""
        for model in self.robots():
            for share in (0.75, 0.0, -0.75):
                reference = straight(share_of_limit(model, share))
                correction = self.controller(model).correct(reference[0], reference)
                most = float(np.abs(correction).max())
                assert most <= self.at_rest, f"{model.name}: {correction}"

    def test_it_steers_back(self) -> None:
        """Left of the reference it turns right; a unicycle that backs up turns left."""
        for model in self.robots():
            turns = model.motion_model == "unicycle"
            for share in (0.75, -0.75):
                speed = share_of_limit(model, share)
                reference = straight(speed)
                state = reference[0] + [0.0, 0.2, 0.0, 0.0, 0.0]
                u2 = self.controller(model).correct(state, reference)[1]
                assert u2 * (np.sign(speed) if turns else 1.0) < 0.0, model.name

    def test_it_speeds_up_when_behind(self) -> None:
        """Forwards and backwards."""
        for model in self.robots():
            for share in (0.75, -0.75):
                speed = share_of_limit(model, share)
                reference = straight(speed)
                state = reference[0] - [0.2 * np.sign(speed), 0.0, 0.0, 0.0, 0.0]
                u1 = self.controller(model).correct(state, reference)[0]
                assert u1 * speed > 0.0, model.name

    def test_it_stays_on_its_reference(self) -> None:
        """Switching controls, both directions, the planner's range of the limits."""
        for model in self.robots():
            astray_m, _ = self.followed(model, (0.0,) * NX)
            assert astray_m.max() < self.astray_m, model.name

    def test_it_recovers_from_an_offset(self) -> None:
        """Of 0.22 m and 0.1 rad."""
        for model in self.robots():
            astray_m, _ = self.followed(model, (0.1, -0.2, 0.1, 0.0, 0.0))
            assert astray_m[-50:].max() < self.astray_m, model.name

    def test_equal_inputs_give_equal_corrections(self) -> None:
        """Of two controllers that were made alike, and inputs are not changed."""
        for model in self.robots():
            _, first = self.followed(model, (0.1, 0.1, 0.0, 0.0, 0.0))
            _, second = self.followed(model, (0.1, 0.1, 0.0, 0.0, 0.0))
            assert np.array_equal(first, second), model.name

    def followed(
        self, model: RobotModel, offset: tuple[float, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return errors and corrections where only the motion model moves the robot."""
        controller = self.controller(model)
        controls, states = reference_of(model)
        bound = np.array([model.limits.u1_max_m_s2, model.limits.u2_max])
        state = states[0] + offset
        astray_m, corrections = [], []
        last = len(controls) - HORIZON * TICKS_A_STEP
        for tick in range(0, last, TICKS_A_CALL):
            ahead = states[tick : tick + HORIZON * TICKS_A_STEP + 1 : TICKS_A_STEP]
            given = (state.copy(), ahead.copy())
            correction = np.asarray(controller.correct(*given))
            changed = not np.array_equal(given[0], state)
            assert not changed, f"{model.name}: the state was changed"
            assert np.array_equal(given[1], ahead), f"{model.name}: the reference was"
            for k in range(tick, tick + TICKS_A_CALL):
                control = np.clip(controls[k] + correction, -bound, bound)
                state = moved(model, state, control)
            astray_m.append(math.dist(state[:2], states[tick + TICKS_A_CALL, :2]))
            corrections.append(correction)
        return np.array(astray_m), np.array(corrections)


def straight(speed: float) -> np.ndarray:
    """Return a reference along x at a speed [m/s], shape (HORIZON + 1, 5)."""
    reference = np.zeros((HORIZON + 1, NX))
    reference[:, 0] = speed * HORIZON_STEP_S * np.arange(HORIZON + 1)
    reference[:, 3] = speed
    return reference


def share_of_limit(model: RobotModel, share: float) -> float:
    """Return a share of the top speed; of the reverse one where it is negative."""
    limits = model.limits
    return share * (limits.v_max_m_s if share > 0.0 else -limits.v_min_m_s)


def moved(model: RobotModel, state: np.ndarray, control: np.ndarray) -> np.ndarray:
    """Return the state one tick later."""
    step = plain_step(model)
    return np.array(step(state, control, model.wheelbase_m, TICK_S))


def reference_of(model: RobotModel) -> tuple[np.ndarray, np.ndarray]:
    """Return controls that switch within the planner's limits, and their states."""
    rng = np.random.default_rng(2)
    limits = model.planned_limits
    ticks, held = round(DURATION_S / TICK_S), round(SWITCHING_S / TICK_S)
    states, controls = np.zeros((ticks + 1, NX)), np.zeros((ticks, 2))
    for k in range(ticks):
        if k % held == 0:
            wanted = rng.choice([-1.0, 0.0, 1.0], 2)
        after = states[k, 3:] + TICK_S * wanted * (limits.u1_max_m_s2, limits.u2_max)
        low, high = (limits.v_min_m_s, -limits.w_max), (limits.v_max_m_s, limits.w_max)
        controls[k] = (np.clip(after, low, high) - states[k, 3:]) / TICK_S
        states[k + 1] = moved(model, states[k], controls[k])
    return controls, states
