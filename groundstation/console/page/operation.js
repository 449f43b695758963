// Vehicles, what can be asked of them, faults, the lease, goals flown ahead.

import {post} from "./link.js";
import {age, clock, colour, deg, el, number, rad, set} from "./words.js";

const MAIN = [["fly", "Fly"], ["brake", "Brake"], ["resume", "Resume"], ["land", "Land"], ["release", "Release"],
  ["arm", "Arm"], ["disarm", "Disarm"], ["float_on", "Float on"], ["float_off", "Float off"]];
const FREE = new Set(["stop", "land", "disarm", "float_off", "brake"]);
const FAR_S = 300;
const LEASE_S = 600, RENEW_S = 240;

export class Operation {
  constructor(table, notice) {
    this.table = table;
    this.notice = notice;                // shows a sentence to the person: notice(text, calm)
    this.cards = {};
    table.choose = (name) => this.choose(name);
    table.wanted = (vehicle, goal) => this.plan(vehicle, goal);
    this.dialog = document.getElementById("lease-dialog");
    document.getElementById("take-control").onclick = () => this.control();
    document.getElementById("lease-take").onclick = () => this.take();
    document.getElementById("lease-named").onclick = () => this.named();
    document.getElementById("marker-form").onsubmit = (event) => { event.preventDefault(); this.mark(); };
    setInterval(() => this.renew(), RENEW_S * 1000);
  }

  get token() { return localStorage.getItem("lease") || ""; }
  get me() { return localStorage.getItem("lease-name") || ""; }
  get holds() { return Boolean(this.token) && this.lease?.holder === this.me && this.lease.left_s > 0; }

  page(rig, mayCommand) {
    this.rig = rig;
    this.may = mayCommand;
    document.querySelector(".control").hidden = !mayCommand;
    document.getElementById("marker-form").hidden = !mayCommand;
    const list = document.getElementById("vehicles");
    list.replaceChildren(...Object.keys(rig.vehicles).map((name, i) => this.card(name, i)));
    this.choose(this.table.chosen);
  }

  card(name, index) {
    const words = el("p", {class: "words", role: "status"}, "nothing received yet");
    const facts = el("dl");
    const buttons = MAIN.map(([action, label]) => el("button", {"data-action": action, title: this.rig.actions[action]?.summary, onclick: () => this.ask(name, action)}, label));
    const inputs = ["x / m", "y / m", "heading / deg"].map((label, i) => el("label", {}, label, el("input", {type: "number", step: "any", "aria-label": `${name}: goal ${label}`})));
    const goal = el("form", {class: "goal", onsubmit: (event) => { event.preventDefault(); this.planTyped(name); }}, ...inputs, el("button", {}, "Go to"));
    const more = el("details", {class: "controller"}, el("summary", {}, "Controller"), this.controller(name));
    const card = el("section", {class: "vehicle", role: "region", "aria-label": name, onclick: () => this.choose(name)},
      el("header", {}, el("h2", {style: `color:${colour(index)}`}, name), el("span", {class: "small", "data-part": "age"})), words, facts);
    if (this.may) card.append(el("div", {class: "buttons"}, ...buttons), goal);
    card.append(more);
    this.cards[name] = {card, words, facts, inputs: inputs.map((label) => label.querySelector("input")), age: card.querySelector("[data-part=age]"), cells: {}};
    return card;
  }

