// A drawing as the console sends it (plain numbers) on a canvas: curves, dots, crosses, bars of sigma.

import {colour, el, shade} from "./words.js";

const LEFT = 62, RIGHT = 12, TOP = 10, BOTTOM = 34, DOT = 2.6, TICKS = 5;

export class Picture {
  constructor() {
    this.canvas = el("canvas", {role: "img"});
    this.title = el("h3");
    this.legend = el("div", {class: "wizard-legend small"});
    this.node = el("figure", {class: "wizard-picture"}, this.title, this.canvas, this.legend);
  }

  show(drawing) {
    this.drawing = drawing;
    this.title.textContent = drawing.title;
    const drawn = drawing.curves.filter((curve) => curve.x.length);
    this.canvas.setAttribute("aria-label", `${drawing.title}: ${drawn.length ? drawn.map((c) => `${c.name}, ${c.x.length} points`).join("; ") : "nothing yet"}`);
    const key = drawing.curves.map((curve) => `${curve.name}${curve.mark}`).join();
    if (key !== this.key) {
      this.key = key;
      this.legend.replaceChildren(...drawing.curves.map((curve, i) =>
        el("span", {}, el("i", {style: `background:${hue(curve, i)}`, "aria-hidden": "true"}), `${{crosses: "+ ", refused: "× "}[curve.mark] ?? ""}${curve.name}`)));
    }
    this.draw();
  }

  draw() {
    const {canvas, drawing} = this, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!drawing || !width) return;
    const scale = devicePixelRatio || 1, g = canvas.getContext("2d");
    canvas.width = width * scale; canvas.height = height * scale;
    g.scale(scale, scale);
    g.font = "11px system-ui";
    const curves = drawing.curves.filter((curve) => curve.x.length);
    if (!curves.length) { g.fillStyle = shade("--faint"); g.fillText("nothing received yet", LEFT, height / 2); return; }
    const axes = frame(drawing, curves, width - LEFT - RIGHT, height - TOP - BOTTOM);
    grid(g, drawing, axes, width, height);
    g.save();
    g.beginPath(); g.rect(LEFT, TOP, width - LEFT - RIGHT, height - TOP - BOTTOM); g.clip();
    drawing.curves.forEach((curve, i) => one(g, curve, axes, hue(curve, i)));
    g.restore();
  }
}

function hue(curve, index) { return curve.mark === "refused" ? shade("--bad") : colour(index); }

function span(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
  if (!(low <= high)) return [0, 1];
  const room = (high - low) * 0.05 || Math.abs(high) * 0.05 || 1;
  return [low - room, high + room];
}

function frame(drawing, curves, width, height) {
  let [x0, x1] = span(curves.flatMap((curve) => curve.x)), [y0, y1] = span(curves.flatMap((curve) => curve.y));
  if (drawing.to_scale) {
    const metres = Math.max((x1 - x0) / width, (y1 - y0) / height), x = (x0 + x1) / 2, y = (y0 + y1) / 2;
    [x0, x1, y0, y1] = [x - metres * width / 2, x + metres * width / 2, y - metres * height / 2, y + metres * height / 2];
  }
  if (drawing.downwards) [y0, y1] = [y1, y0];
  return {x0, x1, y0, y1, u: (x) => LEFT + (x - x0) / (x1 - x0) * width, v: (y) => TOP + height - (y - y0) / (y1 - y0) * height};
}

function grid(g, drawing, axes, width, height) {
  g.strokeStyle = shade("--grid"); g.fillStyle = shade("--faint"); g.lineWidth = 1;
  g.textAlign = "center";
  for (const x of ticks(axes.x0, axes.x1)) { line(g, axes.u(x), TOP, axes.u(x), height - BOTTOM); g.fillText(plain(x), axes.u(x), height - BOTTOM + 13); }
  g.textAlign = "right";
  for (const y of ticks(Math.min(axes.y0, axes.y1), Math.max(axes.y0, axes.y1))) { line(g, LEFT, axes.v(y), width - RIGHT, axes.v(y)); g.fillText(plain(y), LEFT - 5, axes.v(y) + 4); }
  g.textAlign = "center";
  g.fillText(drawing.x_label, (LEFT + width - RIGHT) / 2, height - 4);
  g.save(); g.translate(11, (TOP + height - BOTTOM) / 2); g.rotate(-Math.PI / 2); g.fillText(drawing.y_label, 0, 0); g.restore();
}

function line(g, u0, v0, u1, v1) { g.beginPath(); g.moveTo(u0, v0); g.lineTo(u1, v1); g.stroke(); }

function ticks(low, high) {
  const rough = (high - low) / TICKS, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((each) => each * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k += 1) found.push(k * step);
  return found;
}

function plain(value) { return String(Number(value.toPrecision(4))); }

function one(g, curve, axes, style) {
  g.strokeStyle = g.fillStyle = style; g.lineWidth = 1.4;
  if (curve.mark === "line") {
    g.beginPath();
    curve.x.forEach((x, i) => { if (curve.y[i] === null) return; if (i && curve.y[i - 1] !== null) g.lineTo(axes.u(x), axes.v(curve.y[i])); else g.moveTo(axes.u(x), axes.v(curve.y[i])); });
    g.stroke();
    return;
  }
  curve.x.forEach((x, i) => {
    const y = curve.y[i];
    if (y === null || x === null) return;
    const u = axes.u(x), v = axes.v(y), sigma = curve.sigma[i];
    if (sigma) line(g, u, axes.v(y - sigma), u, axes.v(y + sigma));
    if (curve.mark === "dots") { g.beginPath(); g.arc(u, v, DOT, 0, 7); g.fill(); }
    else if (curve.mark === "refused") { line(g, u - 4, v - 4, u + 4, v + 4); line(g, u - 4, v + 4, u + 4, v - 4); }
    else { line(g, u - 5, v, u + 5, v); line(g, u, v - 5, u, v + 5); }
  });
}
