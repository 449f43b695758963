// Strips of numbers over time. A field of any topic, or the residuals of a vehicle's fixes.

import {age, clock, deg, el, set, shade} from "./words.js";

const MOST_SAMPLES = 60000, FAST_MS = 100, RESIDUAL = /^(.+): residual (x|y|heading)$/;
const AXES = {x: [0, 1000, "mm"], y: [1, 1000, "mm"], heading: [2, 180 / Math.PI, "deg"]};
const MARKS = {fault: "--bad", stop: "--bad", failure: "--warn", request: "--accent", marker: "--good", mode: "--faint"};

export class Charts {
  constructor(link) {
    this.link = link;
    this.strips = new Map();
    this.events = [];
    this.fixes = [];
    this.isPaused = false;
    this.window = null;                    // [from, to] in s where a person has zoomed; null follows the present
    this.now = 0;
    const by = (id) => document.getElementById(id);
    by("add-field").onclick = () => this.addTyped();
    by("field").onkeydown = (event) => { if (event.key === "Enter") this.addTyped(); };
    by("span").onchange = () => { this.window = null; this.draw(); };
    by("pause").onclick = () => this.pause(!this.isPaused);
    by("export-csv").onclick = () => this.saveCsv();
    by("export-png").onclick = () => this.savePng();
    setInterval(() => { if (!this.isPaused && !this.window) this.draw(); }, FAST_MS);
    new ResizeObserver(() => this.resize()).observe(by("strips"));
  }

  page(rig, isLive) {
    this.rig = rig;
    this.isLive = isLive;
    if (!this.strips.size) {
      const first = Object.keys(rig.vehicles)[0];
      const kept = JSON.parse(localStorage.getItem("charts") || "null");
      for (const name of kept ?? [`${first}/state.position_table_m[0]`, `${first}/state.position_table_m[1]`, `${first}: residual x`]) this.add(name);
    }
    this.learn();
  }

  async learn() {
    try {
      const topics = await (await fetch("/api/topics")).json();
      const residuals = Object.keys(this.rig.vehicles).flatMap((name) => Object.keys(AXES).map((axis) => `${name}: residual ${axis}`));
      this.known = [...residuals, ...topics.flatMap((topic) => topic.fields)];
      document.getElementById("fields").replaceChildren(...this.known.map((name) => el("option", {value: name})));
    } catch { this.known = this.known ?? []; }
  }

  async addTyped() {
    await this.learn();                    // topics come with a flight, not before it
    const field = document.getElementById("field"), wanted = field.value.trim();
    if (!wanted) return;
    const exact = (this.known ?? []).find((name) => name === wanted);
    const near = exact ?? (this.known ?? []).find((name) => name.toLowerCase().includes(wanted.toLowerCase()));
    if (!near) { this.say(`no field is called ${wanted}`); return; }
    this.add(near);
    field.value = "";
    this.say(exact ? "" : `added ${near}`);
  }

  add(name) {
    if (this.strips.has(name)) return;
    const strip = new Strip(name, this);
    this.strips.set(name, strip);
    document.getElementById("strips").append(strip.box);
    this.tell();
    this.draw();
  }

  remove(name) {
    this.strips.get(name).box.remove();
    this.strips.delete(name);
    this.tell();
  }

  tell() {
    const names = [...this.strips.keys()];
    localStorage.setItem("charts", JSON.stringify(names));
    this.link.wish("charts", {type: "charts", fields: names.filter((name) => !RESIDUAL.test(name))});
  }

  take(fields) { for (const field of fields) this.strips.get(field.name)?.take(field.times, field.values, field.whole); }
  state(state) { this.now = state.now_ns * 1e-9; }

  event(event) {
    if (event.kind === "fix") { this.fixes.push(event); if (this.fixes.length > 8000) this.fixes.splice(0, 2000); }
    else if (MARKS[event.kind]) { this.events.push(event); if (this.events.length > 2000) this.events.splice(0, 500); }
  }

  pause(on) {
    this.isPaused = on;
    const button = document.getElementById("pause");
    button.setAttribute("aria-pressed", on);
    set(button, on ? "Go on" : "Pause");
    if (on) this.window = this.window ?? this.range(); else this.window = null;
    this.draw();
  }

  range() {
    if (this.window) return this.window;
    const span = Number(document.getElementById("span").value);
    return this.isLive ? [this.now - span, this.now] : [this.now - span / 2, this.now + span / 2];
  }

  zoom(from, to) { this.window = [from, to]; this.isPaused = true; this.pauseShown(); this.draw(); }
  pauseShown() { const button = document.getElementById("pause"); button.setAttribute("aria-pressed", "true"); set(button, "Go on"); }
  say(text) { set(document.getElementById("chart-tip"), text); }