  controller(name) {
    const about = this.rig.vehicles[name], rows = this.rig.controllers;
    const named = Object.keys(rows).filter((each) => rows[each].can_be_chosen);
    const choice = el("select", {"aria-label": `${name}: controller`}, ...named.map((each) => el("option", {value: each}, each)));
    const summary = el("p", {class: "small"});
    const text = el("textarea", {rows: 4, spellcheck: "false", "aria-label": `${name}: parameters`});
    const show = () => {
      const row = rows[choice.value], given = choice.value === about.controller ? about.parameters : {};
      summary.textContent = `${row.summary}. Parameters: ${Object.entries(row.parameters).map(([key, {default: value}]) => value === null ? `${key} (needed)` : `${key} = ${value.length > 40 ? "…" : value}`).join(", ") || "none"}`;
      text.value = JSON.stringify(given, null, 1);
    };
    choice.value = named.includes(about.controller) ? about.controller : named[0];
    choice.onchange = show;
    show();
    const change = el("button", {"data-action": "change_controller"}, "Change controller");
    const form = el("form", {class: "small", onsubmit: (event) => { event.preventDefault(); this.change(name, choice.value, text.value); }}, choice, summary, text, change);
    const rigs = el("p", {class: "small"}, `The rig has ${about.controller}. A goal interrupts a program until Resume; a changed controller begins its program with Resume.`);
    return this.may ? el("div", {}, rigs, form) : rigs;
  }

  async change(name, controller, text) {
    let given;
    try { given = JSON.parse(text || "{}"); } catch { this.notice(`${name}: the parameters are no JSON object`); return; }
    if (await this.ask(name, "change_controller", {controller, parameters: JSON.stringify(given)})) this.notice(`${name} flies by ${controller}${this.rig.controllers[controller].has_program ? ": Resume begins its program" : ""}`, true);
  }

  choose(name) {
    this.table.chosen = name;
    for (const [other, {card}] of Object.entries(this.cards)) card.classList.toggle("chosen", other === name);
    this.table.draw();
  }

  state(state) {
    this.lease = state.lease;
    const lease = state.lease, words = !lease ? "nobody holds control" : this.holds ? `you hold control, ${clock(lease.left_s)}` : `${lease.holder} holds control, ${clock(lease.left_s)}`;
    set(document.getElementById("lease"), words);
    set(document.getElementById("take-control"), this.holds ? "Give control" : "Take control");
    for (const [name, vehicle] of Object.entries(state.vehicles)) this.vehicle(name, vehicle);
    this.faults(state);
    this.scenario(state.scenario, state.limits);
    const recorder = state.recorder;
    const written = recorder ? `recording ${(recorder.written_bytes / 1e6).toFixed(1)} MB${recorder.room_s < 3600 ? `, room for ${clock(recorder.room_s)}` : ""}` : "";
    set(document.getElementById("recorder"), this.rig.kind === "live" ? written : "a recording, not a flight");
  }

  vehicle(name, v) {
    const own = this.cards[name];
    if (!own) return;
    const isStale = v.age_s === null || v.age_s > 0.5;
    own.card.classList.toggle("stale", isStale);
    set(own.words, v.words);
    set(own.age, isStale ? `last seen ${age(v.age_s)} ago` : "");
    const look = v.outlook && v.outlook.age_s < 1 ? v.outlook : null, control = v.control;
    this.rows(own, {
      "x": number(v.x_m, 3, "m"), "heading": number(v.heading_rad === undefined ? null : deg(v.heading_rad), 1, "deg"),
      "y": number(v.y_m, 3, "m"), "speed": number(v.velocity_table_m_s ? 1000 * Math.hypot(...v.velocity_table_m_s) : null, 1, "mm/s"),
      "to goal": control && control.error_m !== null ? `${number(1000 * control.error_m, control.error_m < 0.1 ? 1 : 0, "mm")}, ${number(deg(control.error_rad), 1, "deg")}` : "–", "fix": age(v.fusion?.fix_age_s),
      "gas": v.valves?.pressure_pa ? number(v.valves.pressure_pa / 1e5, 1, "bar") : "–", "edge": look && look.time_to_edge_s !== null && look.time_to_edge_s < FAR_S ? `in ${number(look.time_to_edge_s, 0, "s")}` : look ? "far" : "–",
      "air": v.valves ? v.valves.floating ? "on" : "off" : "–", "valves": v.valves ? v.valves.armed ? "armed" : "disarmed" : "–",
      "flies": control?.controller ?? "–", "limited": v.demand?.limited_by || "no",
    });
    for (const button of own.card.querySelectorAll("[data-action]")) {
      const mayAsk = FREE.has(button.dataset.action) || this.holds;
      button.disabled = !mayAsk;
    }
  }

