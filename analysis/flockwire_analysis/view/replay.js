"use strict";
// Plays a flight that is in the page: sampled positions, and changes of what the processes reported.

const flight = JSON.parse($("flight").textContent);
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];
const TRAILS = [[5, "trail 5 s"], [20, "trail 20 s"], [Infinity, "whole path"], [0, "no trail"]];
const TRAIL_POINTS = 500;
const SENSED = 0.3; // s that a moving body is shown after a drone sensed it last
const TABLE_EVERY = 100; // ms while it plays
const last = flight.count - 1;
const end = flight.begin + last * flight.step;
let now = Math.min(end, Math.max(flight.begin, 0)); // s from the start of the formation
let playing = false;
let drawn = 0; // when the last frame was drawn, ms
let tabled = 0;

const index = (time) => Number(((time - flight.begin) / flight.step).toFixed(6)); // 0.1 + 0.2 is the sample of 0.3
const scene = new Scene($("canvas"), onceAFrame(draw));
const showViews = viewButtons(scene);
const charts = [
  new Chart($("errors"), { title: "formation error", log: true, seek }),
  new Chart($("heights"), { title: "height", log: false, seek }),
];

const SIGNALS = 6; // of the law, that have a chart
const signals = [...new Set(Object.values(flight.drones).flatMap((one) => Object.keys(one.signals)))].sort().slice(0, SIGNALS);
for (const title of signals) {
  const canvas = element("canvas", { className: "chart" });
  [...document.querySelectorAll(".chart")].at(-1).after(canvas);
  charts.push(new Chart(canvas, { title, log: false, seek }));
}

// Return a value at a fractional index, linear between two known ones, null where it is unknown.
function between(values, at) {
  const k = Math.floor(at);
  const [a, b] = [values[k] ?? null, values[k + 1] ?? null];
  return a === null || b === null ? a : a + (at - k) * (b - a);
}

function point(three, at) {
  const found = three.map((values) => between(values, at));
  return found.includes(null) ? null : found.map((value) => value / 1000);
}

// Return the last of `changes`, each with its time first, at or before `time`; null before the first.
function current(changes, time) {
  let [low, high] = [0, changes.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (changes[middle][0] <= time + 1e-9) low = middle + 1;
    else high = middle;
  }
  return low ? changes[low - 1] : null;
}

function reported(changes, time) {
  const [, phase, why, formation] = current(changes, time) ?? [0, "no status", "", null];
  return { phase, detail: why, formation };
}

function speed(three, at) {
  const [from, to] = [Math.max(0, at - 2), Math.min(last, at + 2)];
  const [a, b] = [point(three, from), point(three, to)];
  if (!a || !b || from === to) return "unknown";
  const way = Math.hypot(...a.map((value, k) => b[k] - value));
  return `${(way / (to - from) / flight.step).toFixed(2)} m/s`;
}

// Return the moving bodies that drones sense at a time, like obstacles.
function moversAt(time) {
  const [step, bodies] = current(flight.movers, index(time)) ?? [-Infinity, []];
  if ((index(time) - step) * flight.step > SENSED) return [];
  const metres = (value) => (value === null ? null : value / 1000);
  return bodies.map((one) => one.map(metres)).map(([x, y, radius, height]) => ({ center: [x, y], radius, height }));
}

// Return the picture at a time, like one of the console's server.
function pictureAt(time) {
  const at = index(time);
  const drones = {};
  for (const [id, one] of Object.entries(flight.drones)) {
    const error = between(one.error, at);
    const observed = between(one.observation, at);
    drones[id] = {
      ...reported(one.reports, time),
      position: point(one.position, at),
      place: point(one.place, at),
      battery: (current(one.battery, time)?.[1] ?? -100) / 100,
      error: error === null ? -1 : error / 1000,
      sheet: {
        speed: speed(one.position, at),
        "error of its estimate of the leader": observed === null ? "unknown" : `${observed.toFixed(0)} mm`,
        ...Object.fromEntries(Object.entries(one.signals).map(([name, told]) => [name, current(told, time)?.[1] ?? "none yet"])),
      },
    };
  }
  const others = Object.fromEntries(Object.entries(flight.others).map(([name, one]) => [name, reported(one, time)]));
  return { drones, others, movers: moversAt(time) };
}

// Return the samples of a path from one index to another; null interrupts it where the position is unknown.
function path(three, from, to) {
  const stride = Math.max(1, Math.floor((to - from) / TRAIL_POINTS));
  const points = [];
  for (let k = from; k <= to; k += 1) {
    if (three[0][k] === null) {
      if (points.at(-1)) points.push(null);
    } else if (k % stride === 0 || k === to) points.push(three.map((values) => values[k] / 1000));
  }
  return points;
}

function draw() {
  const at = index(now);
  const shown = pictureAt(now);
  const length = Number($("tail").value);
  const trails = new Map();
  for (const { id } of length ? flight.outline.drones : []) {
    const from = Math.max(0, Math.ceil(at - length / flight.step));
    const here = shown.drones[id].position;
    trails.set(id, [...path(flight.drones[id].position, from, Math.floor(at)), ...(here ? [here] : [])]);
  }
  scene.draw(shown, trails, flown);
  for (const chart of charts) chart.draw(now, scene.selected);
  strip($("marks"), flight.marks, (t) => index(t) / last);
  $("clock").firstChild.textContent = `t = ${now.toFixed(2)} s`;
  const utc = new Date(flight.zero + 1000 * now).toISOString().slice(11, 19);
  $("clock").lastChild.textContent = flight.virtual ? "virtual time" : `${utc} UTC`;
  $("slider").value = Math.round(at);
  $("slider").setAttribute("aria-valuetext", `${now.toFixed(2)} s`);
  if (!playing || performance.now() - tabled > TABLE_EVERY) describe(shown);
  showViews();
}

