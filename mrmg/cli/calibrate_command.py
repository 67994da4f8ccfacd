"""The verb that measures what the energy model of a robot should say."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrmg.cli import log_options, terminal
from mrmg.cli.run_options import add_options, given
from mrmg.counted import counted
from mrmg.errors import UsageError

if TYPE_CHECKING:
    from mrmg.scene.robot_model import RobotModel
    from mrmg.studies.calibration.calibrate import Calibration
    from mrmg.studies.calibration.log_calibration import LogCalibration


_DESCRIPTION = """\
Drive manoeuvres with a robot in MuJoCo, fit its rolling and turning coefficients and
its inertia to the work of the drives, and leave a calibrated copy of the model with the
figures and a plot of the fit. With --log, fit logs of the real robot instead:
stationary power, rolling, turning and inertia by terrain, with intervals."""


def add_calibrate(verbs: Any) -> None:
    """Add the verb."""
    verb = verbs.add_parser(
        "calibrate",
        help="measure a robot's energy parameters in MuJoCo, or fit them to logs",
        description=_DESCRIPTION,
        epilog=log_options.EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        command=calibrate,
    )
    log_options.add_logs(verb)
    verb.add_argument(
        "model", metavar="MODEL", help="name of a shipped model, or a model's folder"
    )
    verb.add_out("DIR", "default calibrated-MODEL")
    verb.add_overwrite("the folder's content")
    plot = "PNG, SVG or PDF by its suffix; default calibration.png in DIR"
    verb.add_argument("--plot", type=Path, metavar="PICTURE.png", help=plot)
    verb.add_flag("--in-place", "change the model's own robot.yaml, too")
    add_options(verb, "calibrate")
    verb.add_trust()
    verb.add_json("calibration.json alone")


def calibrate(options: argparse.Namespace) -> None:
    """Calibrate a robot model, and leave a calibrated copy with the plot of the fit."""
    if options.groups:
        _calibrate_from_logs(options)
        return
    from mrmg.studies.calibration.calibrate import calibrate
    from mrmg.studies.calibration.files import write_calibration
    from mrmg.viz.calibration_plot import draw_calibration
    from mrmg.viz.figures import require_format

    model, folder, out = _model_and_places(options)
    plot = options.plot or out / "calibration.png"
    require_format(plot)
    with terminal.progress_of("measuring") as on_progress:
        calibration = calibrate(model, on_progress=on_progress, **given(options))
    with writing_to(out, overwrite=options.overwrite):
        write_calibration(calibration, folder, out, in_place=options.in_place)
        draw_calibration(calibration, plot)
    lines = [*_lines(calibration), f"  {out / 'robot.yaml'}", f"  {plot}"]
    terminal.print_result(options, calibration.to_json(), lines)


def _calibrate_from_logs(options: argparse.Namespace) -> None:
    """Fit a robot model to logs, and leave a calibrated copy with page and terrain."""
    from mrmg.report.log_page import calibration_html
    from mrmg.storage import write_text
    from mrmg.studies.calibration.files import (
        PAGE_FILE,
        TERRAIN_FILE,
        write_calibration,
        write_terrain,
    )
    from mrmg.studies.calibration.log_calibration import calibrate_from_logs
    from mrmg.studies.calibration.robot_logs import read_run

    if options.plot is not None:
        raise UsageError(
            f"--plot is of MuJoCo; with --log the plots are in {PAGE_FILE}"
        )
    logs, tests = log_options.files_by_use(options.groups)
    model, folder, out = _model_and_places(options)
    runs, tested = (
        [read_run(file, terrain, model) for file, terrain in named]
        for named in (logs, tests)
    )
    calibration = calibrate_from_logs(model, runs, tested)
    page = calibration_html(calibration)
    with writing_to(out, overwrite=options.overwrite):
        write_calibration(calibration, folder, out, in_place=options.in_place)
        write_terrain(calibration, out)
        write_text(out / PAGE_FILE, page)
    files = [f"  {out / name}" for name in ("robot.yaml", TERRAIN_FILE, PAGE_FILE)]
    lines = [*_log_lines(calibration), *files]
    terminal.print_result(options, calibration.to_json(), lines)


def _model_and_places(options: argparse.Namespace) -> tuple[RobotModel, Path, Path]:
    """Return the model to calibrate, its folder, and where the copy is to lie.

    Raises:
        UsageError: if there is no such model, or something lies where the copy would.
    """
    from mrmg.runs.replacing import require_absent
    from mrmg.scene.loading.models import load_model
    from mrmg.studies.calibration.files import require_changeable

    folder = folder_of_model(options.model)
    out = options.out or Path(f"calibrated-{folder.name}")
    require_changeable(folder, out, in_place=options.in_place)
    require_absent(out, overwrite=options.overwrite)
    model, _ = load_model(folder, trust_code=options.trust_code)
    return model, folder, out


@contextmanager
def writing_to(folder: Path, *, overwrite: bool) -> Iterator[None]:
    """Create a folder for a calibration, and keep other commands out of it.

    Raises:
        UsageError: if there is something in it and it is not to be replaced.
        RunFolderError: if another process is writing to it.
    """
    from mrmg.runs.folder import exclusive
    from mrmg.runs.replacing import require_absent
    from mrmg.storage import remove_unfinished

    folder.mkdir(parents=True, exist_ok=True)
    with exclusive(folder):
        require_absent(folder, overwrite=overwrite)  # others may have written meanwhile
        remove_unfinished(folder)
        yield


def folder_of_model(reference: str) -> Path:
    """Return the folder that a MODEL of the command line names."""
    from mrmg.scene.loading.models import model_folder

    # A folder in the working directory needs no slash here, as it does in a scene.
    here = Path(reference)
    try:
        return model_folder(reference, None)
    except UsageError as error:
        if (here / "robot.yaml").is_file():
            return here.resolve()
        raise UsageError(f"MODEL: {error}") from error


def _lines(calibration: Calibration) -> list[str]:
    lines = [
        f"{calibration.model.name}: {counted(len(calibration.legs), 'leg')} driven"
    ]
    for name, item in calibration.estimates.items():
        low, high = item.interval
        was = "not in the model" if item.was is None else f"model: {item.was:.6g}"
        lines.append(
            f"  {name:<20} {item.rounded():>10}  "
            f"95 % in {low:.6g} .. {high:.6g}  ({was})"
        )
    lines.append(f"  residuals: {calibration.fit.residual_rms:.3g} W rms")
    return lines


def _log_lines(calibration: LogCalibration) -> list[str]:
    lines = [
        f"{calibration.model.name}: {counted(len(calibration.runs), 'run')}, "
        "laws compared:"
    ]
    lines += [
        f"  {law['name']:<11} median error {law['median_error_pct']:5.1f} %, 90 % "
        f"intervals hold {law['intervals_hold_pct']:3.0f} %, "
        f"{law['interval_width_pct']:.0f} % wide"
        for law in calibration.laws_json()
    ]
    lines += [
        f"  {item.name:<12} {item.rolling_W_s_m.value:7.1f} W s/m, "
        f"{item.turning_W_s_rad.value:7.1f} W s/rad, multiplier {item.multiplier:.2f}, "
        f"turning {item.turning_multiplier:.2f}, spread {item.energy_spread:.0%}"
        for item in calibration.terrains
    ]
    for item in (item for item in calibration.runs if not item.fitted):
        low, high = item.interval_J
        lines.append(
            f"  {item.run.file}: {item.predicted_J:.0f} J ({low:.0f} .. {high:.0f}) "
            f"predicted, {item.run.energy_J:.0f} J measured, {item.error_pct:+.1f} %"
        )
    lines += [f"  note: {note}" for note in calibration.notes]
    return lines
