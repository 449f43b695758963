// Processes, devices, rates, ages by stage, faults that can be.

import {age, el, number} from "./words.js";

export class Health {
  constructor() { this.box = document.getElementById("health"); }

  page(rig) { this.rig = rig; }
  state(state) { this.now = state; }

  take(health) {
    if (document.getElementById("screen-health").hidden) return;
    const t = (this.now?.now_ns ?? 0) * 1e-9;
    this.box.replaceChildren(
      card("Gas and air", table(["", "tank", "air", "valves", "bits"], Object.entries(this.now?.vehicles ?? {}).map(([name, v]) =>
        [name, v.valves?.pressure_pa ? number(v.valves.pressure_pa / 1e5, 1, "bar") : "–", v.valves ? v.valves.floating ? "on" : "off" : "–", v.valves?.armed ? "armed" : "closed", v.valves ? `0x${v.valves.faults.toString(16)}` : "–"]))),
      card("Age of the light, p50 / p99 ms", ages(health.latency)),
      card("Nodes and devices", table(["", "", ""], health.nodes.map((node) => [node.node, node.level ? el("span", {class: node.level > 1 ? "bad" : "warn"}, node.summary) : node.summary || "well", counted(node.values)]))),
      card("Topics, per second", table(["topic", "of", "rate"], health.rates.filter(([, , rate]) => rate > 0).map(([noun, owner, rate]) => [noun, owner || "rig", rate.toFixed(rate < 10 ? 1 : 0)]), [2])),
      card("Not readable here", el("p", {class: "small"}, `${health.refused} batches and messages`)),
      card("Faults that are looked for", table(["", "found by"], Object.entries(this.rig.faults).map(([id, fault]) => [this.active(id, fault), fault.found_by]))),
    );
  }

  active(id, fault) {
    const found = Object.entries(this.now?.vehicles ?? {}).flatMap(([name, v]) => (v.faults ?? []).filter((each) => each.id === id && !each.is_gone).map((each) => `${name}, for ${age(each.age_s)}: ${each.response}`));
    return found.length ? el("strong", {class: "bad"}, `${fault.what} (${found.join("; ")})`) : fault.what;
  }
}

function card(title, inside) { return el("section", {class: "card"}, el("h2", {}, title), inside); }

function table(headings, rows, numbers = []) {
  return el("table", {}, el("thead", {}, el("tr", {}, ...headings.map((text, i) => el("th", {scope: "col", class: numbers.includes(i) ? "n" : null}, text)))),
    el("tbody", {}, ...rows.map((row) => el("tr", {}, ...row.map((cell, i) => el("td", {class: numbers.includes(i) ? "n" : null}, cell))))));
}

function ages(latency) {
  const names = Object.keys(latency);
  if (!names.length) return el("p", {class: "small"}, "nothing yet");
  return table(["", ...names], latency[names[0]].stages.map((stage, i) => [stage, ...names.map((name) => both(latency[name].p50_s[i], latency[name].p99_s[i]))]));
}
function both(low, high) { return low === null || low === undefined ? "–" : `${(1000 * low).toFixed(1)} / ${(1000 * high).toFixed(1)}`; }
function counted(values) { return el("span", {class: "small"}, Object.entries(values).filter(([, value]) => value !== "0").map(([key, value]) => `${key} ${value}`).join(", ")); }
