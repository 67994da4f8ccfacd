"""What a log says of the drive it holds."""

from __future__ import annotations

from dataclasses import replace

import pytest


def test_tracking_error_is_the_distance_from_the_reference(case, make_log) -> None:
    scene, plan = case()
    log = make_log(scene, plan)
    aside = log.reference.copy()
    aside[:, :, 0] += 0.3
    aside[:, :, 1] -= 0.4
    assert replace(log, reference=aside).tracking_error_m() == pytest.approx(0.5)
