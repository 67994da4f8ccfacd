"""The report in a real browser: no errors, hover and toggles do what they say."""

from __future__ import annotations

import base64
import itertools
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import ClientConnection, connect

from mrmg.report.timeline import timeline
from mrmg.runs.record import read_record
from mrmg.viz import style

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")

ANSWER_S = 60.0


class Tab:
    """One page of a browser, steered over the DevTools protocol."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._numbers = itertools.count()
        self._session: str | None = None
        self.errors: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = session["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        self._socket.send(json.dumps(message))
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return dict(answer["result"])

    def _next(self) -> dict[str, Any]:
        message = dict(json.loads(self._socket.recv(timeout=ANSWER_S)))
        params = message.get("params", {})
        match message.get("method"):
            case "Runtime.exceptionThrown":
                self.errors.append(json.dumps(params["exceptionDetails"]))
            case "Runtime.consoleAPICalled":
                self.errors.append(json.dumps(params["args"]))
            case "Log.entryAdded":
                self.errors.append(params["entry"]["text"])
        return message

    def open(
        self, page: Path, *, scheme: str = "light", size: tuple[int, int] = (1280, 800)
    ) -> None:
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.call("Emulation.setEmulatedMedia", features=features)
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=size[0],
            height=size[1],
            deviceScaleFactor=1,
            mobile=False,
        )
        self.call("Page.navigate", url=page.as_uri())
        while self._next().get("method") != "Page.loadEventFired":
            pass
        self.errors_after_painting()

    def value(self, expression: str) -> Any:
        answer = self.call(
            "Runtime.evaluate",
            expression=expression,
            returnByValue=True,
            awaitPromise=True,
        )
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def errors_after_painting(self) -> list[str]:
        frame = "new Promise(done => requestAnimationFrame(() => done(1)))"
        self.value(f"{frame}.then(() => {frame})")
        return self.errors

    def point_at(self, selector: str, share: float = 0.5) -> None:
        """Move the mouse over an element, at a share of its width."""
        place = self.value(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)});"
            "e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect();"
            f"return [b.left + {share} * b.width, b.top + b.height / 2]; }})()"
        )
        for back in (3.0, 0.0):
            self.call(
                "Input.dispatchMouseEvent",
                type="mouseMoved",
                x=place[0] - back,
                y=place[1],
            )
        self.errors_after_painting()

    def click(self, selector: str) -> None:
        self.value(f"document.querySelector({json.dumps(selector)}).click()")
        self.errors_after_painting()

    def picture(self, path: Path) -> None:
        shot = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot["data"]))


@pytest.fixture(scope="module")
def tab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    home = tmp_path_factory.mktemp("browser")
    assert CHROMIUM is not None
    arguments = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run"]
    arguments += ["--remote-debugging-port=0", f"--user-data-dir={home}"]
    browser = subprocess.Popen(
        [CHROMIUM, *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "HOME": str(home)},
    )
    try:
        assert browser.stderr is not None
        address = next(
            line.split()[-1]
            for line in browser.stderr
            if line.startswith("DevTools listening")
        )
        with connect(address, max_size=None, proxy=None) as socket:
            yield Tab(socket)
    finally:
        browser.terminate()
        browser.wait()


@pytest.fixture
def report(tab: Tab, quickstart_run: Path) -> Tab:
    """The quickstart's report, opened anew."""
    tab.errors.clear()
    tab.open(quickstart_run / "report.html")
    return tab


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_draws_without_errors_and_follows_the_reader(
    tab: Tab, quickstart_run: Path, scheme: str, tmp_path: Path
) -> None:
    tab.errors.clear()
    tab.open(quickstart_run / "report.html", scheme=scheme)
    assert tab.errors == []
    assert tab.value("document.documentElement.dataset.theme") == scheme
    drawn = tab.value(
        "[...document.querySelectorAll('canvas')].map(c => { const n = new Set();"
        "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        "for (let i = 0; i < d.length; i += 4) n.add(d.slice(i, i + 4).join());"
        "return n.size; })"
    )
    assert len(drawn) == 6  # two batteries, tracking, two distances, cost
    assert min(drawn) > 10  # an empty chart has one colour