  rows(own, rows) {
    for (const [key, text] of Object.entries(rows)) {
      let cell = own.cells[key];
      if (!cell) { cell = own.cells[key] = el("dd"); own.facts.append(el("dt", {}, key), cell); }
      set(cell, text);
    }
  }

  faults(state) {
    const region = document.getElementById("faults"), found = [];
    for (const [name, v] of Object.entries(state.vehicles)) for (const fault of v.faults ?? []) found.push([name, fault]);
    const key = JSON.stringify(found.map(([name, fault]) => [name, fault.id, fault.is_gone, fault.response, fault.detail]));
    const ages = found.map(([, fault]) => age(fault.age_s));
    if (key !== this.faultsShown) {
      this.faultsShown = key;
      region.classList.toggle("none", !found.some(([, fault]) => !fault.is_gone));
      region.replaceChildren(el("h2", {}, found.length ? `Faults: ${found.length}` : "No faults"), el("ul", {}, ...found.map(([name, fault]) =>
        el("li", {class: fault.is_gone ? "gone" : ""}, el("strong", {class: fault.is_gone ? "" : "bad"}, `${name}: ${fault.what}`), fault.is_gone ? " (gone; a release clears it)" : "",
          el("div", {class: "small"}, `${fault.detail}; `, el("span", {"data-age": true}), ` ago; ${fault.response}. ${fault.advice}`)))));
    }
    region.querySelectorAll("[data-age]").forEach((node, i) => set(node, ages[i]));
    this.isLatched = Object.values(state.vehicles).some((v) => v.stop_latched);
  }

  scenario(now, limits) {
    const box = document.getElementById("scenario");
    box.hidden = !now;
    if (!now) return;
    const time = now.t_s === null ? "" : `, t = ${now.t_s.toFixed(1)} s`;
    const parts = [`${now.state}${time}`, now.waits_for && `waits for ${now.waits_for}`, now.reason].filter(Boolean);
    const isBegun = now.state !== "waiting", shown = `${now.name} ${parts.join()} ${JSON.stringify(limits)} ${this.holds}`;
    if (shown === this.scenarioShown) return;   // a button that is replaced cannot be pressed
    this.scenarioShown = shown;
    const start = el("button", {disabled: !this.holds, title: this.holds ? "" : "Take control first", onclick: () => this.ask("", "start_scenario")}, "Start scenario");
    const buttons = this.may && !isBegun && this.rig.starts_by_hand ? [start] : [];
    box.replaceChildren(el("h2", {}, now.name), ...buttons, el("div", {class: now.state === "failed" ? "bad" : ""}, parts.join("; ")),
      ...(limits ?? []).map((limit) => el("div", {class: limit.held === null ? "small" : limit.held ? "good" : "bad"}, `${limit.held === null ? "open" : limit.held ? "held" : "FAILED"}: ${limit.text}`)));
  }

  async ask(vehicle, action, given = {}) {
    const answer = await post("/api/request", {vehicle, action, arguments: given, token: this.token});
    this.notice(answer.accepted ? "" : `${vehicle}: ${action}: ${answer.reason}`);
    return answer.accepted;
  }

  planTyped(name) {
    const {inputs} = this.cards[name], v = this.table.now?.vehicles[name];
    const given = inputs.map((input, i) => input.value === "" ? [v?.x_m, v?.y_m, v ? deg(v.heading_rad) : 0][i] : Number(input.value));
    if (given.some((value) => !Number.isFinite(value))) { this.notice(`${name}: the goal is no pose`); return; }
    this.choose(name);
    this.table.pointed = {x_m: given[0], y_m: given[1], heading_rad: rad(given[2])};
    this.plan(name, this.table.pointed);
  }

