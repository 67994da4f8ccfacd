"""Fitting logs of real robots: known laws, files that are not logs, and the verb."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from mrmg.cli.main import main
from mrmg.errors import ExitCode, FileError, UsageError
from mrmg.scene.loading import load_scene, scene_from_document
from mrmg.scene.loading.models import load_model
from mrmg.scene.loading.yaml_text import read_yaml
from mrmg.scene.robot_model import RobotModel
from mrmg.shipped import models_folder
from mrmg.simulation.disturbance import FIELD_SPREADS
from mrmg.studies.calibration.log_calibration import calibrate_from_logs
from mrmg.studies.calibration.power_laws import MotorLaw
from mrmg.studies.calibration.robot_logs import LoggedRun, read_run
from mrmg.studies.calibration.terrain_estimates import law_power_W, stationary_power
from mrmg.viz.log_plot import fit_svg

BOREALTC = Path(__file__).resolve().parents[4] / "shared/energy/borealtc"
GROUNDS = ("ICE", "ASPHALT", "FLOORING", "SANDY_LOAM", "SNOW")

TRUTH = {"firm": (3.0, 8.0), "soft": (6.0, 3.0)}
"""Currents of rolling and scrub [A] by terrain."""


@pytest.fixture(scope="module")
def husky() -> RobotModel:
    return load_model(models_folder() / "husky")[0]


def law_of(model: RobotModel) -> MotorLaw:
    assert model.motor is not None
    return MotorLaw(
        volts_per_m_s=model.motor.volts_per_m_s(model.wheel_radius_m),
        resistance_Ohm=model.motor.resistance_Ohm,
        track_m=1.1,
        stationary_W=12.0,
    )


def made_run(
    model: RobotModel, terrain: str, number: int, *, factor: float = 1.0
) -> LoggedRun:
    """A run of a law that is known, with noise, ending with five seconds at rest."""
    rng = np.random.default_rng([number, len(terrain)])
    time_s = np.arange(0.0, 40.0, 0.2)
    speed, yaw_rate = (
        np.repeat(rng.uniform(low, high, 10), 20)
        for low, high in ((-0.6, 0.8), (-0.3, 0.3))
    )
    if number % 3 == 0:
        speed[:] = 0.0
    if number % 3 == 1:
        yaw_rate[:] = 0.0
    speed[-25:] = yaw_rate[-25:] = 0.0
    run = LoggedRun(
        file=f"{terrain}{number}",
        terrain=terrain,
        time_s=time_s,
        speed_m_s=speed,
        yaw_rate_rad_s=yaw_rate,
        power_W=np.zeros_like(time_s),
    )
    law = law_of(model)
    features = law.features(speed, yaw_rate)
    power_W = features @ law.coefficients(np.array(TRUTH[terrain]))
    noise = 1.0 + 0.1 * rng.standard_normal(len(power_W)) * (speed != 0.0)
    return replace(run, power_W=power_W * np.where(run.at_rest, 1.0, factor * noise))


def made_runs(model: RobotModel) -> list[LoggedRun]:
    return [made_run(model, name, number) for name in TRUTH for number in range(9)]


def test_a_known_law_is_found_and_predicts_runs_with_their_intervals(
    husky: RobotModel,
) -> None:
    found = calibrate_from_logs(husky, made_runs(husky))
    assert found.fits[0].law.name == "motor"
    law = law_of(husky)
    for item in found.terrains:
        truth = np.array(TRUTH[item.name])
        np.testing.assert_allclose(
            found.fits[0].parameters[item.name], truth, rtol=0.03
        )
        cruise_W = law_power_W(law, truth, 0.8, 0.0) - 12.0
        assert item.rolling_W_s_m.value == pytest.approx(cruise_W / 0.8, rel=0.03)
        spin_W = law_power_W(law, truth, 0.0, 0.36) - 12.0
        assert item.turning_W_s_rad.value == pytest.approx(spin_W / 0.36, rel=0.03)
    assert found.stationary_W.value == pytest.approx(12.0)
    assert max(abs(run.error_pct) for run in found.runs) < 10.0
    assert np.mean([run.holds for run in found.runs]) > 0.7


@pytest.mark.parametrize("number", [2, 3, 5, 12])
def test_stationary_power_lies_within_its_interval(
    husky: RobotModel, number: int
) -> None:
    """Of 95 % intervals at least nine in ten have to hold the truth."""
    levels = np.random.default_rng(number).normal(12.0, 1.0, (200, number))
    bare = made_run(husky, "firm", 1)
    held = 0
    for row in levels:
        runs = [replace(bare, power_W=np.full_like(bare.power_W, one)) for one in row]
        low, high = stationary_power(husky, runs).interval
        held += low <= 12.0 <= high
    assert held >= 180


def test_one_run_at_rest_tells_the_power_but_not_how_sure_it_is(
    husky: RobotModel,
) -> None:
    runs = [made_run(husky, "firm", number) for number in (2, 5, 8)]
    rows = ("time_s", "speed_m_s", "yaw_rate_rad_s", "power_W")
    runs[1:] = [
        replace(run, **{name: getattr(run, name)[:-25] for name in rows})
        for run in runs[1:]
    ]
    found = calibrate_from_logs(husky, runs)
    assert found.stationary_W.value == pytest.approx(12.0)
    stated = found.stationary_W.to_json()
    assert (stated["low"], stated["high"]) == (None, None)
    change = found.changes()["idle_power",]
    assert float(change.text) == pytest.approx(12.0)
    assert "+-" not in change.detail
    assert found.fits[0].law.stationary_W == pytest.approx(12.0)


def test_residuals_stand_at_the_speed_they_are_of(
    husky: RobotModel, drawn: list[Figure]
) -> None:
    """A part of each log has more rows for the time."""
    runs = []
    for number in range(2):
        speed = np.repeat([0.2, 0.8, 0.4], 200) + 0.01 * number
        run = replace(
            made_run(husky, "firm", 0),
            file=f"firm{number}",
            time_s=np.cumsum(np.repeat([0.2, 0.05, 0.2], 200)),
            speed_m_s=speed,
            yaw_rate_rad_s=0.5 * speed,
            power_W=100.0 * speed,
        )
        runs.append(run)
    fit_svg(calibrate_from_logs(husky, runs))
    power, by_speed, by_yaw_rate = drawn[0].axes
    for one, other, third in zip(
        power.lines[:2], by_speed.lines[:2], by_yaw_rate.lines[:2], strict=True
    ):
        power_W = np.asarray(one.get_ydata())
        assert 100.0 * np.asarray(other.get_xdata()) == pytest.approx(power_W)
        assert 200.0 * np.asarray(third.get_xdata()) == pytest.approx(power_W)


def test_one_wrong_run_does_not_spoil_the_fit(husky: RobotModel) -> None:
    runs = made_runs(husky)
    runs[2] = made_run(husky, "firm", 2, factor=3.0)
    found = calibrate_from_logs(husky, runs)
    np.testing.assert_allclose(
        found.fits[0].parameters["firm"], TRUTH["firm"], rtol=0.08
    )


def test_test_runs_are_predicted_and_never_fitted(husky: RobotModel) -> None:
    runs = made_runs(husky)
    alone = calibrate_from_logs(husky, runs[:-1])
    for factor in (1.0, 4.0):
        test = replace(runs[-1], power_W=factor * runs[-1].power_W)
        both = calibrate_from_logs(husky, runs[:-1], [test])
        assert both.terrains == alone.terrains
        assert both.runs[:-1] == alone.runs
        last = both.runs[-1]
        assert not last.fitted
        assert last.predicted_J == pytest.approx(runs[-1].energy_J, rel=0.1)
        assert last.run.energy_J == pytest.approx(factor * runs[-1].energy_J)


def test_what_runs_do_not_show_is_not_determined(husky: RobotModel) -> None:
    """Straight runs tell nothing of turning: robot.yaml keeps what it says."""
    runs = [made_run(husky, "firm", number) for number in (1, 4, 7)]
    found = calibrate_from_logs(husky, runs)
    assert np.isnan(found.terrains[0].turning_W_s_rad.half_width)
    assert set(found.changes()) == {("rolling_coefficient",), ("idle_power",)}
    with pytest.raises(UsageError, match="at least two"):
        calibrate_from_logs(husky, runs[:1])


# --- files --------------------------------------------------------------------------


def write_csv(path: Path, **columns: Any) -> str:
    rows = np.stack([np.asarray(column) for column in columns.values()], axis=1)
    lines = [",".join(columns), *(",".join(map(str, row)) for row in rows.tolist())]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def test_power_is_the_same_by_all_columns(husky: RobotModel, tmp_path: Path) -> None:
    time = np.arange(20) * 0.25
    left, right = np.full(20, 0.2), np.linspace(0.2, 0.6, 20)
    amperes = np.linspace(2.0, 6.0, 20)
    k = 0.044882 * 78.71 / 0.13
    volts = [k * speed + 0.46 * amperes for speed in (left, right)]
    power = amperes * (volts[0] + volts[1])
    files = [
        {"velL": left, "velR": right, "curL": amperes, "curR": amperes},
        {"Vel_Left [m/s]": left, "vel_right_m_s": right, "Power_W": power},
        {"v": 0.5 * (left + right), "yaw_rate": (right - left) / 1.1, "power": power},
        {
            "v": 0.5 * (left + right),
            "omega": (right - left) / 1.1,
            "curL": amperes,
            "curR": amperes,
            "voltL": volts[0],
            "voltR": volts[1],
            "note": np.zeros(20),
        },
    ]
    runs = [
        read_run(write_csv(tmp_path / f"{n}.csv", time=time, **columns), "x", husky)
        for n, columns in enumerate(files)
    ]
    energy_J = np.trapezoid(power, time)
    for run in runs:
        np.testing.assert_allclose(run.power_W, power, rtol=1e-9)
        np.testing.assert_allclose(run.speed_m_s, 0.5 * (left + right))
        np.testing.assert_allclose(run.yaw_rate_rad_s, (right - left) / 1.1)
        assert run.energy_J == pytest.approx(energy_J)


GOOD = [["time", "v", "yaw_rate", "power"]]
GOOD += [[str(0.1 * n), "0.3", "0.1", "50"] for n in range(20)]


def with_cell(row: int, column: int, text: str) -> list[list[str]]:
    rows = [list(cells) for cells in GOOD]
    rows[row][column] = text
    return rows


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "has 0 rows; at least 10"),
        (GOOD[:6], "has 5 rows; at least 10"),
        (with_cell(0, 0, "clock"), "has no column 'time'"),
        (with_cell(0, 1, "x"), "lack the motion: expected velL and velR"),
        (with_cell(0, 3, "x"), "lack the power: expected power"),
        (with_cell(0, 3, "v"), "speed named by more than one column"),
        (with_cell(7, 3, "fifty"), r"line 8: got 'fifty'; expected a finite"),
        (with_cell(7, 3, "nan"), r"line 8: got 'nan'; expected a finite"),
        (with_cell(5, 0, "0.2"), r"line 6: must increase"),
        ([*GOOD[:5], [], *with_cell(5, 0, "0.2")[5:]], r"line 7: must increase"),
        ([*GOOD[:5], [], *with_cell(7, 3, "x")[5:]], r"line 9: got 'x'"),
        (with_cell(7, 0, "0.50000001"), r"line 8: must increase, by 1e-06 s at least"),
        (with_cell(0, 1, "v [knots]"), r"'v \[knots\]': .*allowed: m/s, km/h"),
        (with_cell(0, 2, "yaw_rate (rpm)"), r"rpm\)': .*allowed: rad/s, deg/s"),
        (with_cell(0, 3, "power [MW]"), r"allowed: W, kW"),
        (with_cell(0, 1, "v [m/s^2]"), r"allowed: m/s"),
        (with_cell(7, 3, "5e201"), r"column 4, line 8: got '5e201'; .* at most 1e\+10"),
        (with_cell(7, 0, "1e300"), r"column 1, line 8: got '1e300'; .* at most 1e\+10"),
        ([GOOD[0], *([*row[:3], "0"] for row in GOOD[1:])], "takes 0 J in all"),
    ],
)
def test_a_file_that_is_no_log_is_refused_with_one_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], rows: Any, message: str
) -> None:
    log, out = tmp_path / "log.csv", tmp_path / "out"
    log.write_text("\n".join(",".join(row) for row in rows))
    arguments = ["calibrate", "husky", "--log", str(log), "--terrain", "x"]
    assert main([*arguments, "-o", str(out)]) == ExitCode.INVALID_FILE
    said = capsys.readouterr().err
    assert "Traceback" not in said
    assert str(log) in said
    with pytest.raises(FileError, match=message):
        read_run(str(log), "x", load_model(models_folder() / "husky")[0])
    assert not out.exists()


@pytest.mark.parametrize(
    "names",
    [
        ["time [ms]", "v [km/h]", "yaw_rate [deg/s]", "power [kW]"],
        ["time_ms", "speed_kmh", "yaw_rate_deg_s", "P_kW"],
        ["t (ms)", "V (km/h)", "omega (°/s)", "power_kw"],
        ["timestamp_ms", "vel_kph", "w [deg s^-1]", "Power [kw]"],
    ],
)
def test_units_in_names_are_converted(
    names: list[str], husky: RobotModel, tmp_path: Path
) -> None:
    time, speed = np.arange(20) * 0.25, np.linspace(0.2, 0.6, 20)
    yaw_rate, power = np.linspace(0.1, 0.3, 20), np.linspace(20.0, 80.0, 20)
    others = [1e3 * time, 3.6 * speed, np.degrees(yaw_rate), power / 1e3]
    columns = dict(zip(names, others, strict=True))
    run = read_run(write_csv(tmp_path / "a.csv", **columns), "x", husky)
    np.testing.assert_allclose(run.time_s, time)
    np.testing.assert_allclose(run.speed_m_s, speed)
    np.testing.assert_allclose(run.yaw_rate_rad_s, yaw_rate)
    np.testing.assert_allclose(run.power_W, power)
    columns = {names[0]: 1e3 * time, "v_mm_s": 1e3 * speed, "omega": yaw_rate}
    columns |= {"I [mA]": 1e3 * power, "voltage_mV": np.full(20, 24e3)}
    run = read_run(write_csv(tmp_path / "b.csv", **columns), "x", husky)
    np.testing.assert_allclose(run.speed_m_s, speed)
    np.testing.assert_allclose(run.power_W, 24.0 * power)


@pytest.mark.parametrize("separator", [";", "\t"])
def test_logs_with_other_separators(
    separator: str, husky: RobotModel, tmp_path: Path
) -> None:
    log = tmp_path / "log.csv"
    log.write_text("\n".join(separator.join(row) for row in GOOD))
    run = read_run(str(log), "x", husky)
    assert run.energy_J == pytest.approx(1.9 * 50.0)
    log.write_text(log.read_text().replace(".", ","))
    with pytest.raises(FileError, match="got '0,0'; expected .*such as 0.25"):
        read_run(str(log), "x", husky)


def test_gaps_count_as_no_driving(
    husky: RobotModel, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ten hours without a row are neither energy nor distance, and noted."""
    files = []
    for number in range(2):
        run = made_run(husky, "firm", number)
        late = run.time_s + np.where(run.time_s >= 20.0, 36_000.0, 0.0)
        assert replace(run, time_s=late).energy_J == pytest.approx(run.energy_J)
        columns = {"time": late, "v": run.speed_m_s, "yaw_rate": run.yaw_rate_rad_s}
        path = tmp_path / f"{number}.csv"
        files.append(write_csv(path, power=run.power_W, **columns))
    arguments = ["calibrate", "husky", "-o", str(tmp_path / "out")]
    assert main([*arguments, "--log", *files, "--terrain", "firm"]) == ExitCode.OK
    note = f"{files[0]}: 1 gap of 36000 s in all left out, as the log has a row every"
    assert note in " ".join(capsys.readouterr().out.split())
    assert note in (tmp_path / "out" / "calibration.html").read_text()
    steps = replace(run, time_s=run.time_s + (run.time_s >= 20.0) * 1.5)
    assert not steps.notes  # a second or two is no gap


