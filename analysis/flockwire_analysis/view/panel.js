"use strict";
// The table of drones with a sheet for a selected one, and the buttons of the views.

const $ = (id) => document.getElementById(id);

function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function cell(text, kind = "") {
  return element("td", { textContent: text, className: kind });
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

// Fill the table; `selected` is the drone whose sheet is open.
function fillTable(outline, picture, selected, select) {
  const rows = [];
  for (const { id, name } of outline.drones) {
    const drone = picture.drones[id];
    rows.push(row(id, name, drone, id === selected, () => select(id === selected ? null : id)));
    if (drone && id === selected) rows.push(sheet(drone));
  }
  $("rows").replaceChildren(...rows);
  const others = otherProcesses(outline);
  $("others").textContent = others.map((name) => `${name}: ${picture.others[name]?.phase ?? "no status"}`).join(" · ");
  const told = [...outline.drones.map(({ id, name }) => [name, picture.drones[id]]), ...Object.entries(picture.others)];
  const notes = told.filter(([, one]) => one?.detail).map(([name, one]) => `${name}: ${one.detail}`);
  $("notes").replaceChildren(...notes.map((text) => element("li", { textContent: text })));
}

function row(id, name, drone, isOpen, toggle) {
  const swatch = element("span", { className: "swatch" });
  swatch.style.background = palette.drone(id);
  const opener = element("button", { type: "button", className: "name", onclick: toggle }, swatch, name);
  opener.setAttribute("aria-expanded", String(isOpen));
  const made = element("tr", {}, element("td", {}, opener));
  if (!drone) {
    made.append(cell("no status", "silent"));
    return made;
  }
  const at = drone.position;
  made.append(
    cell(drone.phase, drone.phase),
    cell(formationName(drone.formation)),
    cell(at ? `${metres(at[0])}, ${metres(at[1])}` : "", "n"),
    cell(at ? metres(at[2]) : "", "n"),
    cell(drone.battery < 0 ? "" : `${Math.round(100 * drone.battery)} %`, "n"),
    cell(drone.error < 0 ? "" : (1000 * drone.error).toFixed(1), "n"),
  );
  return made;
}

function sheet(drone) {
  const told = [["phase", drone.phase], ["why", drone.detail || "no reason reported"], ["formation", formationName(drone.formation) || "none"]];
  if (drone.place) told.push(["its place, m", drone.place.map(metres).join(", ")]);
  for (const [name, value] of Object.entries(drone.sheet ?? {})) told.push([name, value]);
  const list = element("dl", {}, ...told.flatMap(([name, value]) => [element("dt", { textContent: name }), element("dd", { textContent: value })]));
  return element("tr", { className: "sheet" }, element("td", { colSpan: 7 }, list));
}

// Make the buttons `data-view` and `data-fit` work, and show which is in force.
function viewButtons(scene) {
  const buttons = [...document.querySelectorAll("button[data-view], button[data-fit], button[data-zoom]")];
  const { camera } = scene;
  for (const button of buttons) {
    const { view, fit, zoom } = button.dataset;
    button.addEventListener("click", () => {
      if (view) camera.look(view);
      else if (fit) camera.keep(fit);
      else camera.zoom(Number(zoom));
    });
  }
  return () => {
    for (const button of buttons) {
      const { view, fit } = button.dataset;
      if (view || fit) button.setAttribute("aria-pressed", String(view ? camera.view === view : camera.fit === fit));
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
