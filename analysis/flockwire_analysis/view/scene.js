"use strict";
// Draws a picture of a swarm: fence, obstacles, graph, trails, drones with their places, by a camera.

const ROUND = 40; // corners of a drawn circle
const ENDLESS = 0.5; // m that an endless obstacle rises above the fence
const FINEST = 0.1; // m between two lines of the grid
const APART = 55; // pixels between two lines of the grid
const MOST_LINES = 200; // of the grid, each way: a drone may report any place, and the page must go on
const LABEL = "600 12px system-ui, sans-serif";

class Scene {
  constructor(canvas, changed) {
    this.camera = new Camera(canvas, changed);
    this.selected = null;
  }

  begin(outline) {
    this.outline = outline;
    const [low, high] = outline.heights;
    this.field = outline.fence.flatMap(([x, y]) => [[x, y, Math.max(low, 0)], [x, y, high]]);
  }

  // `trails`: by drone, [x, y, z] or null where it is interrupted; `flown`: points that "flight" shows.
  draw(picture, trails, flown) {
    if (!this.outline) return;
    const camera = this.camera;
    const pen = camera.begin();
    const drones = this.outline.drones.filter(({ id }) => picture.drones[id]?.position);
    const near = drones.flatMap(({ id }) => [picture.drones[id].position, picture.drones[id].place]).filter(Boolean);
    const extent = { follow: near, flight: flown, field: [...this.field, ...near], "": [] }[camera.fit];
    camera.frame(extent.length || !camera.fit ? extent : this.field);
    this.grid(pen);
    this.fence(pen);
    for (const obstacle of this.outline.obstacles) this.obstacle(pen, obstacle, palette.muted);
    for (const mover of picture.movers ?? []) this.obstacle(pen, mover, palette.warn);
    this.edges(pen, picture);
    for (const [id, trail] of trails) {
      shape(pen, trail.map((at) => at && camera.to(at)), palette.drone(id), [], false, this.faded(id) ? 0.12 : 0.5);
    }
    for (const { id } of drones) this.place(pen, id, picture.drones[id]);
    this.labels = [];
    const depth = ({ id }) => dot(picture.drones[id].position, camera.near);
    drones.sort((a, b) => depth(a) - depth(b));
    for (const { id, name } of drones) this.drone(pen, id, name, picture.drones[id]);
  }

  faded(id) {
    return this.selected !== null && this.selected !== id;
  }

  isFlat() {
    return this.camera.pitch > 1.5;
  }

  isSide() {
    return this.camera.pitch < 0.01;
  }

  grid(pen) {
    const { camera } = this;
    const half = Math.max(camera.width, camera.height + camera.covered) / camera.scale / 2;
    const apart = Math.max(FINEST, APART / camera.scale);
    const text = (value) => `${Number(value.toFixed(1))}`;
    pen.fillStyle = palette.muted;
    pen.font = "11px system-ui, sans-serif";
    const ticks = (low, high) => spaced(low, high, Math.min(MOST_LINES, (high - low) / apart));
    const round = (k) => ticks(camera.target[k] - half, camera.target[k] + half);
    if (!this.isSide() && !this.isFlat()) {
      this.ground(pen, ticks, text);
      return;
    }
    for (const x of round(0)) this.rule(pen, camera.to([x, 0, 0])[0], null, text(x));
    if (this.isFlat()) for (const y of round(1)) this.rule(pen, null, camera.to([0, y, 0])[1], `${text(y)} m`);
    else for (const z of round(2)) this.rule(pen, null, camera.to([0, 0, z])[1], `${text(z)} m`, z === 0);
  }

  // Draw the ground of the 3-D view: it ends with the field, where its labels are.
  ground(pen, ticks, text) {
    const { camera } = this;
    const points = [...this.field, camera.target];
    const [[x0, x1], [y0, y1]] = [0, 1].map((k) => {
      const values = points.map((point) => point[k]);
      return [Math.min(...values), Math.max(...values)];
    });
    const [yNear, xNear] = [camera.near[1] < 0 ? y0 : y1, camera.near[0] < 0 ? x0 : x1];
    const onLeft = camera.to([xNear, yNear, 0])[0] < camera.to([x0 + x1 - xNear, yNear, 0])[0]; // their common corner
    for (const x of ticks(x0, x1)) this.groundLine(pen, [x, y0, 0], [x, y1, 0], [x, yNear, 0], text(x), onLeft);
    for (const y of ticks(y0, y1)) this.groundLine(pen, [x0, y, 0], [x1, y, 0], [xNear, y, 0], `${text(y)} m`, !onLeft);
  }