  async plan(vehicle, goal) {
    if (!this.may) return;
    const box = document.getElementById("plan"), where = `(${goal.x_m.toFixed(2)}, ${goal.y_m.toFixed(2)}) m, ${deg(goal.heading_rad).toFixed(0)} deg`;
    const send = el("button", {onclick: async () => { if (await this.ask(vehicle, "go_to", goal)) this.drop(); }}, "Send");
    const cancel = el("button", {onclick: () => this.drop()}, "Cancel");
    const text = el("span", {role: "status"}, `${vehicle} to ${where}: flying it ahead …`);
    const asked = this.asked = Symbol("asked");
    box.hidden = false;
    box.replaceChildren(el("div", {class: "row"}, text, send, cancel));
    send.disabled = !this.holds;
    if (!this.holds) send.title = "Take control first";
    const shown = await post("/api/preview", {vehicle, action: "go_to", arguments: goal});
    if (this.asked !== asked) return;
    if (shown.paths) { this.table.ahead = shown; this.table.draw(); }
    const trouble = shown.refused || shown.reason;
    if (trouble) text.replaceChildren(`${vehicle} to ${where}: `, el("span", {class: "bad"}, trouble));
    else text.textContent = `${vehicle} to ${where}: ${figures(shown)}`;
  }

  drop() {
    this.asked = null;
    document.getElementById("plan").hidden = true;
    this.table.clear();
  }

  // one tap takes it, under the name of before or one of this screen's own; what refuses it opens the dialog
  async control() {
    if (this.holds) { this.give(); return; }
    const trouble = await this.takeAs(this.me || `operator-${Math.random().toString(36).slice(2, 6)}`, "");
    if (trouble) this.named(trouble);
  }

  named(trouble = "") {
    document.getElementById("lease-name").value = this.me || "operator";
    set(document.getElementById("lease-trouble"), trouble);
    if (!this.dialog.open) this.dialog.showModal();
  }

  async take() {
    const name = document.getElementById("lease-name").value.trim(), force = document.getElementById("lease-force").value.trim();
    const trouble = await this.takeAs(name, force);
    if (trouble) set(document.getElementById("lease-trouble"), trouble);
    else this.dialog.close();
  }

  async takeAs(name, force) {
    const answer = await post("/api/lease", {action: "take", name, force, for_s: LEASE_S, token: this.token});
    if (!answer.accepted) return answer.reason;
    localStorage.setItem("lease", answer.token);
    localStorage.setItem("lease-name", answer.holder);
    return "";
  }

  async give() {
    const answer = await post("/api/lease", {action: "give_up", token: this.token});
    if (!answer.accepted) this.notice(answer.reason);
    localStorage.removeItem("lease");
  }

  renew() {
    if (this.holds) post("/api/lease", {action: "take", name: this.me, for_s: LEASE_S, token: this.token});
  }

  async mark() {
    const field = document.getElementById("marker"), text = field.value.trim();
    if (!text) return;
    const answer = await post("/api/marker", {text, token: this.token});
    if (answer.accepted) field.value = ""; else this.notice(answer.reason);
  }
}

function figures(shown) {
  const found = shown.figures ?? {}, parts = [];
  if (found.settling_s !== null && found.settling_s !== undefined) parts.push(`settled after ${found.settling_s.toFixed(1)} s`);
  if (found.gas_ns !== undefined && found.gas_ns !== null) parts.push(`${found.gas_ns.toFixed(1)} N s of gas`);
  if (found.least_edge_mm !== undefined && found.least_edge_mm !== null) parts.push(`${(found.least_edge_mm / 10).toFixed(0)} cm from the edge`);
  if (found.least_distance_mm !== undefined && found.least_distance_mm !== null) parts.push(`${(found.least_distance_mm / 10).toFixed(0)} cm from others`);
  return parts.join(", ") || "flown";
}