  draw() {
    if (document.getElementById("screen-charts").hidden) return;
    const range = this.range();
    for (const strip of this.strips.values()) strip.draw(range);
  }
  resize() { for (const strip of this.strips.values()) strip.resize(); }

  saveCsv() {
    const [from, to] = this.range(), rows = [];
    for (const strip of this.strips.values()) for (const [t, value, note] of strip.rows(from, to)) rows.push([t, strip.name, value, note]);
    rows.sort((a, b) => a[0] - b[0]);
    const text = ["t_s,field,value,note", ...rows.map(([t, name, value, note]) => `${t.toFixed(6)},"${name}",${value},"${(note ?? "").replaceAll('"', "'")}"`)].join("\n");
    save(new Blob([`${text}\n`], {type: "text/csv"}), "charts.csv");
  }

  savePng() {
    const canvases = [...this.strips.values()].map((strip) => [strip.name, strip.plot?.ctx.canvas]).filter(([, canvas]) => canvas);
    if (!canvases.length) return;
    const width = Math.max(...canvases.map(([, canvas]) => canvas.width)), title = 28;
    const whole = el("canvas", {width, height: canvases.reduce((sum, [, canvas]) => sum + canvas.height + title, 0)});
    const g = whole.getContext("2d");
    g.fillStyle = shade("--card"); g.fillRect(0, 0, whole.width, whole.height);
    g.font = "16px system-ui";
    let y = 0;
    for (const [name, canvas] of canvases) { g.fillStyle = shade("--ink"); g.fillText(name, 8, y + 20); g.drawImage(canvas, 0, y + title); y += canvas.height + title; }
    whole.toBlob((blob) => save(blob, "charts.png"));
  }
}

class Strip {
  constructor(name, charts) {
    this.name = name;
    this.charts = charts;
    this.residual = RESIDUAL.exec(name);
    this.times = new Float64Array(1024); this.values = new Float64Array(1024); this.count = 0;
    this.value = el("span", {class: "small"});
    this.room = el("div");
    this.box = el("div", {class: "strip"}, el("div", {class: "name"}, el("span", {}, name), el("span", {}, this.value, " ", el("button", {"aria-label": `Remove ${name}`, onclick: () => charts.remove(name)}, "×"))), this.room);
  }

  take(times, values, isWhole) {
    if (isWhole) this.count = 0;
    if (this.count && times.length && times[0] < this.times[this.count - 1] - 1) this.count = 0;      // a replay went back
    if (this.count + times.length > MOST_SAMPLES) { const from = Math.floor(MOST_SAMPLES / 4); this.times.copyWithin(0, from, this.count); this.values.copyWithin(0, from, this.count); this.count -= Math.min(from, this.count); }
    while (this.times.length < this.count + times.length) { this.times = grown(this.times); this.values = grown(this.values); }
    this.times.set(times, this.count); this.values.set(values, this.count); this.count += times.length;
  }

  data([from, to]) {
    if (this.residual) {
      const [, vehicle, axis] = this.residual, [place, factor] = AXES[axis];
      this.points = this.charts.fixes.filter((fix) => fix.vehicle === vehicle && fix.t_s >= from && fix.t_s <= to && Number.isFinite(fix.innovation?.[place]));
      return [this.points.map((fix) => fix.t_s), this.points.map((fix) => fix.innovation[place] * factor)];
    }
    let low = 0, high = this.count;
    while (low < high) { const middle = low + high >> 1; if (this.times[middle] < from) low = middle + 1; else high = middle; }
    let stop = this.count;
    while (stop > low && this.times[stop - 1] > to) stop--;
    const every = Math.max(1, Math.ceil((stop - low) / 4000));
    const times = [], values = [];
    for (let i = Math.max(low - 1, 0); i < stop; i += every) { times.push(this.times[i]); values.push(this.values[i]); }
    return [times, values];
  }

  rows(from, to) {
    if (this.residual) { const [times, values] = this.data([from, to]); return times.map((t, i) => [t, values[i], this.points[i].used ? "used" : `refused: ${this.points[i].reason}`]); }
    const found = [];
    for (let i = 0; i < this.count; i++) if (this.times[i] >= from && this.times[i] <= to) found.push([this.times[i], this.values[i]]);
    return found;
  }

  draw(range) {
    const data = this.data(range);
    if (!this.plot) this.make(data);
    this.shown = range;
    this.plot.setData(data, false);
    this.plot.setScale("x", {min: range[0], max: range[1]});
    const last = data[1].at(-1);
    set(this.value, last === undefined ? "nothing in this span" : `${Number(last.toPrecision(6))}${this.residual ? ` ${AXES[this.residual[2]][2]}` : ""}`);
  }