def test_currents_need_motor_constants(tmp_path: Path) -> None:
    columns = dict.fromkeys(("velL", "velR", "curL", "curR"), np.full(20, 0.5))
    file = write_csv(tmp_path / "a.csv", time=np.arange(20), **columns)
    with pytest.raises(FileError, match=r"a block 'motor' in the robot.yaml of 'car'"):
        read_run(file, "x", load_model(models_folder() / "car")[0])


# --- the verb -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def files(
    husky: RobotModel, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], list[str]]:
    folder = tmp_path_factory.mktemp("logs")
    for run in made_runs(husky):
        (folder / run.terrain).mkdir(exist_ok=True)
        write_csv(
            folder / run.terrain / f"{run.file}.csv",
            time=run.time_s,
            v=run.speed_m_s,
            yaw_rate=run.yaw_rate_rad_s,
            power=run.power_W,
        )
    return lambda terrain: sorted(map(str, (folder / terrain).glob("*.csv")))


def test_the_verb_leaves_a_robot_terrain_and_a_page(
    files: Callable[[str], list[str]],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Test files are of the terrain that their folder's logs have."""
    out = tmp_path / "out"
    firm, soft = files("firm"), files("soft")
    tests = [firm[0], soft[1]]
    arguments = ["calibrate", "husky", "--json", "-o", str(out)]
    arguments += ["--log", *firm[1:], "--terrain", "firm"]
    arguments += ["--log", soft[0], *soft[2:], "--terrain", "soft", "--test", *tests]
    assert main(arguments) == ExitCode.OK
    result = json.loads(capsys.readouterr().out)
    assert json.loads((out / "calibration.json").read_text()) == result
    assert [set(run) for run in result["runs"]] == [
        {"file", "terrain", "energy_J", "predicted_J", "error_pct", "interval_J"}
    ] * 18
    assert result["tested"] == tests
    assert [run["terrain"] for run in result["runs"][-2:]] == ["firm", "soft"]
    for run in result["runs"]:
        off = run["predicted_J"] / run["energy_J"] - 1.0
        assert run["error_pct"] == pytest.approx(100.0 * off)
        assert run["interval_J"][0] < run["predicted_J"] < run["interval_J"][1]
    assert len(result["laws"]) == 4
    model = load_model(out)[0]
    cruise_W = model.energy_model.plain_ground_J_per_m() * 0.8
    truth_W = law_power_W(law_of(model), np.array(TRUTH["firm"]), 0.8, 0.0) - 12.0
    assert cruise_W == pytest.approx(truth_W, rel=0.03)
    assert model.idle_power_W == pytest.approx(12.0)
    assert "fitted to logs: 16 runs, on firm" in (out / "robot.yaml").read_text()
    page = (out / "calibration.html").read_text()
    assert page.count("data:image/svg+xml") == 2
    entries = read_yaml(out / "terrain.yaml", source="terrain")["terrain"]
    shape = {"polygon": [[1, 1], [9, 1], [9, 9]]}
    scene = scene_from_document(
        {
            "format": 1,
            "name": "made",
            "bounds": [0, 0, 20, 20],
            "terrain": [{**entry, **shape} for entry in entries],
            "goals": [{"id": "g", "circle": {"center": [15, 15], "radius": 1}}],
            "battery": {"capacity_m": 90},
            "robots": [{"id": "r1", "model": "husky", "pose": [12, 5, 0]}],
        },
        source="made",
    )
    assert [area.id for area in scene.terrain] == ["firm", "soft"]
    assert scene.terrain[1].turning_multiplier < 1.0 < scene.terrain[1].multiplier


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--terrain", "x"], "name the files with --log"),
        (["--log", "a.csv"], "on what terrain"),
        (["--test", "a.csv", "--terrain", "x"], "name logs to fit"),
        (["--log", "a.csv", "--terrain", "wet sand"], "'wet sand' cannot name a terr"),
        (["--log", "a.csv", "a.csv", "--terrain", "x"], "named twice"),
        (
            ["--log", "a/a.csv", "--terrain", "x", "--log", "b/b.csv", "--terrain", "y"]
            + ["--test", "c/c.csv"],
            "--test c/c.csv: on what terrain",
        ),
        (
            ["--log", "a.csv", "--terrain", "x", "--plot", "p.png"],
            "--plot is of MuJoCo",
        ),
    ],
)
def test_options_that_do_not_fit_are_refused(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code = main(["calibrate", "husky", *arguments])
    except SystemExit as ended:
        code = ended.code
    assert code == ExitCode.USAGE
    assert message in " ".join(capsys.readouterr().err.split())


# --- logs of a real robot -----------------------------------------------------------


@pytest.mark.skipif(not BOREALTC.is_dir(), reason="no logs beside the project")
def test_runs_of_a_husky_are_predicted_by_the_others(husky: RobotModel) -> None:
    runs = [
        read_run(str(file), name.lower(), husky)
        for name in GROUNDS
        for file in sorted((BOREALTC / name).glob("*.csv"))
    ]
    assert len(runs) == 37
    found = calibrate_from_logs(husky, runs)
    best = found.laws_json()[0]
    assert best["name"] == "motor"
    assert len(found.fits) >= 3
    assert best["median_error_pct"] <= 10.0
    assert max(item["median_error_pct"] for item in best["terrains"].values()) <= 15.0
    assert best["intervals_hold_pct"] >= 80.0
    assert best["interval_width_pct"] <= 65.0
    # What ships was fitted to these logs.
    shipped = found.changes()
    assert float(shipped["rolling_coefficient",].text) == husky.rolling_coefficient
    assert float(shipped["turning_coefficient",].text) == husky.turning_coefficient
    areas = {area.id: area for area in load_scene("boreal").terrain}
    for item in found.terrains:
        entry, area = item.entry(), areas[item.name]
        assert entry["multiplier"] == area.multiplier
        assert entry["turning_multiplier"] == area.turning_multiplier
        assert entry["energy_spread"] == area.energy_spread == FIELD_SPREADS[item.name]
