"""A stopped run leaves no half-written file, and the same command finishes it."""

from __future__ import annotations

import io
import json
import os
import pty
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from PIL import Image

from mrmg import storage
from mrmg.cli.main import main
from mrmg.errors import ExitCode

pytestmark = pytest.mark.slow
DONE_ANYWAY_S = 0.1
"""A process that ends so soon after the signal with exit code 0 had been done."""

PATIENCE_S = 120.0
PROMISED_S = 2.0
"""Time in which Ctrl-C ends every command; judged where interruptions are counted."""
COUNT = int(os.environ.get("MRMG_INTERRUPTIONS", "0"))
"""Moments at which Ctrl-C is tried, one verb after the other; 0 for `QUICK_COUNT`."""
QUICK_COUNT = 3
CI_COUNT = 6
VERBS = {
    "run": "run {scene} --no-video --out {new}",
    "robustness in processes": "robustness {run} --trials 4 --workers 2",
    "render": "render {run} --size 320x240 --speed 4 --gif",
    "scene populate": "scene populate scene1 -o {new}.yaml",
    "plan in threads": "plan quickstart --trees 6 --workers 2 --out {new}",
    "execute apart": "execute {run} --disturb",
    "plan": "plan quickstart --out {new}",
    "verify": "verify {run}",
    "execute": "execute {run} --overwrite",
    "audit": "audit {run}",
    "robustness": "robustness {run} --trials 4",
    "report": "report {run}",
    "compare": "compare {run} {reference} -o {new}.html",
    "figure": "figure {run} -o {new}.pdf",
    "scene check": "scene check quickstart",
    "scene draw": "scene draw quickstart -o {new}.png",
    "scene roadmap": "scene roadmap quickstart -o {new}.graphml",
    "calibrate": "calibrate car -o {new}",
    "campaign": "campaign {campaign} --out {new}",
    "campaign in processes": "campaign {campaign} --workers 2 --out {new}",
    "doctor": "doctor",
}
REFERENCE_RUNS = {"run": 1.0, "robustness in processes": 3.0, "render": 1.0}
"""About how many times the reference run verbs take that are not measured here."""

SHORT_MISSION = """\
format: 1
name: short
bounds: [0, 0, 30, 12]
obstacles:
  - {box: {center: [15, 3], size: [4, 3]}}
goals:
  - {id: g1, circle: {center: [24, 6], radius: 1.5}}
robots:
  - {id: r1, model: car, pose: [5, 6, 0]}
"""


def words_of_run(scene: Path, out: Path) -> list[str]:
    return ["run", str(scene), "--no-video", "--out", str(out)]


def start(scene: Path, out: Path) -> subprocess.Popen[str]:
    return started(words_of_run(scene, out))


def started(words: list[str]) -> subprocess.Popen[str]:
    """Start a command in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "mrmg", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One robot with one goal nearby, so that a run takes few seconds."""
    path = tmp_path_factory.mktemp("scene") / "short.yaml"
    path.write_text(SHORT_MISSION)
    campaign = "scenes: short.yaml\nseeds: 0-5\ndisturbances: [none, default]\n"
    path.with_name("campaign.yaml").write_text(campaign)
    return path


@pytest.fixture(scope="module")
def undisturbed(
    scene: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, float]:
    """The folder of a run that nobody stopped, and how long its own code took [s]."""
    out = tmp_path_factory.mktemp("reference") / "run"
    return out, seconds_to_the_end(words_of_run(scene, out))


@pytest.fixture(scope="module")
def reference(undisturbed: tuple[Path, float]) -> Path:
    """The folder of a run that nobody stopped."""
    return undisturbed[0]


def seconds_to_the_end(words: list[str]) -> float:
    process = watched(words)
    began = time.monotonic()
    _, output = process.communicate()
    assert process.returncode == ExitCode.OK, output
    return time.monotonic() - began


def wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    """Return once `path` exists or the process has ended."""
    until = time.monotonic() + PATIENCE_S
    while not path.exists() and process.poll() is None:
        assert time.monotonic() < until, f"{path.name} never came"
        time.sleep(0.002)


def assert_every_file_is_whole(folder: Path) -> None:
    for path in folder.iterdir() if folder.exists() else []:
        if path.name.startswith(".part-"):
            continue
        if path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".npz":
            assert storage.read_arrays(path)
        elif path.suffix == ".png":
            Image.open(io.BytesIO(path.read_bytes())).load()
        elif path.suffix == ".html":
            assert path.read_text().rstrip().endswith("</html>")


