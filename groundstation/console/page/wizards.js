// Guided calibrations: what to do now, how far it is, what came out, accept or discard.

import {Picture} from "./drawing.js";
import {post} from "./link.js";
import {el, set} from "./words.js";

const TITLES = {collecting: "Going on", fitting: "Computing the result …", result: "Result: accept or discard", ended: "Ended without a result", saved: "Accepted"};

export class Wizards {
  constructor(notice) {
    this.notice = notice;
    this.box = document.getElementById("wizards");
    document.head.append(el("link", {rel: "stylesheet", href: "/page/wizards.css"}));
    this.list = el("div", {class: "wizard-list"});
    this.going = el("section", {class: "card wizard", role: "region", "aria-label": "Guided calibration", hidden: true});
    this.rows = {};
    addEventListener("resize", () => this.pictures?.forEach((picture) => picture.draw()));
  }

  page(rig, mayCommand) {
    this.rig = rig;
    this.may = mayCommand;
    this.key = this.shown = null;
    this.box.replaceChildren(this.going, this.list);
    if (!mayCommand) this.list.replaceChildren(el("p", {class: "small"}, "Only an operator calibrates; here is what goes on."));
  }

  take(message) {
    if (!this.rig) return;
    const key = JSON.stringify([message.wizards, message.broken]);
    if (this.may && key !== this.key) { this.key = key; this.offer(message); }
    this.session(message.session);
  }

  offer({wizards, broken}) {
    const none = wizards.length ? [] : [el("p", {class: "small"}, "Looking for guided calibrations …")];
    this.list.replaceChildren(...none, ...wizards.map((wizard) => this.card(wizard)),
      ...Object.values(broken).map((why) => el("p", {class: "bad"}, why)));
    this.enable();
  }

  card(wizard) {
    const names = Object.keys(wizard.missing), able = names.filter((name) => !wizard.missing[name]);
    const head = [el("h2", {}, wizard.name), el("p", {}, wizard.summary)];
    if (!able.length) return el("section", {class: "card", role: "region", "aria-label": wizard.name}, ...head, el("p", {class: "small"}, `Not with this rig: ${wizard.missing[names[0]]}.`));
    const vehicle = el("select", {"aria-label": `${wizard.name}: vehicle`}, ...able.map((name) => el("option", {value: name}, name)));
    const drive = el("input", {type: "checkbox", checked: true});
    const start = el("button", {"data-start": wizard.name, onclick: () => this.ask({action: "start", name: wizard.name, vehicle: vehicle.value, drive: drive.checked})}, "Start");
    return el("section", {class: "card", role: "region", "aria-label": wizard.name}, ...head,
      el("div", {class: "row"}, vehicle, el("label", {class: "layer"}, drive, " it flies by itself"), start));
  }

  enable() {
    const isBusy = this.now && !["ended", "saved"].includes(this.now.state);
    for (const button of this.list.querySelectorAll("[data-start]")) button.disabled = Boolean(isBusy);
  }

  session(now) {
    this.now = now;
    this.going.hidden = !now;
    this.enable();
    if (!now) { this.shown = null; return; }
    const frame = `${now.name}/${now.vehicle}/${now.state}`;
    if (frame !== this.shown) { this.shown = frame; this.build(now); }
    const {rows} = this;
    set(rows.instruction, now.state === "collecting" ? now.step?.instruction ?? "Waiting for the vehicle …" : "");
    set(rows.step, now.state === "collecting" && now.step ? now.step.name : "");
    rows.bar.hidden = now.state !== "collecting";
    rows.bar.value = now.done;
    set(rows.missing, now.state === "collecting" ? now.missing : "");
    set(rows.note, now.state === "collecting" ? now.note : "");
    set(rows.trouble, now.trouble);
    const lines = now.lines.join("\n");
    if (rows.lines.dataset.lines !== lines) { rows.lines.dataset.lines = lines; rows.lines.replaceChildren(...now.lines.map((line) => el("li", {}, line))); }
    const drawings = now.result ? now.result.drawings : now.pictures;
    while (this.pictures.length < drawings.length) { const picture = new Picture(); this.pictures.push(picture); rows.pictures.append(picture.node); }
    drawings.forEach((drawing, i) => this.pictures[i].show(drawing));
  }

  build(now) {
    const rows = this.rows = {
      instruction: el("p", {class: "wizard-instruction", role: "status", "aria-live": "polite"}), step: el("strong"),
      bar: el("progress", {max: 1, "aria-label": "Share of this step"}), missing: el("span", {class: "small"}),
      note: el("p", {class: "warn"}), trouble: el("p", {class: "bad", role: "alert"}), lines: el("ul", {class: "small"}), pictures: el("div", {class: "wizard-pictures"}),
    };
    this.pictures = [];
    const buttons = [];
    if (this.may && now.state === "result") buttons.push(el("button", {class: "wizard-accept", onclick: () => this.ask({action: "accept"})}, "Accept"));
    if (this.may) buttons.push(el("button", {onclick: () => this.ask({action: "discard"})}, now.state === "saved" || now.state === "ended" ? "Close" : "Discard"));
    const saved = now.saved.length ? [el("p", {class: "good"}, "Written: ", ...now.saved.map((path) => el("code", {}, path)))] : [];
    this.going.replaceChildren(
      el("h2", {}, `${now.name} of ${now.vehicle}: ${TITLES[now.state] ?? now.state}`), rows.instruction,
      el("div", {class: "row"}, rows.step, rows.bar, rows.missing), rows.note, rows.trouble,
      ...saved, el("div", {class: "row"}, ...buttons), ...(now.result ? result(now.result) : []), rows.pictures, rows.lines);
  }

  async ask(body) {
    const answer = await post("/api/wizard", body);
    this.notice(answer.accepted ? "" : answer.reason);
  }
}

function result(found) {
  const parts = found.warnings.map((line) => el("p", {class: "warn"}, `Beware: ${line}.`));
  if (found.verification.length) parts.push(el("h3", {}, `Verified by ${found.verified_by}`), table(found.verification));
  else parts.push(el("p", {class: "warn"}, "Nothing was set aside to verify it by."));
  if (found.residual.length) parts.push(el("h3", {}, "Residual of the fit"), table(found.residual));
  parts.push(el("h3", {}, found.title), table(found.quantities));
  return parts;
}

function table(numbers) {
  const rows = numbers.map(([name, value, sigma, unit]) => el("tr", {}, el("td", {}, name.replaceAll("_", " ")),
    el("td", {class: "n"}, short(value)), el("td", {class: "n"}, sigma === null ? "" : `± ${short(sigma, 2)}`), el("td", {}, unit === "1" ? "" : unit)));
  return el("table", {class: "wizard-numbers"}, el("thead", {}, el("tr", {}, ...["what", "value", "one sigma", "unit"].map((name, i) => el("th", {class: i === 1 || i === 2 ? "n" : null, scope: "col"}, name)))), el("tbody", {}, ...rows));
}

function short(value, digits = 4) {
  if (value === null) return "–";
  return String(Number(value.toPrecision(digits)));
}
