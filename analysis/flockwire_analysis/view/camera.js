"use strict";
// A parallel projection of the world (m; x east, y north, z up) onto a canvas, moved by pointers and wheel.

const VIEWS = { above: [0, Math.PI / 2], side: [0, 0], "3-D": [-0.55, 0.5] }; // yaw, pitch, rad
const SMALLEST = 3; // m that are shown at least
const MARGIN = 1.2; // times the extent that is shown
const CLOSEST = 4000; // pixels per m

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

class Camera {
  constructor(canvas, changed) {
    this.canvas = canvas;
    this.changed = changed;
    this.fit = "follow"; // what is kept in view; empty after a pan or a zoom
    this.target = [0, 0, 0];
    this.scale = 60; // pixels per m
    this.pointers = new Map();
    this.look("above");
    this.listen();
  }

  look(view) {
    this.view = view;
    [this.yaw, this.pitch] = VIEWS[view];
    this.fit ||= "follow";
    this.changed();
  }

  keep(fit) {
    this.fit = fit;
    this.changed();
  }

  // Return the unit vectors of the picture: right, up, and towards the viewer.
  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return [[cy, sy, 0], [-sy * sp, cy * sp, cp], [sy * cp, -cy * cp, sp]];
  }

  // Take over the canvas' size; return its pen.
  begin() {
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    const tools = this.canvas.parentElement.querySelector(".tools"); // buttons over the top of the picture
    this.covered = Math.min(tools.offsetTop + tools.offsetHeight, this.height / 3);
    this.middle = (this.height + this.covered) / 2; // of what they leave free
    [this.right, this.up, this.near] = this.axes();
    return emptyPen(this.canvas);
  }

  to(point) {
    const from = this.target.map((value, k) => (point[k] ?? 0) - value);
    return [this.width / 2 + this.scale * dot(from, this.right), this.middle - this.scale * dot(from, this.up)];
  }

  // Show all of `points`, if there are any.
  frame(points) {
    if (!points.length || !this.width || !this.height) return;
    const axes = this.axes();
    const spans = axes.map((axis) => points.reduce(([low, high], point) => {
      const along = dot(point, axis);
      return [Math.min(low, along), Math.max(high, along)];
    }, [Infinity, -Infinity]));
    this.target = [0, 1, 2].map((k) => spans.reduce((sum, [low, high], n) => sum + axes[n][k] * (low + high) / 2, 0));
    const [across, along] = spans.map(([low, high]) => Math.max(high - low, SMALLEST) * MARGIN);
    this.scale = Math.min(this.width / across, (this.height - this.covered) / along);
  }

  listen() {
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    }
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", () => this.keep("follow"));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY * (event.deltaMode ? 20 : 1)), [event.offsetX, event.offsetY]);
    }, { passive: false });
  }

  // One pointer pans, or turns the 3-D view (with the other button or Shift it pans there); two zoom and pan.
  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.offsetX, event.offsetY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    if (other) {
      const spread = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]) || 1;
      this.pan(dx / 2, dy / 2);
      this.zoom(spread(now) / spread(before), [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
    } else if (this.view === "3-D" && event.buttons === 1 && !event.shiftKey) {
      this.yaw -= 0.008 * dx;
      this.pitch = Math.min(Math.PI / 2, Math.max(0.02, this.pitch + 0.008 * dy));
      this.changed();
    } else this.pan(dx, dy);
  }

  pan(dx, dy) {
    const [right, up] = this.axes();
    this.fit = "";
    this.target = this.target.map((value, k) => value + (-dx * right[k] + dy * up[k]) / this.scale);
    this.changed();
  }

  // Zoom by `factor`; what is at the pixel `at`, the middle by default, remains there.
  zoom(factor, at = [this.width / 2, this.middle]) {
    const scale = Math.min(CLOSEST, Math.max(1, this.scale * factor));
    const [dx, dy] = [at[0] - this.width / 2, at[1] - this.middle];
    const [right, up] = this.axes();
    const change = 1 / this.scale - 1 / scale;
    this.fit = "";
    this.target = this.target.map((value, k) => value + (dx * right[k] - dy * up[k]) * change);
    this.scale = scale;
    this.changed();
  }
}
