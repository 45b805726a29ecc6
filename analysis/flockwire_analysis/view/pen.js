"use strict";
// Strokes and colours that all drawings share.

const NAMED = ["ink", "muted", "line", "card", "bad", "good", "accent", "warn", "c0", "c1", "c2", "c3", "c4", "c5"];

// The page's colours, of the light or the dark scheme.
const palette = {
  followers: [],
  read() {
    const found = getComputedStyle(document.documentElement);
    for (const name of NAMED) this[name] = found.getPropertyValue(`--${name}`).trim();
    this.isDark = matchMedia("(prefers-color-scheme: dark)").matches;
  },
  // Return a drone's colour, the same as in the figures (drawing.py); leaders have the ink's.
  drone(id) {
    const place = this.followers.indexOf(id);
    if (place < 0) return this.ink;
    if (this.followers.length <= 6) return this[`c${place}`];
    return `hsl(${(360 * place) / this.followers.length} 65% ${(this.isDark ? 58 : 36) + 14 * (place % 2)}%)`;
  },
};

// Empty a canvas, with as many pixels as the screen has there; return its pen, whose unit is a pixel of the page.
function emptyPen(canvas, width = canvas.clientWidth, height = canvas.clientHeight) {
  const ratio = devicePixelRatio || 1;
  const size = { width: Math.round(width * ratio), height: Math.round(height * ratio) };
  if (canvas.width !== size.width || canvas.height !== size.height) Object.assign(canvas, size);
  const pen = canvas.getContext("2d");
  pen.setTransform(canvas.width / width, 0, 0, canvas.height / height, 0, 0);
  pen.clearRect(0, 0, width, height);
  return pen;
}

function arrow(pen, [x0, y0], [x1, y1], colour) {
  const length = Math.hypot(x1 - x0, y1 - y0) || 1;
  const [ux, uy] = [(x1 - x0) / length, (y1 - y0) / length];
  const [tipX, tipY] = [x1 - 10 * ux, y1 - 10 * uy];
  shape(pen, [[x0, y0], [tipX, tipY]], colour, [], false, 1, 1);
  const [baseX, baseY] = [tipX - 7 * ux, tipY - 7 * uy];
  polygon(pen, [[tipX, tipY], [baseX + 3.5 * uy, baseY - 3.5 * ux], [baseX - 3.5 * uy, baseY + 3.5 * ux]], colour);
}

// Draw a line through points in pixels; null interrupts it.
function shape(pen, points, stroke, dash, closed, alpha = 1, width = 1.6) {
  if (points.length < 2) return;
  const before = pen.globalAlpha;
  pen.beginPath();
  points.forEach((point, k) => point && (points[k - 1] ? pen.lineTo(...point) : pen.moveTo(...point)));
  if (closed) pen.closePath();
  pen.globalAlpha = before * alpha;
  pen.strokeStyle = stroke;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  pen.stroke();
  pen.setLineDash([]);
  pen.globalAlpha = before;
}

function polygon(pen, points, fill, alpha = 1) {
  const before = pen.globalAlpha;
  pen.beginPath();
  points.forEach((point, k) => (k ? pen.lineTo(...point) : pen.moveTo(...point)));
  pen.closePath();
  pen.globalAlpha = before * alpha;
  pen.fillStyle = fill;
  pen.fill();
  pen.globalAlpha = before;
}

function disc(pen, [x, y], radius, fill, edge = null) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fillStyle = fill;
  pen.fill();
  if (edge) ring(pen, [x, y], radius, edge, [], 1.5);
}

function ring(pen, [x, y], radius, stroke, dash, width) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.strokeStyle = stroke;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  pen.stroke();
  pen.setLineDash([]);
}
