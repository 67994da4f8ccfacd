"""The verb that measures what the energy model of a robot should say."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from mrmg.cli import terminal
from mrmg.cli.run_options import given
from mrmg.errors import ExitCode, UsageError

if TYPE_CHECKING:
    from mrmg.studies.calibration import Calibration


def calibrate(options: argparse.Namespace) -> int:
    """Calibrate a robot model, and leave a calibrated copy with the plot of the fit."""
    from mrmg.runs.replacing import require_absent
    from mrmg.scene.loading.models import load_model
    from mrmg.studies.calibration import (
        calibrate,
        require_other_folder,
        write_calibration,
    )
    from mrmg.viz.calibration_plot import draw_calibration
    from mrmg.viz.print_style import require_format

    folder = folder_of_model(options.model)
    out = options.out or Path(f"calibrated-{folder.name}")
    plot = options.plot or out / "calibration.png"
    require_format(plot)
    require_other_folder(folder, out)
    require_absent(out, overwrite=options.overwrite)
    model, _ = load_model(folder, trust_code=options.trust_code)
    with terminal.progress_of("measuring") as on_progress:
        calibration = calibrate(model, on_progress=on_progress, **given(options))
    write_calibration(calibration, folder, out, in_place=options.in_place)
    draw_calibration(calibration, plot)
    if options.json:
        terminal.print_json(calibration.to_json())
    else:
        print("\n".join([*_lines(calibration), f"  {out / 'robot.yaml'}", f"  {plot}"]))
    return ExitCode.OK


def folder_of_model(reference: str) -> Path:
    """Return the folder that a MODEL of the command line names."""
    from mrmg.scene.loading.models import model_folder

    # A folder in the working directory needs no slash here, as it does in a scene.
    here = Path(reference)
    found = model_folder(reference, None)
    if isinstance(found, str) and (here / "robot.yaml").is_file():
        return here.resolve()
    if isinstance(found, str):
        raise UsageError(f"MODEL: {found}")
    return found


def _lines(calibration: Calibration) -> list[str]:
    lines = [f"{calibration.model.name}: {len(calibration.legs)} legs driven"]
    for name, item in calibration.estimates.items():
        low, high = item.interval
        was = "not in the model" if item.was is None else f"model: {item.was:.6g}"
        lines.append(
            f"  {name:<20} {item.rounded():>10}  "
            f"95 % in {low:.6g} .. {high:.6g}  ({was})"
        )
    lines.append(f"  residuals: {calibration.fit.residual_rms:.3g} W rms")
    return lines
