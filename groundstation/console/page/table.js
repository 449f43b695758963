// The table from above: what is where, where it goes, what it could still do.

import {colour, deg, el, number, set, shade} from "./words.js";

const TRAIL_S = 40, ELLIPSE_TIMES = 10, SIGMAS = 3, MARGIN_M = 0.15, DRAG_PX = 12;
const LAYERS = [
  ["trails", "Trails", true], ["goals", "Goals", true], ["stars", "Stars and views", false], ["pull", "Table map", false],
  ["overhead", "Overhead", true], ["reference", "Reference", false], ["links", "Formation", true],
];

export class TableView {
  constructor(wanted) {
    this.wanted = wanted;                 // called with {x_m, y_m, heading_rad} that a person points at
    this.canvas = document.getElementById("table");
    this.poses = document.getElementById("poses");
    this.layers = Object.fromEntries(LAYERS.map(([key, , on]) => [key, on]));
    this.trails = {};
    this.chosen = "";
    this.ahead = null;                    // a flight flown ahead: {paths, goal}
    this.pointed = null;
    this.said = 0;
    document.getElementById("layers").append(...LAYERS.map(([key, name, on]) => el("label", {class: "layer"},
      el("input", {type: "checkbox", checked: on, onchange: (event) => { this.layers[key] = event.target.checked; this.draw(); }}), name)));
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas.parentElement);
  }

  page(rig, is_live) {
    this.rig = rig;
    this.names = Object.keys(rig.vehicles);
    this.chosen = this.chosen || this.names[0];
    set(document.getElementById("table-hint"), is_live
      ? `A tap on a mock-up chooses it; a tap on the table is a goal for it, a drag gives the goal's heading. Ellipses: ${SIGMAS} sigma, ${ELLIPSE_TIMES} times enlarged.`
      : "A recording: nothing can be asked for.");
    this.draw();
  }

  state(state) {
    this.now = state;
    for (const [name, vehicle] of Object.entries(state.vehicles)) {
      if (vehicle.x_m === undefined) continue;
      const trail = this.trails[name] ??= [], last = trail.at(-1), t = vehicle.stamp_ns * 1e-9;
      if (last && t < last[0]) trail.length = 0;                  // a replay went back
      if (!last || t - last[0] > 0.1) trail.push([t, vehicle.x_m, vehicle.y_m]);
      while (trail.length && t - trail[0][0] > TRAIL_S) trail.shift();
    }
    if (performance.now() - this.said > 500) this.say();
    this.draw();
  }

  say() {
    this.said = performance.now();
    set(this.poses, Object.entries(this.now.vehicles).map(([name, v]) => v.x_m === undefined ? `${name}: no pose yet`
      : `${name} at x ${v.x_m.toFixed(2)} m, y ${v.y_m.toFixed(2)} m, heading ${deg(v.heading_rad).toFixed(0)} deg`).join("; "));
  }

  // from the table's metres to pixels of the canvas
  place() {
    const [x0, x1] = this.rig.table.x_m, [y0, y1] = this.rig.table.y_m;
    const width = this.canvas.parentElement.clientWidth, room = Math.max(220, window.innerHeight - 250);
    const wide = x1 - x0 + 2 * MARGIN_M, high = y1 - y0 + 2 * MARGIN_M;
    this.scale = Math.min(width / wide, room / high);
    const ratio = window.devicePixelRatio || 1, w = Math.round(width), h = Math.round(high * this.scale);
    if (this.canvas.width !== w * ratio || this.canvas.height !== h * ratio) {
      this.canvas.width = w * ratio; this.canvas.height = h * ratio; this.canvas.style.height = `${h}px`;
    }
    this.left = (w - (x1 - x0) * this.scale) / 2 - x0 * this.scale;
    this.top = h / 2 + (y0 + y1) / 2 * this.scale;
    return ratio;
  }
  at(x, y) { return [this.left + x * this.scale, this.top - y * this.scale]; }
  back(px, py) { return [(px - this.left) / this.scale, (this.top - py) / this.scale]; }

  draw() {
    if (this.queued) return;
    this.queued = true;
    requestAnimationFrame(() => { this.queued = false; if (this.rig && this.canvas.offsetParent) this.paint(); });
  }

  paint() {
    const ratio = this.place(), g = this.g = this.canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.ground();
    if (this.layers.pull && this.rig.table.pull) this.pull();
    if (!this.now) return;
    const all = Object.entries(this.now.vehicles);
    if (this.layers.stars) this.sky(all);
    if (this.layers.links) this.links();
    all.forEach(([name, v], i) => { if (this.layers.trails) this.line(this.trails[name] ?? [], colour(i), 1.5, 0.6, 1); });
    if (this.ahead) this.names.forEach((name, i) => this.line(this.ahead.paths[name] ?? [], colour(i), 2, 1, 1, [6, 5]));
    all.forEach(([name, v], i) => this.vehicle(name, v, colour(i)));
    for (const [name, pose] of Object.entries(this.now.ghosts ?? {})) this.outline(pose, shade("--faint"), this.rig.vehicles[name]?.radius_m ?? 0.2, [3, 3]);
    if (this.pointed) this.goal(this.pointed, shade("--ink"), true);
    window.shownStamp = all[0]?.[1].stamp_ns;   // for whoever measures how old a picture is
  }

  ground() {
    const g = this.g, [x0, x1] = this.rig.table.x_m, [y0, y1] = this.rig.table.y_m;
    g.strokeStyle = shade("--grid"); g.lineWidth = 1; g.beginPath();
    for (let x = Math.ceil(x0 * 2) / 2; x <= x1; x += 0.5) { g.moveTo(...this.at(x, y0)); g.lineTo(...this.at(x, y1)); }
    for (let y = Math.ceil(y0 * 2) / 2; y <= y1; y += 0.5) { g.moveTo(...this.at(x0, y)); g.lineTo(...this.at(x1, y)); }
    g.stroke();
    const [px, py] = this.at(x0, y1);
    g.strokeStyle = shade("--faint"); g.lineWidth = 2; g.strokeRect(px, py, (x1 - x0) * this.scale, (y1 - y0) * this.scale);
    g.fillStyle = shade("--faint"); g.font = "12px system-ui";
    const [ox, oy] = this.at(0, 0);
    g.beginPath(); g.moveTo(ox, oy); g.lineTo(ox + 24, oy); g.moveTo(ox, oy); g.lineTo(ox, oy - 24); g.stroke();
    g.fillText("x", ox + 28, oy + 4); g.fillText("y", ox - 4, oy - 28);
    for (const place of this.rig.table.keep_out) {
      const [cx, cy] = this.at(place.x_m, place.y_m);
      g.beginPath(); g.arc(cx, cy, place.radius_m * this.scale, 0, 7); g.globalAlpha = 0.25; g.fillStyle = shade("--bad"); g.fill();
      g.globalAlpha = 1; g.strokeStyle = shade("--bad"); g.stroke(); g.fillStyle = shade("--ink"); g.textAlign = "center"; g.fillText(place.name, cx, cy + 4); g.textAlign = "start";
    }
  }

  pull() {
    const {x_m, y_m, pull_m_s2} = this.rig.table.pull, g = this.g;
    const most = Math.max(...pull_m_s2.map(([a, b]) => Math.hypot(a, b)), 1e-9), step = 0.8 * (x_m[1] - x_m[0]);
    g.strokeStyle = shade("--warn"); g.lineWidth = 1; g.beginPath();
    y_m.forEach((y, row) => x_m.forEach((x, column) => {
      const [ax, ay] = pull_m_s2[row * x_m.length + column];
      g.moveTo(...this.at(x, y)); g.lineTo(...this.at(x + ax / most * step, y + ay / most * step));
      g.moveTo(...this.at(x + 0.01, y)); g.arc(...this.at(x, y), 1.5, 0, 7);
    }));
    g.stroke();
    g.fillStyle = shade("--warn"); g.fillText(`longest arrow: ${(most * 1000).toFixed(1)} mm/s²`, 8, 16);
  }

  sky(all) {
    const g = this.g;
    all.forEach(([name, v], i) => {
      const sky = this.rig.vehicles[name].stars;
      if (!sky) return;
      if (i === 0) { g.fillStyle = shade("--faint"); for (const [x, y] of sky.places_m) { const [px, py] = this.at(x, y); g.fillRect(px - 1, py - 1, 2.5, 2.5); } }
      if (v.x_m === undefined) return;
      const c = Math.cos(v.heading_rad), s = Math.sin(v.heading_rad);
      g.beginPath();
      for (const [bx, by] of sky.view_body_m) g.lineTo(...this.at(v.x_m + c * bx - s * by, v.y_m + s * bx + c * by));
      g.closePath(); g.strokeStyle = colour(i); g.lineWidth = 1; g.setLineDash([2, 4]); g.stroke(); g.setLineDash([]);
    });
  }

  links() {
    const g = this.g;
    for (const name of this.names) for (const other of this.rig.vehicles[name].neighbours) {
      const a = this.now.vehicles[name], b = this.now.vehicles[other];
      if (a?.x_m === undefined || b?.x_m === undefined) continue;
      const [ax, ay] = this.at(a.x_m, a.y_m), [bx, by] = this.at(b.x_m, b.y_m);
      g.strokeStyle = shade("--faint"); g.lineWidth = 1; g.setLineDash([1, 4]); g.beginPath(); g.moveTo(ax, ay); g.lineTo(bx, by); g.stroke(); g.setLineDash([]);
      g.fillStyle = shade("--faint"); g.fillText(`${Math.hypot(a.x_m - b.x_m, a.y_m - b.y_m).toFixed(3)} m`, (ax + bx) / 2 + 4, (ay + by) / 2);
    }
  }

  line(points, style, width, alpha, first, dash = []) {
    if (points.length < 2) return;
    const g = this.g;
    g.beginPath(); for (const p of points) g.lineTo(...this.at(p[first], p[first + 1]));
    g.strokeStyle = style; g.lineWidth = width; g.globalAlpha = alpha; g.setLineDash(dash); g.stroke(); g.setLineDash([]); g.globalAlpha = 1;
  }

  vehicle(name, v, own) {
    const g = this.g, about = this.rig.vehicles[name];
    if (v.x_m === undefined) return;
    const isStale = v.age_s === null || v.age_s > 0.5, style = isStale ? shade("--faint") : own;
    if (this.layers.goals && v.control && v.control.goal_x_m !== null) this.goal({x_m: v.control.goal_x_m, y_m: v.control.goal_y_m, heading_rad: v.control.goal_heading_rad}, style, false);
    if (this.layers.reference && v.reference) this.outline(v.reference, shade("--good"), about.radius_m, []);
    if (this.layers.overhead && v.overhead && v.overhead[3] < 1) this.cross(...this.at(v.overhead[0], v.overhead[1]), shade("--good"));
    const [px, py] = this.at(v.x_m, v.y_m), r = about.radius_m * this.scale, c = Math.cos(v.heading_rad), s = Math.sin(v.heading_rad);
    g.beginPath(); g.arc(px, py, r, 0, 7); g.fillStyle = shade("--card"); g.globalAlpha = 0.85; g.fill(); g.globalAlpha = 1;
    g.strokeStyle = style; g.lineWidth = name === this.chosen ? 4 : 2; g.stroke();
    g.beginPath(); g.moveTo(px, py); g.lineTo(px + c * r, py - s * r); g.lineWidth = 3; g.stroke();
    this.jets(v, about, px, py, c, s);
    this.ellipse(v, px, py, style);
    this.outlook(v, px, py, r, style);
    g.fillStyle = style; g.font = "600 13px system-ui"; g.textAlign = "center";
    g.fillText(isStale ? `${name} (${number(v.age_s, 1, "s")} old)` : name, px, py + r + 15); g.textAlign = "start"; g.font = "12px system-ui";
  }

  jets(v, about, px, py, c, s) {
    const g = this.g, mask = v.valves?.open_mask ?? 0;
    about.valves.forEach((valve, i) => {
      if (!(mask >> i & 1)) return;
      const [bx, by] = valve.position_body_m, [dx, dy] = valve.direction_body, k = this.scale;
      const x = px + (c * bx - s * by) * k, y = py - (s * bx + c * by) * k;
      const jx = -(c * dx - s * dy), jy = s * dx + c * dy, l = 0.09 * k, w = 0.02 * k;
      g.beginPath(); g.moveTo(x, y); g.lineTo(x + jx * l - jy * w, y + jy * l + jx * w); g.lineTo(x + jx * l + jy * w, y + jy * l - jx * w); g.closePath();
      g.fillStyle = shade("--warn"); g.fill();
    });
  }

  ellipse(v, px, py, style) {
    const [sx, sy] = v.pose_sigma ?? [], g = this.g, k = SIGMAS * ELLIPSE_TIMES * this.scale;
    if (!sx || !sy || sx * k > 2000) return;
    g.beginPath(); g.ellipse(px, py, Math.max(sx * k, 1), Math.max(sy * k, 1), 0, 0, 7); g.strokeStyle = style; g.lineWidth = 1; g.stroke();
  }

  outlook(v, px, py, r, style) {
    const look = v.outlook, [vx, vy] = v.velocity_table_m_s ?? [0, 0], speed = Math.hypot(vx, vy), g = this.g;
    if (!look || look.age_s > 1 || speed < 0.005) return;
    const ux = vx / speed, uy = vy / speed, far = r + (look.stopping_distance_m ?? 0) * this.scale;
    g.beginPath(); g.moveTo(px + ux * r, py - uy * r); g.lineTo(px + ux * far, py - uy * far); g.strokeStyle = style; g.lineWidth = 3; g.stroke();
    g.beginPath(); g.moveTo(px + ux * far - uy * 7, py - uy * far - ux * 7); g.lineTo(px + ux * far + uy * 7, py - uy * far + ux * 7); g.stroke();
    if (look.time_to_edge_s !== null && look.time_to_edge_s < 60) { g.fillStyle = shade("--ink"); g.fillText(`edge in ${look.time_to_edge_s.toFixed(0)} s`, px + ux * far + 8, py - uy * far - 4); }
  }

  goal(pose, style, filled) {
    const g = this.g, [px, py] = this.at(pose.x_m, pose.y_m), r = 0.07 * this.scale;
    g.beginPath(); g.arc(px, py, r, 0, 7); g.strokeStyle = style; g.lineWidth = filled ? 2.5 : 1.5; g.setLineDash([4, 3]); g.stroke(); g.setLineDash([]);
    if (pose.heading_rad !== null) { g.beginPath(); g.moveTo(px, py); g.lineTo(px + Math.cos(pose.heading_rad) * r * 2, py - Math.sin(pose.heading_rad) * r * 2); g.stroke(); }
  }

  outline([x, y, heading], style, radius, dash) {
    const g = this.g, [px, py] = this.at(x, y), r = radius * this.scale;
    g.strokeStyle = style; g.lineWidth = 1.5; g.setLineDash(dash); g.beginPath(); g.arc(px, py, r, 0, 7); g.moveTo(px, py); g.lineTo(px + Math.cos(heading) * r, py - Math.sin(heading) * r); g.stroke(); g.setLineDash([]);
  }

  cross(px, py, style) {
    const g = this.g;
    g.strokeStyle = style; g.lineWidth = 2; g.beginPath(); g.moveTo(px - 6, py); g.lineTo(px + 6, py); g.moveTo(px, py - 6); g.lineTo(px, py + 6); g.stroke();
  }

  listen() {
    let from = null;
    const where = (event) => { const box = this.canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    this.canvas.onpointerdown = (event) => {
      if (!this.now) return;
      const [px, py] = where(event), [x, y] = this.back(px, py);
      const hit = this.names.find((name) => { const v = this.now.vehicles[name]; return v.x_m !== undefined && Math.hypot(v.x_m - x, v.y_m - y) < this.rig.vehicles[name].radius_m; });
      if (hit) { this.chosen = hit; this.choose?.(hit); this.draw(); return; }
      this.canvas.setPointerCapture(event.pointerId);
      from = [px, py, x, y];
      this.point(from, px, py);
    };
    this.canvas.onpointermove = (event) => { if (from) this.point(from, ...where(event)); };
    this.canvas.onpointercancel = () => { from = null; this.pointed = null; this.draw(); };
    this.canvas.onpointerup = () => { if (from && this.pointed) this.wanted(this.chosen, this.pointed); from = null; };
  }

  point([px0, py0, x, y], px, py) {
    const dragged = Math.hypot(px - px0, py - py0) > DRAG_PX, present = this.now.vehicles[this.chosen];
    const heading = dragged ? Math.atan2(py0 - py, px - px0) : present?.control?.goal_heading_rad ?? present?.heading_rad ?? 0;
    this.pointed = {x_m: Math.round(x * 1000) / 1000, y_m: Math.round(y * 1000) / 1000, heading_rad: heading};
    this.draw();
  }

  clear() { this.ahead = null; this.pointed = null; this.draw(); }
}