def assert_finishes_like(scene: Path, out: Path, reference: Path) -> None:
    """Take a stopped run up again, in this process."""
    assert main(words_of_run(scene, out)) == ExitCode.OK
    assert_every_file_is_whole(out)
    names = {path.name for path in reference.iterdir()}
    assert {path.name for path in out.iterdir()} == names
    for name in ("plan.json", "plan.npz", "log.json", "log.npz", "audit.json"):
        assert (out / name).read_bytes() == (reference / name).read_bytes(), name


@pytest.mark.parametrize(
    "appearing",
    [
        "plan.npz",
        "log.npz",
        pytest.param("planning.json", marks=pytest.mark.ci),
        pytest.param("audit.json", marks=pytest.mark.ci),
    ],
)
def test_killed_when_a_file_appears(
    appearing: str, tmp_path: Path, scene: Path, reference: Path
) -> None:
    out = tmp_path / "run"
    process = start(scene, out)
    wait_for(out / appearing, process)
    process.kill()
    process.communicate()
    assert_every_file_is_whole(out)
    assert_finishes_like(scene, out, reference)


def test_killed_again_and_again_at_random_moments(
    tmp_path: Path, scene: Path, undisturbed: tuple[Path, float]
) -> None:
    out = tmp_path / "run"
    reference, whole_s = undisturbed
    moments = random.Random(7)
    for _ in range(4):
        process = watched(words_of_run(scene, out))
        time.sleep(moments.uniform(0.0, 0.9) * whole_s)
        process.kill()
        process.communicate()
        assert_every_file_is_whole(out)
    assert out.exists()
    assert_finishes_like(scene, out, reference)


def test_ctrl_c_ends_in_one_line(tmp_path: Path, scene: Path, reference: Path) -> None:
    out = tmp_path / "run"
    process = start(scene, out)
    wait_for(out / "planning.json", process)
    process.send_signal(signal.SIGINT)
    _, output = process.communicate()
    assert process.returncode == 130
    assert output == "mrmg: stopped; the same command takes it up again\n"
    assert_finishes_like(scene, out, reference)


def watched(words: list[str]) -> subprocess.Popen[str]:
    """Start a command, and return once its own code takes care of Ctrl-C.

    Until then Python's start ends by the signal itself, which shells show as 130, too.
    """
    process = started(words)
    threads = Path(f"/proc/{process.pid}/task")
    until = time.monotonic() + PATIENCE_S
    while process.poll() is None and len(list(threads.iterdir())) < 2:
        assert time.monotonic() < until
        time.sleep(0.001)
    return process


@pytest.fixture(scope="module")
def duration_s(
    words_of: Callable[[str, Path], list[str]],
    undisturbed: tuple[Path, float],
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[str], float]:
    """How long each verb's own code takes here when nobody stops it."""

    @cache
    def measured(verb: str) -> float:
        if verb in REFERENCE_RUNS and not COUNT:
            return REFERENCE_RUNS[verb] * undisturbed[1]
        return seconds_to_the_end(words_of(verb, tmp_path_factory.mktemp("measured")))

    return measured


@pytest.fixture(scope="module")
def words_of(scene: Path, reference: Path) -> Callable[[str, Path], list[str]]:
    """The words of a verb that works on a copy of the reference in a folder."""

    def words(verb: str, folder: Path) -> list[str]:
        run = folder / "run"
        if not run.exists():
            shutil.copytree(reference, run)
        places = {"scene": scene, "reference": reference, "new": folder / "new"}
        places["campaign"] = scene.with_name("campaign.yaml")
        return VERBS[verb].format(run=run, **places).split()

    return words