def test_nothing_is_wider_than_a_laptop_s_or_a_phone_s_window(
    tab: Tab, quickstart_run: Path
) -> None:
    for width in (1280, 400):
        tab.open(quickstart_run / "report.html", size=(width, 800))
        assert tab.value("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("width", [1280, 500, 400])
def test_names_on_the_timeline_fit_and_lie_above_the_cursor(
    tab: Tab, own_run: Path, width: int
) -> None:
    page = own_run / "report.html"
    # As in a mission whose goals lie close together and have long names.
    text = page.read_text()
    record = read_record(own_run)
    scene, plan, log = record.scene, record.plan, record.log
    assert plan is not None
    names = {goal.id: f"loading{at}" for at, goal in enumerate(scene.goals)}
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(style, "goal_labels", lambda _: names)
        crowded = str(timeline(scene, plan, log))
    start = text.index('<div class="timeline')
    page.write_text(text[:start] + crowded + text[text.index("</section>", start) :])
    tab.open(page, size=(width, 800))
    boxes = tab.value(
        "[...document.querySelectorAll('.timeline .track')].map(t => "
        "[t, ...t.querySelectorAll('s')].map(e => {"
        "const b = e.getBoundingClientRect();"
        "return [b.left, b.top, b.right, b.bottom, e.textContent]; }))"
    )
    assert sum(len(names) for _, *names in boxes) >= 5
    for (left, _, right, _, _), *names in boxes:
        for at, (x0, y0, x1, y1, name) in enumerate(names):
            assert left - 1 <= x0 < x1 <= right + 1, name
            for a0, b0, a1, b1, other in names[:at]:
                meet = min(x1, a1) > max(x0, a0) and min(y1, b1) > max(y0, b0)
                assert not meet, (name, other)
    depth = "Number(getComputedStyle(document.querySelector('{}')).zIndex)"
    cursor = tab.value(depth.format(".timeline .now"))
    assert cursor < tab.value(depth.format(".track s"))
    assert cursor < tab.value(depth.format(".timeline .who"))
    ground = "getComputedStyle(document.querySelector('.track s')).backgroundColor"
    assert (
        tab.value(ground) == "rgb(255, 255, 255)"
    )  # the cursor does not shine through


def test_the_button_changes_the_scheme_and_the_charts_with_it(report: Tab) -> None:
    colors = "getComputedStyle(document.body).backgroundColor"
    picture = "document.querySelector('canvas').toDataURL()"
    before = report.value(colors), report.value(picture)
    report.click("#scheme")
    after = report.value(colors), report.value(picture)
    assert report.value("document.documentElement.dataset.theme") == "dark"
    assert before[0] != after[0]
    assert before[1] != after[1]
    assert report.errors == []


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        (".map [data-target=g1]", "g1: goal; stop 1 of"),
        (".map [data-target=s1]", "s1: recharging station"),
        (".map .obstacle", "obstacle"),
        (".map .robot[data-robot=r2] polygon", "r2: car"),
        (".timeline .act.driving", "drives from 0.0"),
        (".bar i", "rolling"),
    ],
)
def test_things_tell_what_they_are_on_hover(
    report: Tab, selector: str, words: str
) -> None:
    report.point_at(selector)
    assert not report.value("document.querySelector('#tip').hidden")
    assert words in report.value("document.querySelector('#tip').textContent")
    report.point_at("h1", 0.9)
    assert report.value("document.querySelector('#tip').hidden")


def test_pointing_at_a_chart_reads_all_charts_and_moves_the_robots(
    report: Tab, quickstart_run: Path
) -> None:
    clock = "document.querySelector('#clock').textContent"
    body = "document.querySelector('.map .robot .body').getAttribute('transform')"
    assert report.value(clock).startswith("0.0 s, 0 of 4")
    start = report.value(body)
    report.point_at("#chart-tracking .u-over", 0.99)
    assert report.value(clock).endswith("4 of 4 goals")
    assert report.value(body) != start
    charge = report.value(
        "[...document.querySelectorAll('#chart-charge-r1 .u-value')]"
        ".map(e => e.textContent)"
    )
    audit = json.loads((quickstart_run / "audit.json").read_text())
    # The second is the plan's, the third the simulation's charge, near its least.
    assert charge[3].startswith("5.0")
    least = min(item["min_charge_fraction"] for item in audit["robots"])
    assert float(charge[2].split()[0]) >= 100.0 * least - 0.1
    assert report.errors == []


