"""The plot of a fit: in every format, the same file for the same fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrmg import shipped
from mrmg.scene.loading.models import load_model
from mrmg.studies.calibration.calibrate import Calibration, fit_legs
from mrmg.studies.calibration.manoeuvres import Manoeuvre
from mrmg.studies.calibration.measurement import Leg
from mrmg.viz.calibration_plot import draw_calibration


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    rng = np.random.default_rng(3)
    model, _ = load_model(shipped.models_folder() / "car")
    legs = []
    for index in range(20):
        features = rng.uniform(-1.0, 1.0, 4) * [2e3, 1e3, 1.0, 0.3]
        legs.append(
            Leg(
                manoeuvre=Manoeuvre(
                    name=f"m{index}",
                    kind=("straight", "spin")[index % 2],
                    multiplier=1.0,
                    pieces=(),
                ),
                piece="cruise",
                duration_s=1.0,
                power_W=float(features @ [0.06, 0.015, 196.0, 80.0] + rng.normal()),
                features=features,
            )
        )
    return fit_legs(model, legs)


@pytest.mark.parametrize(
    ("suffix", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")]
)
def test_every_format_is_written_and_repeatable(
    calibration: Calibration, tmp_path: Path, suffix: str, start: bytes
) -> None:
    first, second = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
    draw_calibration(calibration, first)
    draw_calibration(calibration, second)
    assert first.read_bytes().startswith(start)
    assert first.read_bytes() == second.read_bytes()


def test_parameters_and_kinds_are_named(
    calibration: Calibration, tmp_path: Path
) -> None:
    draw_calibration(calibration, tmp_path / "fit.svg")
    text = (tmp_path / "fit.svg").read_text()
    for name, item in calibration.estimates.items():
        assert f"{name.split('_')[0]}" in text
        assert item.rounded() in text
    assert "straight" in text
    assert "spin" in text
    assert "cycle" not in text
    assert f"{calibration.fit.residual_rms:.3g} W" in text
