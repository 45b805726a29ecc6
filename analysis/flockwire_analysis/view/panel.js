"use strict";
// The table of drones with a sheet for a selected one, and the buttons of the views.

const $ = (id) => document.getElementById(id);

function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function state(text, bad) {
  $("state").textContent = text;
  $("state").classList.toggle("bad", bad);
}

function isSilent(one) {
  return !one || one.phase === "silent";
}

function otherProcesses(outline) {
  const drones = new Set(outline.drones.map(({ name }) => name));
  return outline.processes.filter((name) => !drones.has(name));
}

function formationName(name) {
  return name === null ? "" : name || "first";
}

function metres(value) {
  return (Math.round(100 * value) / 100 + 0).toFixed(2); // -0 becomes 0
}

let table = { key: "", rows: new Map() }; // the rows in the page: they remain while pictures arrive, with their focus

// Fill the table; `selected` is the drone whose sheet is open, `select` is called with another one or null.
function fillTable(outline, picture, selected, select) {
  const key = JSON.stringify([outline.drones, selected, palette.ink]);
  if (table.key !== key) build(key, outline, selected, select);
  for (const [id, { cells, list }] of table.rows) {
    const drone = picture.drones[id];
    cellsOf(drone).forEach(([text, kind], k) => Object.assign(cells[k], { textContent: text, className: kind }));
    list?.replaceChildren(...(drone ? sheet(drone) : []));
  }
  const others = otherProcesses(outline);
  $("others").textContent = others.map((name) => `${name}: ${picture.others[name]?.phase ?? "no status"}`).join(" · ");
  const told = [...outline.drones.map(({ id, name }) => [name, picture.drones[id]]), ...Object.entries(picture.others)];
  const notes = told.filter(([, one]) => one?.detail).map(([name, one]) => `${name}: ${one.detail}`);
  $("notes").replaceChildren(...notes.map((text) => element("li", { textContent: text })));
}

function build(key, outline, selected, select) {
  const focus = document.activeElement?.dataset.id;
  table = { key, rows: new Map() };
  $("rows").replaceChildren();
  for (const { id, name } of outline.drones) {
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = palette.drone(id);
    const open = id === selected;
    const toggle = { type: "button", className: "name", onclick: () => select(open ? null : id) };
    const opener = element("button", toggle, swatch, name);
    opener.dataset.id = id;
    opener.setAttribute("aria-expanded", String(open));
    const cells = cellsOf(null).map(() => element("td", {}));
    const list = open ? element("dl", {}) : null;
    $("rows").append(element("tr", {}, element("td", {}, opener), ...cells));
    if (list) $("rows").append(element("tr", { className: "sheet" }, element("td", { colSpan: 7 }, list)));
    table.rows.set(id, { cells, list });
    if (focus === String(id)) opener.focus();
  }
}

// Return text and class of a row's cells behind the name.
function cellsOf(drone) {
  if (!drone) return [["no status", "silent"], ...Array.from({ length: 5 }, () => ["", ""])];
  const at = drone.position;
  return [
    [drone.phase, drone.phase],
    [formationName(drone.formation), ""],
    [at ? `${metres(at[0])}, ${metres(at[1])}` : "", "n"],
    [at ? metres(at[2]) : "", "n"],
    [drone.battery < 0 ? "" : `${Math.round(100 * drone.battery)} %`, "n"],
    [drone.error < 0 ? "" : (1000 * drone.error).toFixed(0), "n"],
  ];
}

// Return the entries of a drone's sheet.
function sheet(drone) {
  const told = [
    ["phase", drone.phase],
    ["why", drone.detail || "no reason reported"],
    ["formation", formationName(drone.formation) || "none"],
  ];
  if (drone.place) told.push(["its place, m", drone.place.map(metres).join(", ")]);
  for (const [name, value] of Object.entries(drone.sheet ?? {})) told.push([name, value]);
  return told.flatMap(([name, value]) => [element("dt", { textContent: name }), element("dd", { textContent: value })]);
}

// Make the buttons `data-view`, `data-fit` and `data-zoom` work; return what shows which is in force.
function viewButtons({ camera }) {
  const look = (name) => camera.look(name);
  const actions = { view: look, fit: (what) => camera.keep(what), zoom: (by) => camera.zoom(Number(by)) };
  const found = [...document.querySelectorAll(".tools button")];
  const buttons = found.map((button) => [button, ...Object.entries(button.dataset)[0]]);
  for (const [button, kind, value] of buttons) button.addEventListener("click", () => actions[kind](value));
  return () => {
    for (const [button, kind, value] of buttons) {
      if (kind !== "zoom") button.setAttribute("aria-pressed", String(camera[kind] === value));
    }
  };
}

// Draw when something has changed, once for each frame of the screen.
function onceAFrame(work) {
  let due = false;
  return () => {
    if (due) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      work();
    });
  };
}
