"use strict";
// A live swarm, from the server's pictures, ten times a second; orders use the same socket.

const TRAIL = 300; // pictures of a trail
const HISTORY = 600; // pictures of a curve, which are kept
const GAP = 1000; // ms without a picture after which it is missing, and the trail is interrupted
let outline = null;
let picture = null;
let socket = null;
let samples = new Map(); // by drone: of each picture {time, error, position}
let armed = 0;
let connected = ""; // text to show while pictures arrive
let newest = 0; // arrival of the newest picture, ms
let began = null; // time of the first picture, s

const token = decodeURIComponent(location.hash.slice(1));
const changed = onceAFrame(draw);
const scene = new Scene($("canvas"), changed);
const showViews = viewButtons(scene);
const charts = [
  new Chart($("errors"), { title: "formation error, by its own estimate", log: true }),
  new Chart($("heights"), { title: "height", log: false }),
];

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const live = `${location.host}/live${token ? `?token=${encodeURIComponent(token)}` : ""}`;
  socket = new WebSocket(`${scheme}://${live}`);
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = async () => {
    connected = "";
    const reason = await refusal(`${location.protocol}//${live}`);
    state(reason ? `not connected: ${reason}` : "not connected", true);
    setTimeout(connect, 1000);
  };
}

// Return why the server refuses this page, empty without a reason: a websocket does not report it.
async function refusal(link) {
  try {
    const answer = await fetch(link);
    return answer.status === 403 || answer.status === 503 ? await answer.text() : "";
  } catch {
    return "";
  }
}

function take(message) {
  if (message.outline) begin(message);
  else if (message.answer) answer(message.answer);
  else {
    const missed = performance.now() - newest > GAP;
    picture = message;
    newest = performance.now();
    remember(missed);
    check();
    describe();
    changed();
  }
}

function begin(message) {
  outline = message.outline;
  samples = new Map();
  began = null;
  palette.followers = outline.drones.filter(({ leads }) => !leads).map(({ id }) => id);
  scene.begin(outline);
  document.title = $("name").textContent = outline.name;
  connected = message.orders ? "connected" : "connected, view only: the link lacks its token";
  newest = performance.now();
  $("orders").hidden = !message.orders;
  $("formations").replaceChildren(...["", ...outline.formations].map((name) => new Option(name || "first formation", name)));
}

function check() {
  if (!connected) return;
  const late = performance.now() - newest;
  const wrong = late > GAP ? `no picture for ${Math.round(late / 1000)} s` : silence();
  state(wrong || connected, Boolean(wrong));
}

// Return the silent processes, empty while all report.
function silence() {
  if (!picture) return "";
  const others = otherProcesses(outline);
  const drones = outline.drones.filter(({ id }) => isSilent(picture.drones[id])).map(({ name }) => name);
  const silent = [...drones, ...others.filter((name) => isSilent(picture.others[name]))];
  if (!silent.length) return "";
  const all = silent.length === outline.drones.length + others.length;
  return `${connected}; ${all ? "no process reports: the swarm has ended, or cannot be reached" : `silent: ${silent.join(", ")}`}`;
}

function answer(found) {
  $("answer").textContent = found.failed ? `${found.order} failed: ${found.failed}` : `${found.order}: done ${found.note}`;
  $("answer").classList.toggle("bad", Boolean(found.failed));
}

function order(verb) {
  if (verb === "stop" && Date.now() - armed > 2000 && matchMedia("(pointer: coarse)").matches) {
    armed = Date.now();
    $("answer").textContent = "tap STOP again: the motors stop, flying drones fall";
    return;
  }
  if (socket.readyState !== WebSocket.OPEN) {
    answer({ order: verb, failed: "not connected, nothing was ordered" });
    return;
  }
  const formation = verb === "start" || verb === "formation" ? $("formations").value : "";
  socket.send(JSON.stringify({ order: verb, formation }));
  $("answer").textContent = `${verb} …`;
}

// Keep a sample of each drone; null, for a missing picture or an unknown value, interrupts its trail and curves.
function remember(missed) {
  began ??= picture.now;
  const time = picture.now - began;
  for (const { id } of outline.drones) {
    const kept = samples.get(id) ?? samples.set(id, []).get(id);
    const drone = picture.drones[id];
    const position = isSilent(drone) ? null : drone.position;
    if (missed) kept.push({ time, error: null, position: null });
    kept.push({ time, error: position && drone.error >= 0 ? drone.error : null, position });
    kept.splice(0, kept.length - HISTORY);
  }
}

const trails = () => new Map([...samples].map(([id, kept]) => [id, kept.slice(-TRAIL).map(({ position }) => position)]));

function describe() {
  fillTable(outline, picture, scene.selected, (id) => {
    scene.selected = id;
    describe();
    changed();
  });
  $("clock").firstChild.textContent = picture.mission === null ? "" : `t = ${picture.mission.toFixed(1)} s`;
  $("clock").lastChild.textContent = `${new Date(1000 * picture.now).toISOString().slice(11, 19)} UTC`;
}

function draw() {
  if (!picture) return;
  scene.draw(picture, trails(), [...trails().values()].flat().filter(Boolean));
  const span = [Math.max(0, picture.now - began - HISTORY / 10), Math.max(10, picture.now - began)];
  const times = (kept) => kept.map(({ time }) => time);
  const curves = (pick) => [...samples].map(([id, kept]) => ({ id, times: times(kept), values: kept.map(pick) }));
  charts[0].show(curves(({ error }) => error).filter(({ id }) => palette.followers.includes(id)), [], span);
  charts[1].show(curves(({ position }) => position && position[2]), [], span);
  for (const chart of charts) chart.draw(null, scene.selected);
  showViews();
}

for (const button of document.querySelectorAll("button[data-order]")) {
  button.addEventListener("click", () => order(button.dataset.order));
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  palette.read();
  changed();
});
new ResizeObserver(changed).observe(document.body);
palette.read();
setInterval(check, 250);
connect();