def test_the_slider_moves_the_time(report: Tab) -> None:
    report.value(
        "(() => { const s = document.querySelector('#time'); s.value = s.max;"
        "s.dispatchEvent(new Event('input')); })()"
    )
    assert report.value("document.querySelectorAll('.map .goal.done').length") == 4
    assert report.value("document.querySelector('.now').style.left") == "100%"
    pose = report.value(
        "(() => { const r = JSON.parse(document.querySelector('#data').textContent)"
        ".robots[0]; return [r.x.at(-1), r.y.at(-1), r.turn.at(-1)]; })()"
    )
    body = "document.querySelector('.map .robot .body').getAttribute('transform')"
    x, y, turn = pose
    assert report.value(body) == f"translate({x:g} {y:g}) rotate({turn:g})"


def test_play_runs_to_the_end_and_stops(report: Tab) -> None:
    report.value(
        "(() => { const s = document.querySelector('#time'); s.value = s.max - 3;"
        "s.dispatchEvent(new Event('input')); })()"
    )
    report.click("#play")
    word = "document.querySelector('#play').textContent"
    report.value(
        f"new Promise(done => {{ const look = () => {word} === '▶ Play' ?"
        "done(1) : requestAnimationFrame(look); look(); })"
    )
    at_end = (
        "document.querySelector('#time').value - document.querySelector('#time').max"
    )
    assert report.value(at_end) == 0


def test_toggles_hide_robots_and_layers(report: Tab) -> None:
    path = "getComputedStyle(document.querySelector('.map .path.driven')).display"
    chart = "document.querySelector('#chart-tracking canvas').toDataURL()"
    assert report.value(path) != "none"
    before = report.value(chart)
    report.click("[data-toggle-owner=r1]")
    assert report.value(path) == "none"
    assert report.value(chart) != before
    report.click("[data-toggle-owner=r1]")
    assert report.value(path) != "none"
    assert report.value(chart) == before
    layer = "document.querySelector('.map [data-layer=driven]').style.display"
    report.click("[data-toggle-layer=driven]")
    assert report.value(layer) == "none"
    assert report.errors == []


def test_the_chart_of_costs_has_a_time_of_its_own(report: Tab) -> None:
    clock = "document.querySelector('#clock').textContent"
    before = report.value(clock)
    report.point_at("#chart-cost .u-over", 0.9)
    cost = "document.querySelector('#chart-cost .u-series:nth-child(2) .u-value')"
    assert report.value(f"{cost}.textContent").endswith(" kJ")
    assert report.value(clock) == before
    assert report.errors == []


def test_a_series_can_be_switched_off_by_its_name(report: Tab) -> None:
    chart = "document.querySelector('#chart-charge-r1 canvas').toDataURL()"
    before = report.value(chart)
    report.click("#chart-charge-r1 .u-series:nth-child(2) th")
    assert report.value(chart) != before
    assert report.errors == []


def test_a_comparison_draws_and_its_toggles_work(
    tab: Tab, quickstart_run: Path, own_run: Path, tmp_path: Path
) -> None:
    from mrmg.report.compare import compare_runs
    from mrmg.report.compare_page import write_comparison

    twin = own_run.rename(tmp_path / "r1")  # a run called like a robot
    comparison = compare_runs([quickstart_run, twin])
    write_comparison(comparison, tmp_path / "compare.html")
    tab.errors.clear()
    tab.open(tmp_path / "compare.html", scheme="dark")
    chart = "document.querySelector('#chart-used canvas').toDataURL()"
    path = "getComputedStyle(document.querySelector('.map .path')).display"
    before = tab.value(chart)
    tab.click("[data-toggle-owner='run 0']")
    tab.click("[data-toggle-owner='run 1']")
    assert tab.value(chart) != before
    assert tab.value(path) != "none"
    tab.click("#scheme")
    tab.point_at("#chart-goals .u-over", 0.9)
    assert tab.errors == []


@pytest.mark.slow
def test_an_infeasible_mission_has_a_page_too(
    tab: Tab, walled_scene: Path, tmp_path: Path
) -> None:
    from mrmg.runs import pipeline

    pipeline.run(walled_scene, out=tmp_path / "run", video=None)
    tab.errors.clear()
    tab.open(tmp_path / "run" / "report.html")
    assert tab.errors == []
    assert "Infeasible" in tab.value("document.querySelector('#verdict').textContent")
    tab.point_at(".map .goal")
    assert "g1: goal" in tab.value("document.querySelector('#tip').textContent")