function describe(shown) {
  tabled = performance.now();
  fillTable(flight.outline, shown, scene.selected, select);
  const list = $("events");
  const items = [...list.children];
  const passed = flight.marks.filter((mark) => mark.t <= now + 1e-9).length;
  items.forEach((item, k) => item.firstChild.classList.toggle("passed", k < passed - 1));
  items.forEach((item, k) => item.firstChild.classList.toggle("now", k === passed - 1));
  const latest = items[Math.max(0, passed - 1)];
  if (latest) list.scrollTop = latest.offsetTop - (list.clientHeight - latest.offsetHeight) / 2;
}

function select(id) {
  scene.selected = id;
  draw();
}

function seek(time) {
  now = Math.min(end, Math.max(flight.begin, time));
  tabled = 0;
  draw();
}

function play(wanted) {
  playing = wanted;
  if (playing && now >= end) now = flight.begin;
  $("play").textContent = playing ? "Pause" : "Play";
  drawn = performance.now();
  if (playing) requestAnimationFrame(tick);
  else draw();
}

function tick(time) {
  if (!playing) return;
  now = Math.min(end, now + (Math.max(0, time - drawn) / 1000) * Number($("speed").value));
  drawn = time;
  if (now >= end) play(false);
  else {
    draw();
    requestAnimationFrame(tick);
  }
}

function step(samples) {
  play(false);
  seek(flight.begin + (Math.round(index(now)) + samples) * flight.step);
}

function jump({ t, drones = [] }) {
  play(false);
  scene.selected = drones.length === 1 ? drones[0] : null;
  seek(t);
}

function fill() {
  for (const one of SPEEDS) $("speed").append(new Option(`${one} ×`, one, one === 1, one === 1));
  for (const [seconds, text] of TRAILS) $("tail").append(new Option(text, seconds));
  $("tail").value = 20;
  $("moments").append(new Option("Jump to the worst …", ""), ...flight.moments.map(({ text }, k) => new Option(text, k)));
  $("slider").max = last;
  for (const mark of flight.marks) {
    const sign = element("i", { textContent: mark.kind === "phase" ? "·" : "●" });
    sign.style.color = `var(--${MARKS[mark.kind] ?? "bad"})`;
    const time = element("time", { textContent: `${mark.t.toFixed(2)} s` });
    const button = element("button", { type: "button", onclick: () => jump(mark) }, time, sign, element("span", { textContent: mark.text }));
    $("events").append(element("li", {}, button));
  }
  const times = Array.from({ length: flight.count }, (_, k) => flight.begin + k * flight.step);
  const scaled = (values) => values.map((value) => (value === null ? null : value / 1000));
  const curves = (pick) => flight.outline.drones.map(({ id }) => ({ id, times, values: scaled(pick(flight.drones[id])) }));
  const shown = flight.marks.filter(({ kind }) => kind !== "phase");
  charts[0].show(curves((one) => one.error).filter(({ id }) => palette.followers.includes(id)), shown, [flight.begin, end]);
  charts[1].show(curves((one) => one.position[2]), shown, [flight.begin, end]);
  signals.forEach((name, k) => {
    const told = flight.outline.drones.map(({ id }) => ({ id, samples: flight.drones[id].signals[name] ?? [] }));
    const drawn = told.map(({ id, samples }) => ({ id, times: samples.map(([t]) => t), values: samples.map(([, v]) => v) }));
    charts[2 + k].show(drawn, shown, [flight.begin, end]);
  });
}

function listen() {
  $("play").addEventListener("click", () => play(!playing));
  $("back").addEventListener("click", () => step(-1));
  $("on").addEventListener("click", () => step(1));
  $("slider").addEventListener("input", () => seek(flight.begin + Number($("slider").value) * flight.step));
  $("tail").addEventListener("change", draw);
  $("moments").addEventListener("change", () => {
    if ($("moments").value !== "") jump(flight.moments[Number($("moments").value)]);
    $("moments").value = "";
  });
  addEventListener("keydown", (event) => {
    if (event.target.closest("select") || event.ctrlKey || event.metaKey || event.altKey) return;
    const samples = event.shiftKey ? Math.max(1, Math.round(1 / flight.step)) : 1;
    const actions = {
      " ": () => play(!playing),
      ArrowLeft: () => step(-samples),
      ArrowRight: () => step(samples),
      Home: () => seek(flight.begin),
      End: () => seek(end),
    };
    if (!actions[event.key] || (event.key === " " && event.target.closest("button"))) return;
    event.preventDefault();
    actions[event.key]();
  });
  const linked = () => {
    const time = Number(/^#t=(-?[\d.]+)$/.exec(location.hash)?.[1] ?? NaN);
    if (Number.isFinite(time)) seek(time);
  };
  addEventListener("hashchange", linked);
  new ResizeObserver(draw).observe(document.body);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    palette.read();
    draw();
  });
  linked();
}

const flown = flight.outline.drones.flatMap(({ id }) => path(flight.drones[id].position, 0, last)).filter(Boolean);
palette.followers = flight.outline.drones.filter(({ leads }) => !leads).map(({ id }) => id);
palette.read();
scene.begin(flight.outline);
scene.camera.fit = "flight";
state(flight.verdict, flight.failed);
fill();
listen();
draw();
