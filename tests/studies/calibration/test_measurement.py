"""Legs are cut where the plan says, and their features are the textbook's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrmg import shipped
from mrmg.energy.model import GRAVITY_M_S2
from mrmg.errors import UsageError
from mrmg.scene.loading.models import load_model
from mrmg.studies.calibration.manoeuvres import Manoeuvre, Piece, manoeuvres_of
from mrmg.studies.calibration.measurement import drive, drive_legs, step_features

CAR = load_model(shipped.models_folder() / "car")[0]
WEIGHT_N = CAR.mass_kg * GRAVITY_M_S2


def shortest(kind: str, multiplier: float = 1.0) -> Manoeuvre:
    found = [
        item
        for item in manoeuvres_of(CAR)
        if item.kind == kind and item.multiplier == multiplier
    ]
    return min(found, key=lambda item: len(item.control))


def test_a_straight_has_three_legs_with_the_features_of_a_straight() -> None:
    item = shortest("straight", multiplier=2.0)
    legs = list(drive_legs(CAR, item))
    speed = item.pieces[0].control[0] * item.pieces[0].steps * 0.1
    assert [leg.piece for leg in legs] == ["speed up", "cruise", "brake"]
    for leg, piece in zip(legs, item.pieces, strict=True):
        assert leg.duration_s == pytest.approx(piece.steps * 0.1, abs=0.021)
    up, cruise, brake = (leg.features for leg in legs)
    assert cruise[0] == pytest.approx(2.0 * WEIGHT_N * speed, rel=1e-3)
    assert up[2] * legs[0].duration_s == pytest.approx(speed**2 / 2, rel=0.02)
    assert brake[2] * legs[2].duration_s == pytest.approx(-(speed**2) / 2, rel=0.02)
    assert abs(cruise[2]) < 1e-3
    np.testing.assert_allclose([up[1], cruise[1], cruise[3]], 0.0, atol=1e-6)
    assert legs[1].power_W == pytest.approx(0.06 * 2.0 * WEIGHT_N * speed, rel=1e-3)


def test_a_circle_turns_and_its_steering_at_rest_is_no_leg() -> None:
    item = shortest("circle")
    legs = list(drive_legs(CAR, item))
    assert [leg.piece for leg in legs] == ["speed up", "cruise", "brake"]
    steer = item.pieces[0].control[1] * item.pieces[0].steps * 0.1
    speed = item.pieces[1].control[0] * item.pieces[1].steps * 0.1
    cruise = legs[1].features
    assert cruise[1] / cruise[0] == pytest.approx(abs(np.tan(steer)), rel=0.01)
    yaw_rate = speed * np.tan(steer) / CAR.wheelbase_m
    gained = legs[0].features[3] * legs[0].duration_s
    assert gained == pytest.approx(yaw_rate**2 / 2, rel=0.05)


def test_features_of_all_ticks_telescope_to_nothing_gained() -> None:
    """From rest to rest no kinetic energy is gained, so the drive paid for the way."""
    log = drive(CAR, shortest("circle"))
    total = step_features(CAR, log).sum(axis=0)
    np.testing.assert_allclose(total[2:], 0.0, atol=1e-4)
    way_m = np.hypot(*np.diff(log.state[0, :, :2], axis=0).T).sum()
    assert total[0] == pytest.approx(WEIGHT_N * way_m, rel=1e-3)
    paid = 0.06 * total[0] + 0.0152 * total[1]
    assert log.work_J.sum() == pytest.approx(paid, rel=5e-3)


def test_equal_models_are_driven_equally() -> None:
    first, second = (drive(CAR, shortest("circle")) for _ in range(2))
    np.testing.assert_array_equal(first.work_J, second.work_J)
    np.testing.assert_array_equal(first.state, second.state)


def test_what_the_robot_cannot_follow_is_told() -> None:
    """Limits far above the grip of the tyres."""
    limits = replace(CAR.limits, v_max_m_s=50.0, u1_max_m_s2=40.0)
    racer = replace(CAR, limits=limits)
    leap = Manoeuvre("leap", "straight", 1.0, (Piece("speed up", (40.0, 0.0), 10),))
    with pytest.raises(UsageError, match="model 'car' cannot drive a leap"):
        drive(racer, leap)
