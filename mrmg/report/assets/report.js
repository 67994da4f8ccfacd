"use strict";
/* One state, the time and what is shown, that map, timeline and charts follow. */
(() => {
  const root = document.documentElement;
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const one = (selector) => document.querySelector(selector);
  const color = (name) => getComputedStyle(root).getPropertyValue(name).trim();
  const source = one("#data");
  const data = source ? JSON.parse(source.textContent) : null;

  /* Scheme: the reader's, until the button changes it. */
  const reader = matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  function applyScheme() {
    const dark = chosen === null ? reader.matches : chosen === "dark";
    root.dataset.theme = dark ? "dark" : "light";
    one("#scheme").textContent = dark ? "☀ Light" : "☾ Dark";
    if (data) drawCharts();
  }
  reader.addEventListener("change", applyScheme);
  one("#scheme").addEventListener("click", () => {
    chosen = root.dataset.theme === "dark" ? "light" : "dark";
    applyScheme();
  });

  /* What things are, on hover and on focus. */
  const tip = one("#tip");
  function tell(element, x, y) {
    tip.hidden = !element;
    if (!element) return;
    tip.textContent = element.dataset.tip;
    const room = document.documentElement.clientWidth - tip.offsetWidth - 8;
    tip.style.left = `${Math.max(4, Math.min(x + 14, room))}px`;
    tip.style.top = `${y + 18}px`;
  }
  document.addEventListener("pointermove", (event) => {
    tell(event.target.closest("[data-tip]"), event.clientX, event.clientY);
  });
  document.addEventListener("focusin", (event) => {
    const element = event.target.closest("[data-tip]");
    if (!element) return;
    const box = element.getBoundingClientRect();
    tell(element, box.left, box.bottom - 18);
  });
  document.addEventListener("focusout", () => tell(null));

  /* Charts. */
  const charts = [];
  const hiddenOwners = new Set();
  const DASHES = [[], [9, 4], [3, 3], [12, 3, 3, 3]];
  const EM = 11;  // of a chart's letters, in pixels
  const number = (name) => Number(color(name));
  const faded = (hex, share) => hex + Math.round(255 * share).toString(16).padStart(2, "0");
  function lineOf(series) {
    const own = color(`--r${series.color}`);
    const looks = {
      planned: { stroke: faded(own, number("--planned-opacity")),
        width: EM * number("--planned-width"), dash: [] },
      simulated: { stroke: own, width: EM * number("--driven-width"), dash: [] },
      limit: { stroke: color("--bad"), width: 1.4, dash: [6, 4] },
      course: { stroke: color("--accent"), width: 1.8, dash: [] },
      own: { stroke: own, width: 1.6, dash: DASHES[series.color % DASHES.length] },
    };
    return looks[series.look];
  }
  function valueText(chart) {
    return (u, value) =>
      value === null || value === undefined ? "–" : `${value.toFixed(chart.digits)} ${chart.unit}`;
  }
  function axis(extra) {
    return {
      stroke: color("--soft"),
      grid: { stroke: color("--line"), width: 1 },
      ticks: { stroke: color("--line"), width: 1 },
      font: "12px system-ui, sans-serif",
      ...extra,
    };
  }
  /* Round numbers up the axis: at most five steps, whole ones where nothing is between. */
  function stepOf(span, chart) {
    const power = Math.pow(10, Math.floor(Math.log10(span / 5)));
    const fitting = [1, 2, 5, 10].map((factor) => factor * power);
    const step = fitting.find((each) => span / each <= 5.000001);
    return chart.digits === 0 ? Math.max(1, step) : step;
  }
  /* The axis ends at such numbers, beyond all that is drawn. */
  function reach(chart, low, high) {
    const [least, most] = chart.range || [0, 0];
    const bottom = Math.min(least, low ?? 0), top = Math.max(most, high ?? 0);
    const step = stepOf(top - bottom || 1, chart);
    const ends = [Math.floor(bottom / step) * step, Math.ceil(top / step) * step];
    const stroke = 0.03 * (ends[1] - ends[0] || step);
    return [ends[0] - stroke, (ends[1] || step) + stroke];
  }
  function splits(chart, low, high) {
    const step = stepOf((high - low) / 1.06, chart);
    const first = Math.ceil(low / step - 1e-6), last = Math.floor(high / step + 1e-6);
    return Array.from({ length: last - first + 1 }, (_, at) => (first + at) * step);
  }
  function tickText(chart) {
    return (u, ticks) => ticks.map((at) => `${Number(at.toPrecision(6))} ${chart.unit}`);
  }
  const LETTER_PX = 7;
  function labelWidth(u, labels) {
    return 20 + LETTER_PX * Math.max(5, ...(labels || []).map((label) => label.length));
  }
  function drawChart(chart) {
    const place = document.getElementById(`chart-${chart.id}`);
    place.replaceChildren();
    const own = Boolean(chart.along_s);  // not over the mission's time
    const held = own ? { paths: uPlot.paths.stepped({ align: 1 }) } : {};
    const series = chart.series.map((item) => {
      const look = lineOf(item);
      return { label: item.label, value: valueText(chart), points: { show: own && item.look === "course" },
        show: !hiddenOwners.has(item.owner), ...held, ...look };
    });
    const range = (u, low, high) => reach(chart, low, high);
    const plot = new uPlot({
      width: place.clientWidth,
      height: 190,
      cursor: { ...(own ? {} : { sync: { key: "time", setSeries: false } }), y: false },
      scales: { x: { time: false }, y: { range } },
      axes: [
        axis({ values: (u, ticks) => ticks.map((at) => `${at} s`), size: 34 }),
        axis({ values: tickText(chart), splits: (u, at, low, high) => splits(chart, low, high),
          size: labelWidth }),
      ],
      series: [{ label: "time", value: (u, at) => (at === null ? "–" : `${at.toFixed(own ? 2 : 1)} s`) },
        ...series],
      legend: { markers: {
        width: (u, at) => (at ? Math.max(2, series[at - 1].width) : 0),
        dash: (u, at) => (at && series[at - 1].dash.length ? "dashed" : "solid"),
      } },
      hooks: { setCursor: [(u) => {
        const index = u.cursor.idx;
        if (!own && u.cursor.event && index !== null && index !== undefined && index !== shownIndex) show(index);
      }] },
    }, [chart.along_s || data.time_s, ...chart.series.map((item) => item.values)], place);
    all(".u-legend th", place).slice(1).forEach((head) => {
      head.tabIndex = 0;
      head.setAttribute("role", "button");
      head.addEventListener("keydown", (event) => {
        if (event.key === "Enter" || event.key === " ") { event.preventDefault(); head.click(); }
      });
    });
    return plot;
  }
  function drawCharts() {
    charts.splice(0).forEach((plot) => plot.destroy());
    charts.push(...data.charts.map(drawChart));
  }

  /* Beside a robot at the border its name goes inwards. */
  function keepInside(name) {
    const own = name.getBBox(), room = one(".map .ground").getBBox();
    for (const [at, size] of [["x", "width"], ["y", "height"]]) {
      const before = Math.max(0, room[at] - own[at]);
      const after = Math.min(0, room[at] + room[size] - own[at] - own[size]);
      name.setAttribute(at, Number(name.getAttribute(at)) + before + after);
    }
  }

  /* The time shown. */
  const slider = one("#time");
  let shownIndex = 0;
  function show(index) {
    if (!slider) return;
    shownIndex = index;
    const time = data.time_s[index];
    data.robots.forEach((robot) => {
      const group = one(`.map .robot[data-robot="${CSS.escape(robot.id)}"]`);
      const x = robot.x[index], y = robot.y[index];
      group.querySelector(".body").setAttribute("transform", `translate(${x} ${y}) rotate(${robot.turn[index]})`);
      const name = group.querySelector(".label");
      const [right, down] = name.dataset.beside.split(" ").map(Number);
      name.setAttribute("x", x + right);
      name.setAttribute("y", y + down);
      keepInside(name);
    });
    const done = new Set(Object.keys(data.visited_s)
      .filter((goal) => data.visited_s[goal] <= time + 1e-6));
    all(".map .goal").forEach((goal) => goal.classList.toggle("done", done.has(goal.dataset.target)));
    const mark = one(".timeline .now");
    mark.hidden = false;
    mark.style.left = `${(100 * time) / Number(one(".timeline").dataset.end)}%`;
    slider.value = index;
    one("#clock").textContent = `${time.toFixed(1)} s, ${done.size} of ${all(".map .goal").length} goals`;
  }
  let playing = null;
  function play() {
    const button = one("#play");
    if (playing !== null) {
      cancelAnimationFrame(playing);
      playing = null;
      button.textContent = "▶ Play";
      return;
    }
    button.textContent = "⏸ Pause";
    const last = data.time_s.length - 1;
    if (shownIndex >= last) shownIndex = 0;
    const start = performance.now(), from = data.time_s[shownIndex];
    const speed = Number(one("#speed").value);
    const step = (now) => {
      const time = from + (speed * (now - start)) / 1000;
      let index = shownIndex;
      while (index < last && data.time_s[index + 1] <= time) index += 1;
      if (index !== shownIndex) show(index);
      if (index >= last) { playing = 1; play(); return; }
      playing = requestAnimationFrame(step);
    };
    playing = requestAnimationFrame(step);
  }

  /* Toggles. */
  function toggleOwner(id, shown) {
    if (shown) hiddenOwners.delete(id); else hiddenOwners.add(id);
    all(`[data-robot="${CSS.escape(id)}"]`).forEach((part) => { part.style.display = shown ? "" : "none"; });
    data.charts.forEach((chart, number) => chart.series.forEach((item, at) => {
      if (item.owner === id) charts[number].setSeries(at + 1, { show: shown });
    }));
  }
  function toggleLayer(name, shown) {
    all(`.map [data-layer="${name}"]`).forEach((group) => { group.style.display = shown ? "" : "none"; });
  }
  all("input[data-toggle-layer]").forEach((box) =>
    box.addEventListener("change", () => toggleLayer(box.dataset.toggleLayer, box.checked)));
  all("input[data-toggle-owner]").forEach((box) =>
    box.addEventListener("change", () => toggleOwner(box.dataset.toggleOwner, box.checked)));

  applyScheme();
  if (slider) {
    slider.max = data.time_s.length - 1;
    slider.addEventListener("input", () => show(Number(slider.value)));
    one("#play").addEventListener("click", play);
    show(0);
  }
  if (data) {
    let width = innerWidth;
    addEventListener("resize", () => {
      if (innerWidth === width) return;
      width = innerWidth;
      charts.forEach((plot) => plot.setSize({ width: plot.root.parentElement.clientWidth, height: 190 }));
    });
  }
})();