  make(data) {
    const ink = shade("--faint"), axis = {stroke: ink, grid: {stroke: shade("--grid"), width: 1}, ticks: {stroke: shade("--grid")}, font: "11px system-ui"};
    const since = (t) => this.charts.isLive ? `${(t - this.charts.now).toFixed(0)} s` : clock(t - this.charts.rig.replay.start_s);
    this.plot = new uPlot({
      width: this.width(), height: 150, legend: {show: false}, cursor: {drag: {x: true, y: false}, y: false},
      scales: {x: {time: false, auto: false}, y: {range: (u, low, high) => this.yRange(low, high)}},
      axes: [{...axis, values: (u, splits) => splits.map(since), size: 28}, {...axis, size: 62}],
      series: [{}, {stroke: shade("--a"), width: 1.5, points: {show: false}, paths: this.residual ? () => null : undefined}],
      hooks: {draw: [(u) => this.marks(u)], setSelect: [(u) => this.select(u)], setCursor: [(u) => this.hover(u)]},
    }, data, this.room);
  }

  yRange(low, high) {
    if (low === null || low === undefined) return [-1, 1];
    const wide = Math.max(high - low, 1e-6 * Math.max(Math.abs(low), Math.abs(high)), 1e-12);
    return [low - 0.1 * wide, high + 0.1 * wide];
  }

  marks(u) {
    const g = u.ctx, [from, to] = this.shown ?? [0, 0], top = u.bbox.top, bottom = top + u.bbox.height;
    g.save();
    if (!this.charts.isLive) { const x = Math.round(u.valToPos(this.charts.now, "x", true)); g.fillStyle = shade("--faint"); g.fillRect(x, top, 1, bottom - top); }
    g.beginPath(); g.rect(u.bbox.left, top, u.bbox.width, u.bbox.height); g.clip();
    for (const event of this.charts.events) {
      if (event.t_s < from || event.t_s > to) continue;
      const x = Math.round(u.valToPos(event.t_s, "x", true)) + 0.5;
      g.strokeStyle = shade(MARKS[event.kind]); g.lineWidth = event.kind === "fault" ? 2 : 1; g.beginPath(); g.moveTo(x, top); g.lineTo(x, bottom); g.stroke();
    }
    if (this.residual) this.fixes(u, g);
    g.restore();
  }

  fixes(u, g) {
    const [place, factor] = AXES[this.residual[2]], ratio = window.devicePixelRatio || 1;
    for (const fix of this.points ?? []) {
      const x = u.valToPos(fix.t_s, "x", true), y = u.valToPos(fix.innovation[place] * factor, "y", true);
      if (fix.sigma) {
        const half = Math.abs(u.valToPos(fix.sigma[place] * factor, "y", true) - u.valToPos(0, "y", true)), zero = u.valToPos(0, "y", true);
        g.strokeStyle = shade("--faint"); g.lineWidth = ratio; g.beginPath(); g.moveTo(x, zero - half); g.lineTo(x, zero + half); g.stroke();
      }
      g.beginPath();
      if (fix.used) { g.fillStyle = shade("--a"); g.arc(x, y, 3 * ratio, 0, 7); g.fill(); }
      else { const r = 4 * ratio; g.strokeStyle = shade("--bad"); g.lineWidth = 2 * ratio; g.moveTo(x - r, y - r); g.lineTo(x + r, y + r); g.moveTo(x - r, y + r); g.lineTo(x + r, y - r); g.stroke(); }
    }
  }

  select(u) {
    if (u.select.width < 5) return;
    this.charts.zoom(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
    u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
  }

  hover(u) {
    if (u.cursor.left < 0) return;
    const t = u.posToVal(u.cursor.left, "x"), within = 8 * (this.shown[1] - this.shown[0]) / Math.max(u.width, 1);
    const event = this.charts.events.findLast((each) => Math.abs(each.t_s - t) < within);
    if (event) { this.charts.say(`${event.vehicle || "rig"}, ${event.kind}: ${event.text ?? `${event.action} ${event.arguments} (${event.author})`}`); return; }
    const fix = this.residual && (this.points ?? []).reduce((best, each) => !best || Math.abs(each.t_s - t) < Math.abs(best.t_s - t) ? each : best, null);
    if (fix && Math.abs(fix.t_s - t) < within) this.charts.say(`fix of ${fix.source}: ${fix.used ? "used" : `refused: ${fix.reason}`}; ${fix.innovation.slice(0, 2).map((m) => `${(1000 * m).toFixed(1)} mm`).join(", ")}, ${deg(fix.innovation[2]).toFixed(2)} deg; nis ${fix.nis?.toFixed(1) ?? "–"}; ${age(fix.age_s_then)} old`);
  }

  width() { return Math.max(200, (document.getElementById("strips").clientWidth || 600) - 14); }
  resize() { this.plot?.setSize({width: this.width(), height: 150}); }
}

function grown(array) { const larger = new Float64Array(2 * array.length); larger.set(array); return larger; }

export function save(blob, name) {
  const url = URL.createObjectURL(blob), link = el("a", {href: url, download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}
