"use strict";
// Curves of all drones over time, with marks and a cursor; what does not move is drawn once.

const ROOM = { left: 46, right: 8, top: 20, bottom: 18 }; // pixels round the axes
const FLOOR = 1e-3; // m, the lower end of a logarithmic axis
const INSET = 8; // pixels between a slider's end and its first value
const COLUMN = 1.5; // pixels that share one point of a curve, its largest value

class Chart {
  // `told` has title, log (whether its axis is logarithmic), and seek(time), called for a click.
  constructor(canvas, told) {
    Object.assign(this, { canvas, told, still: document.createElement("canvas"), key: "", version: 0 });
    this.show([], [], [0, 1]);
    const seek = (event) => {
      const share = (event.offsetX - ROOM.left) / (canvas.clientWidth - ROOM.left - ROOM.right);
      this.told.seek?.(this.span[0] + Math.min(1, Math.max(0, share)) * (this.span[1] - this.span[0]));
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      seek(event);
    });
    canvas.addEventListener("pointermove", (event) => event.buttons && seek(event));
  }

  // `curves`: {id, times, values (null: unknown)}; `marks`: {t, kind}; `span`: first and last time, s.
  show(curves, marks, span) {
    Object.assign(this, { curves, marks, span });
    this.version += 1;
  }

  x(time) {
    return ROOM.left + ((time - this.span[0]) / (this.span[1] - this.span[0] || 1)) * (this.width - ROOM.left - ROOM.right);
  }

  y(value) {
    const [low, high] = this.range;
    const share = this.told.log
      ? Math.log(Math.max(value, low) / low) / Math.log(high / low)
      : (value - low) / (high - low);
    return this.height - ROOM.bottom - share * (this.height - ROOM.top - ROOM.bottom);
  }

  draw(now, selected) {
    [this.width, this.height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (!this.width || !this.height) return;
    const key = [this.width, this.height, devicePixelRatio, palette.ink, selected, this.version].join();
    if (key !== this.key) {
      this.background(emptyPen(this.still, this.width, this.height), selected);
      this.key = key;
    }
    const pen = emptyPen(this.canvas);
    pen.drawImage(this.still, 0, 0, this.width, this.height);
    if (now === null) return;
    const x = this.x(now);
    shape(pen, [[x, ROOM.top - 4], [x, this.height - ROOM.bottom]], palette.ink, [], false, 1, 1.5);
  }

  background(pen, selected) {
    this.range = this.limits();
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = palette.ink;
    pen.fillText(this.told.title, ROOM.left, 13);
    this.ticks(pen);
    for (const { t, kind } of this.marks) {
      if (t < this.span[0] || t > this.span[1]) continue;
      shape(pen, [[this.x(t), ROOM.top - 4], [this.x(t), this.height - ROOM.bottom]], markColour(kind), [2, 3], false, 0.9, 1.2);
    }
    const order = [...this.curves].sort((a, b) => (a.id === selected) - (b.id === selected));
    for (const { id, times, values } of order) {
      const faint = selected !== null && id !== selected;
      shape(pen, this.thinned(times, values), palette.drone(id), [], false, faint ? 0.2 : 0.9, id === selected ? 2.2 : 1.4);
    }
  }

  // Return the curve's points in pixels: the largest value of each column, null where it is interrupted.
  thinned(times, values) {
    const points = [];
    let [column, best] = [-1, null];
    for (let k = 0; k < times.length; k += 1) {
      if (times[k] < this.span[0] || times[k] > this.span[1]) continue;
      const at = Math.floor(this.x(times[k]) / COLUMN);
      if (values[k] === null || at !== column) {
        if (best !== null) points.push([column * COLUMN, this.y(best)]);
        if (values[k] === null && points.at(-1)) points.push(null);
        [column, best] = [at, values[k]];
      } else best = best === null ? values[k] : Math.max(best, values[k]);
    }
    if (best !== null) points.push([column * COLUMN, this.y(best)]);
    return points;
  }

  limits() {
    const known = this.curves.flatMap(({ values }) => values.filter((value) => value !== null));
    const high = known.reduce((a, b) => Math.max(a, b), this.told.log ? 0.2 : 1);
    if (this.told.log) return [FLOOR, 1.5 * high];
    const low = known.reduce((a, b) => Math.min(a, b), 0);
    return [low, low + 1.08 * (high - low)];
  }

  ticks(pen) {
    const [low, high] = this.range;
    pen.fillStyle = palette.muted;
    pen.textAlign = "right";
    for (const value of this.told.log ? [0.001, 0.01, 0.1, 1, 10, 100] : spaced(low, high, 4)) {
      if (value > high) break;
      const y = this.y(value);
      shape(pen, [[ROOM.left, y], [this.width - ROOM.right, y]], palette.line, [], false, 1, 1);
      pen.fillText(this.told.log ? inUnit(value) : `${value} m`, ROOM.left - 5, y + 4);
    }
    pen.textAlign = "center";
    for (const time of spaced(...this.span, this.width / 90)) {
      const x = this.x(time);
      shape(pen, [[x, this.height - ROOM.bottom], [x, this.height - ROOM.bottom + 3]], palette.muted, [], false, 1, 1);
      if (x < this.width - 14) pen.fillText(`${time} s`, x, this.height - 4);
    }
    pen.textAlign = "start";
  }
}

// Return a power of ten in m in the unit that suits it.
function inUnit(value) {
  if (value < 0.01) return `${1000 * value} mm`;
  return value < 1 ? `${100 * value} cm` : `${value} m`;
}

// Return round numbers between `low` and `high`, about `count` of them.
function spaced(low, high, count) {
  const rough = Math.max((high - low) / Math.max(1, count), 1e-9);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((one) => one * power >= rough);
  const first = Math.ceil(low / step - 1e-9);
  const length = Math.max(0, Math.floor(high / step + 1e-9) - first + 1);
  return Array.from({ length }, (_, k) => Number(((first + k) * step).toFixed(6)));
}

const MARKS = { order: "accent", phase: "muted", rung: "warn" }; // others: bad

function markColour(kind) {
  return palette[MARKS[kind] ?? "bad"];
}

// Draw the marks below a slider; `share` is where on it a time is, from 0 to 1.
function strip(canvas, marks, share) {
  const pen = emptyPen(canvas);
  const width = canvas.clientWidth;
  for (const { t, kind } of marks) {
    pen.fillStyle = markColour(kind);
    pen.fillRect(INSET + share(t) * (width - 2 * INSET) - 1, kind === "phase" ? 4 : 0, 2, 10);
  }
}