def left_in_group(group: int) -> list[str]:
    """Return the living processes of a process group."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name, _, rest = (folder / "stat").read_text().rpartition(")")
        except OSError:
            continue
        state, _, its_group = rest.split()[:3]
        if int(its_group) == group and state != "Z":
            found.append(name)
    return found


@pytest.mark.parametrize(
    "number",
    [
        *range(COUNT or QUICK_COUNT),
        *(
            pytest.param(number, marks=pytest.mark.ci)
            for number in range(COUNT or QUICK_COUNT, CI_COUNT)
        ),
    ],
)
def test_ctrl_c_ends_every_verb_at_any_moment(
    number: int,
    words_of: Callable[[str, Path], list[str]],
    duration_s: Callable[[str], float],
    tmp_path: Path,
) -> None:
    verb = list(VERBS)[number % len(VERBS)]
    moments = random.Random(number)
    for attempt in range(5):  # until it was stopped before it was done
        folder = tmp_path / str(attempt)
        folder.mkdir()
        process = watched(words_of(verb, folder))
        time.sleep(moments.uniform(0.0, 0.9 * duration_s(verb) / (attempt + 1)))
        began = time.monotonic()
        # A terminal sends the signal to all of the group, others to the first process.
        with suppress(ProcessLookupError):
            if moments.random() < 0.5:
                os.killpg(process.pid, signal.SIGINT)
            else:
                process.send_signal(signal.SIGINT)
        _, output = process.communicate(timeout=PATIENCE_S)
        took_s = time.monotonic() - began
        if process.returncode != 0 or took_s > DONE_ANYWAY_S:
            break
    assert process.returncode == 130, output
    assert output.endswith("mrmg: stopped; the same command takes it up again\n")
    assert left_in_group(process.pid) == []
    assert [path.name for path in tmp_path.rglob(".part-*")] == []
    for made in (folder / "run", folder / "new"):
        if made.is_dir():
            assert_every_file_is_whole(made)
    if COUNT:
        assert took_s < PROMISED_S


def test_an_interrupt_that_is_dropped_ends_the_process() -> None:
    code = (
        "import ctypes, time\n"
        "from mrmg import interruption\n"
        "interruption.install()\n"
        "while True:\n"
        "    try:\n"
        "        print('ready', flush=True)\n"
        "        time.sleep(60)\n"
        "    except BaseException:\n"
        "        pass\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130


def test_a_child_that_the_first_look_misses_is_ended_too() -> None:
    code = (
        "import subprocess\n"
        "from mrmg import interruption\n"
        "child = subprocess.Popen(['sleep', '60'])\n"
        "print(child.pid, flush=True)\n"
        "looks = iter([[], [child.pid], []])\n"
        "interruption._children = lambda process: next(looks)\n"
        "interruption.end()\n"
    )
    ended = _run(code)
    assert ended.returncode == 130
    assert not Path(f"/proc/{int(ended.stdout)}").exists()


def test_an_interrupt_that_compiled_code_prints_ends_the_process() -> None:
    code = (
        "import sys\n"
        "from mrmg import interruption\n"
        "interruption.install()\n"
        "try:\n"
        "    raise KeyboardInterrupt\n"
        "except KeyboardInterrupt:\n"
        "    sys.excepthook(*sys.exc_info())  # as PyErr_Print does, which returns\n"
        "print('went on')\n"
    )
    ended = _run(code)
    assert (ended.returncode, ended.stdout) == (130, "")
    assert ended.stderr == "mrmg: stopped; the same command takes it up again\n"


def test_what_misses_a_child_that_was_ended_says_nothing() -> None:
    """As the tracker of locks that a pool starts anew, and that knows none of them."""
    code = (
        "import subprocess, threading, time\n"
        "from mrmg import interruption\n"
        "child = subprocess.Popen(['sleep', '60'])\n"
        "def miss():\n"
        "    child.wait()\n"
        "    subprocess.run('echo one is missing >&2', shell=True)\n"
        "threading.Thread(target=miss, daemon=True).start()\n"
        "with interruption.cleaned_up_by(lambda: time.sleep(0.5)):\n"
        "    interruption.end()\n"
    )
    ended = _run(code)
    assert ended.returncode == 130
    assert ended.stderr == "mrmg: stopped; the same command takes it up again\n"


def _run(code: str) -> subprocess.CompletedProcess[str]:
    """Run Python code in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )


def _read_to_the_end(screen: int) -> None:
    with suppress(OSError):  # once nobody writes to it
        while os.read(screen, 1000):
            pass


def test_ctrl_c_while_improving_keeps_the_best_plan(tmp_path: Path) -> None:
    out = tmp_path / "run"
    words = ["plan", "quickstart", "--budget", "600", "--out", str(out)]
    screen, terminal = pty.openpty()  # on which each better plan is shown
    process = subprocess.Popen(
        [sys.executable, "-m", "mrmg", *words], stdout=subprocess.PIPE, stderr=terminal
    )
    os.close(terminal)
    shown = b""
    while b"cost" not in shown:
        shown += os.read(screen, 1000)
    process.send_signal(signal.SIGINT)
    reader = threading.Thread(target=_read_to_the_end, args=(screen,), daemon=True)
    reader.start()  # a full screen would hold the process up
    output, _ = process.communicate(timeout=PATIENCE_S)
    reader.join(PATIENCE_S)
    os.close(screen)
    assert process.returncode == ExitCode.OK
    assert b"solved" in output
    assert (out / "plan.npz").exists()
    assert_every_file_is_whole(out)
