"use strict";
// The map and the table of a swarm, from the server's pictures, ten times a second; orders use the same socket.

const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];
const TRAIL = 300; // pictures of a trail
const GAP = 1000; // ms without a picture after which it is missing, and the trail is interrupted
const $ = (id) => document.getElementById(id);
let outline = null;
let picture = null;
let socket = null;
let trails = new Map();
let armed = 0;
let connected = ""; // text to show while pictures arrive
let newest = 0; // arrival of the newest picture, ms

const token = decodeURIComponent(location.hash.slice(1));
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function colour(id) {
  if (id === 0) return style("--ink");
  const followers = outline.drones.filter((drone) => drone.id !== 0).map((drone) => drone.id);
  const place = followers.indexOf(id);
  return followers.length <= COLOURS.length ? COLOURS[place] : `hsl(${(360 * place) / followers.length} 65% 45%)`;
}

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
    table();
    requestAnimationFrame(draw);
  }
}

function begin(message) {
  outline = message.outline;
  trails = new Map();
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

function isSilent(one) {
  return !one || one.phase === "silent";
}

function others() {
  return outline.processes.filter((name) => !outline.drones.some((drone) => drone.name === name));
}

// Return the silent processes, empty while all report.
function silence() {
  if (!picture) return "";
  const drones = outline.drones.filter(({ id }) => isSilent(picture.drones[id])).map(({ name }) => name);
  const silent = [...drones, ...others().filter((name) => isSilent(picture.others[name]))];
  if (!silent.length) return "";
  const all = silent.length === outline.drones.length + others().length;
  return `${connected}; ${all ? "no process reports: the swarm has ended, or cannot be reached" : `silent: ${silent.join(", ")}`}`;
}

function state(text, bad) {
  $("state").textContent = text;
  $("state").classList.toggle("bad", bad);
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

// Adds to the trails; null, for a missing picture or an unknown position, interrupts one.
function remember(missed) {
  for (const { id } of outline.drones) {
    const trail = trails.get(id) ?? trails.set(id, []).get(id);
    const drone = picture.drones[id];
    const known = !isSilent(drone) && drone.position;
    if (missed || !known) trail.push(null);
    if (known) trail.push(drone.position);
    while (trail.length > TRAIL) trail.shift();
  }
}

function cell(text, kind) {
  const made = document.createElement("td");
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

function table() {
  const rows = outline.drones.map(({ id, name }) => {
    const drone = picture.drones[id];
    const row = document.createElement("tr");
    const first = cell(name);
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.style.background = colour(id);
    first.prepend(swatch);
    row.append(first);
    if (!drone) {
      row.append(cell("no status", "silent"));
      return row;
    }
    const at = drone.position;
    const flown = drone.formation === null ? "" : drone.formation || "first";
    row.append(cell(drone.phase, drone.phase), cell(flown));
    row.append(cell(at ? `${at[0].toFixed(2)}, ${at[1].toFixed(2)}` : "", "n"), cell(at ? at[2].toFixed(2) : "", "n"));
    row.append(cell(drone.battery < 0 ? "" : `${Math.round(100 * drone.battery)} %`, "n"));
    row.append(cell(drone.error < 0 ? "" : (1000 * drone.error).toFixed(1), "n"));
    return row;
  });
  $("rows").replaceChildren(...rows);
  $("others").textContent = others().map((name) => `${name}: ${picture.others[name]?.phase ?? "no status"}`).join(" · ");
  const told = [...outline.drones.map(({ id, name }) => [name, picture.drones[id]]), ...Object.entries(picture.others)];
  const notes = told.filter(([, one]) => one?.detail).map(([name, one]) => `${name}: ${one.detail}`);
  $("notes").replaceChildren(...notes.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
}

function bounds() {
  const near = [...Object.values(picture.drones).flatMap((drone) => [drone.position, drone.place])].filter(Boolean);
  const points = near.length ? near : outline.fence;
  const low = [0, 1].map((k) => Math.min(...points.map((point) => point[k])));
  const high = [0, 1].map((k) => Math.max(...points.map((point) => point[k])));
  const half = Math.max(1.5, 0.62 * Math.max(high[0] - low[0], high[1] - low[1]));
  return { middle: [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2], half };
}

function draw() {
  const canvas = $("canvas");
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  const { middle, half } = bounds();
  const scale = Math.min(width, height) / (2 * half);
  const to = ([x, y]) => [width / 2 + (x - middle[0]) * scale, height / 2 - (y - middle[1]) * scale];
  grid(pen, to, middle, half * Math.max(width, height) / Math.min(width, height), width, height);
  shape(pen, outline.fence.map(to), style("--bad"), [8, 4], true);
  for (const { center, radius } of outline.obstacles) {
    disc(pen, to(center), Math.max(radius * scale, 3), style("--muted"));
    ring(pen, to(center), (radius + outline.clearance) * scale, style("--bad"));
  }
  edges(pen, to);
  for (const [id, trail] of trails) shape(pen, trail.map((at) => at && to(at)), colour(id), [], false, 0.35);
  for (const [id, drone] of Object.entries(picture.drones)) {
    if (drone.place) ring(pen, to(drone.place), 7, colour(Number(id)));
  }
  for (const { id, name } of outline.drones) {
    const drone = picture.drones[id];
    if (!drone?.position) continue;
    const at = to(drone.position);
    disc(pen, at, id === 0 ? 7 : 6, drone.phase === "silent" ? style("--muted") : colour(id));
    pen.fillStyle = style("--ink");
    pen.font = "12px system-ui, sans-serif";
    pen.fillText(name, at[0] + 9, at[1] - 7);
  }
}

function grid(pen, to, middle, half, width, height) {
  const step = half > 12 ? 5 : half > 4 ? 2 : 1;
  pen.strokeStyle = style("--line");
  pen.fillStyle = style("--muted");
  pen.lineWidth = 1;
  pen.font = "11px system-ui, sans-serif";
  for (let k = Math.ceil((middle[0] - half) / step) * step; k <= middle[0] + half; k += step) {
    const [x] = to([k, 0]);
    pen.strokeRect(x, -1, 0, height + 2);
    pen.fillText(`${k}`, x + 3, height - 5);
  }
  for (let k = Math.ceil((middle[1] - half) / step) * step; k <= middle[1] + half; k += step) {
    const [, y] = to([0, k]);
    pen.strokeRect(-1, y, width + 2, 0);
    pen.fillText(`${k} m`, 4, y - 3);
  }
}

function edges(pen, to) {
  pen.strokeStyle = pen.fillStyle = style("--muted");
  pen.globalAlpha = 0.45;
  pen.lineWidth = 1;
  for (const [from, target] of outline.edges) {
    const [a, b] = [picture.drones[from]?.position, picture.drones[target]?.position];
    if (!a || !b) continue;
    const [[x0, y0], [x1, y1]] = [to(a), to(b)];
    const length = Math.hypot(x1 - x0, y1 - y0) || 1;
    const [ux, uy] = [(x1 - x0) / length, (y1 - y0) / length];
    const [tipX, tipY] = [x1 - 10 * ux, y1 - 10 * uy];
    pen.beginPath();
    pen.moveTo(x0, y0);
    pen.lineTo(tipX, tipY);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(tipX, tipY);
    pen.lineTo(tipX - 7 * ux + 3.5 * uy, tipY - 7 * uy - 3.5 * ux);
    pen.lineTo(tipX - 7 * ux - 3.5 * uy, tipY - 7 * uy + 3.5 * ux);
    pen.fill();
  }
  pen.globalAlpha = 1;
}

function shape(pen, points, stroke, dash, closed, alpha = 1) {
  if (points.length < 2) return;
  pen.beginPath();
  points.forEach((point, k) => point && (points[k - 1] ? pen.lineTo(...point) : pen.moveTo(...point)));
  if (closed) pen.closePath();
  pen.globalAlpha = alpha;
  pen.strokeStyle = stroke;
  pen.lineWidth = 1.6;
  pen.setLineDash(dash);
  pen.stroke();
  pen.setLineDash([]);
  pen.globalAlpha = 1;
}

function disc(pen, [x, y], radius, fill) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fillStyle = fill;
  pen.fill();
}

function ring(pen, [x, y], radius, stroke) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.strokeStyle = stroke;
  pen.lineWidth = 1.3;
  pen.setLineDash([3, 3]);
  pen.stroke();
  pen.setLineDash([]);
}

for (const button of document.querySelectorAll("button[data-order]")) {
  button.addEventListener("click", () => order(button.dataset.order));
}
setInterval(check, 250);
connect();