  rule(pen, x, y, text, bold = false) {
    const { width, height } = this.camera;
    const ends = y === null ? [[x, 0], [x, height]] : [[0, y], [width, y]];
    shape(pen, ends, palette.line, [], false, 1, bold ? 2 : 1);
    if (y === null) pen.fillText(text, x + 3, height - 5);
    else if (y < height - 18) pen.fillText(text, 4, y - 3);
  }

  groundLine(pen, from, to, label, text, isRight) {
    shape(pen, [this.camera.to(from), this.camera.to(to)], palette.line, [], false, 1, 1);
    const [x, y] = this.camera.to(label);
    pen.textAlign = isRight ? "left" : "right";
    pen.fillText(text, x + (isRight ? 4 : -4), y + 13);
    pen.textAlign = "start";
  }

  fence(pen) {
    const { fence, heights: [low, high] } = this.outline;
    const at = (z) => fence.map(([x, y]) => this.camera.to([x, y, z]));
    if (this.isFlat()) {
      shape(pen, at(0), palette.bad, [8, 4], true);
      return;
    }
    const [below, above] = [at(Math.max(low, 0)), at(high)];
    if (!this.isSide()) shape(pen, below, palette.bad, [8, 4], true, 0.8); // from the side it is on the ground's line
    shape(pen, above, palette.bad, [8, 4], true, 0.45);
    below.forEach((foot, k) => shape(pen, [foot, above[k]], palette.bad, [8, 4], false, 0.45));
  }

  obstacle(pen, { center: [x, y], radius, height }, colour) {
    const { camera } = this;
    const top = height ?? this.outline.heights[1] + ENDLESS;
    const circle = (r, z) => Array.from({ length: ROUND }, (_, k) => {
      const angle = (2 * Math.PI * k) / ROUND;
      return camera.to([x + r * Math.cos(angle), y + r * Math.sin(angle), z]);
    });
    const thick = Math.max(radius, 3 / camera.scale);
    const [low, high] = [circle(thick, 0), circle(thick, top)];
    if (!this.isFlat()) {
      const dx = thick * camera.scale; // its silhouette is as wide in any view
      const [[xf, yf], [xt, yt]] = [camera.to([x, y, 0]), camera.to([x, y, top])];
      polygon(pen, [[xf - dx, yf], [xt - dx, yt], [xt + dx, yt], [xf + dx, yf]], colour, 0.35);
      polygon(pen, low, colour, 0.35);
    }
    polygon(pen, high, colour, this.isFlat() ? 1 : 0.55);
    shape(pen, circle(radius + this.outline.clearance, 0), palette.bad, [3, 3], true, 0.8, 1.3);
  }

  place(pen, id, { position, place }) {
    if (!place) return;
    const [from, to] = [this.camera.to(position), this.camera.to(place)];
    pen.globalAlpha = this.faded(id) ? 0.3 : 1;
    if (Math.hypot(from[0] - to[0], from[1] - to[1]) > 12) shape(pen, [from, to], palette.drone(id), [2, 4], false, 0.7, 1);
    ring(pen, to, 8, palette.drone(id), [3, 3], 1.4);
    pen.globalAlpha = 1;
  }

  drone(pen, id, name, { position, phase }) {
    const { camera } = this;
    const at = camera.to(position);
    pen.globalAlpha = this.faded(id) ? 0.35 : 1;
    if (!this.isFlat()) {
      const foot = camera.to([position[0], position[1], 0]);
      shape(pen, [foot, at], palette.muted, [], false, 0.6, 1);
      disc(pen, foot, 2.5, palette.muted);
    }
    disc(pen, at, palette.followers.includes(id) ? 6 : 7, phase === "silent" ? palette.muted : palette.drone(id), palette.card);
    this.label(pen, at, name);
    pen.globalAlpha = 1;
  }

  // Write a name beside a drone, where it covers no other name if it can.
  label(pen, [x, y], name) {
    pen.font = LABEL;
    const width = pen.measureText(name).width;
    const corners = [[x + 9, y - 8], [x + 9, y + 18], [x - 9 - width, y - 8], [x - 9 - width, y + 18]];
    const isFree = ([left, base]) =>
      this.labels.every(([l, b, w]) => left > l + w || l > left + width || Math.abs(b - base) > 13);
    const at = corners.find(isFree) ?? corners[0];
    this.labels.push([...at, width]);
    pen.lineJoin = "round";
    pen.lineWidth = 3.5;
    pen.strokeStyle = palette.card;
    pen.strokeText(name, ...at);
    pen.fillStyle = palette.ink;
    pen.fillText(name, ...at);
  }

  edges(pen, picture) {
    pen.globalAlpha = 0.45;
    for (const [from, target] of this.outline.edges) {
      const [a, b] = [picture.drones[from]?.position, picture.drones[target]?.position];
      if (a && b) arrow(pen, this.camera.to(a), this.camera.to(b), palette.muted);
    }
    pen.globalAlpha = 1;
  }
}
