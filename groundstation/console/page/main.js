// What came over the link goes to who shows it.

import {Camera} from "./camera.js";
import {Charts} from "./charts.js";
import {Health} from "./health.js";
import {Link} from "./link.js";
import {Operation} from "./operation.js";
import {Replay} from "./replay.js";
import {Sound} from "./sound.js";
import {Stop} from "./stop.js";
import {TableView} from "./table.js";
import {Wizards} from "./wizards.js";
import {clock, el, set} from "./words.js";

const MOST_EVENTS = 200, NOTICE_MS = 6000;
const LISTED = new Set(["fault", "cleared", "stop", "failure", "request", "refusal", "marker", "mode", "sky", "health", "note"]);
const screens = ["table", "charts", "camera", "health", "wizards"];
let rig = null, ended = 0, origin = null;

const notice = (text, calm = false) => {
  const box = document.getElementById("notice");
  clearTimeout(ended);
  box.hidden = !text;
  box.classList.toggle("calm", calm);
  set(box, text);
  if (text && calm) ended = setTimeout(() => { box.hidden = true; }, NOTICE_MS);
};

const hear = {
  json(message) {
    if (message.type === "state") state(message);
    else if (message.type === "rig") page(message);
    else if (message.type === "events") message.events.forEach(event);
    else if (message.type === "health") health.take(message);
    else if (message.type === "wizard") wizards.take(message);
    else if (message.type === "stop") stop.answer(message);
    else if (message.type === "trouble") notice(message.text);
  },
  picture: (head, blob) => camera.take(head, blob),
  chart: (fields) => charts.take(fields),
  condition(word) {
    const region = document.getElementById("connection");
    if (region.textContent === word) return;
    region.className = word;
    set(region, word);
    document.body.classList.toggle("old", word !== "live");
    if (word === "disconnected" && rig) notice("The console does not answer: what is shown is old. The mock-ups fly on without it; STOP may not reach them.");
    if (word === "live") notice("");
  },
};

const link = new Link(hear);
const stop = new Stop(link, notice);          // first: whatever else fails, it works
const table = new TableView();
const operation = new Operation(table, notice);
const charts = new Charts(link);
const camera = new Camera(link);
const health = new Health();
const replay = new Replay(link);
const sound = new Sound();
const wizards = new Wizards(notice);

function page(message) {
  const isLive = message.rig.kind === "live";
  rig = message.rig;
  document.title = `${rig.name} – ground station`;
  set(document.getElementById("rig"), rig.name);
  document.getElementById("events").replaceChildren();
  stop.page(isLive);
  for (const part of [table, charts]) part.page(rig, isLive);
  operation.page(rig, message.may_command);
  for (const part of [camera, health, replay]) part.page(rig);
  wizards.page(rig, message.may_command);
  document.getElementById("tab-wizards").hidden = !isLive;
}

function state(message) {
  if (!rig) return;
  origin ??= message.now_ns * 1e-9;
  for (const part of [table, operation, charts, health, replay]) part.state(message);
  stop.latched(operation.isLatched);
}

function event(each) {
  charts.event(each);
  if (each.kind === "fault") sound.fault();
  if (!LISTED.has(each.kind) || each.action === "picture") return;
  const list = document.getElementById("events");
  const words = each.text ?? `${each.author}: ${each.action} ${each.arguments === "{}" ? "" : each.arguments}`;
  const bad = each.kind === "fault" || each.kind === "stop" || each.kind === "refusal";
  const t = rig?.kind === "replay" ? each.t_s - rig.replay.start_s : each.t_s - (origin ?? each.t_s);
  list.prepend(el("li", {class: bad ? "bad" : each.kind === "marker" ? "good" : null}, el("time", {}, t < 0 ? `-${clock(-t)}` : clock(t)), each.vehicle ? `${each.vehicle}: ` : "", words));
  while (list.childElementCount > MOST_EVENTS) list.lastChild.remove();
}

function show(name) {
  for (const each of screens) {
    const tab = document.getElementById(`tab-${each}`), isShown = each === name;
    tab.setAttribute("aria-selected", isShown);
    tab.tabIndex = isShown ? 0 : -1;
    document.getElementById(`screen-${each}`).hidden = !isShown;
  }
  camera.look(name === "camera");
  charts.resize(); charts.draw(); table.draw();
  history.replaceState(null, "", `#${name}`);
}

const tabs = document.querySelector("[role=tablist]");
tabs.onclick = (clicked) => { const tab = clicked.target.closest("[role=tab]"); if (tab) show(tab.id.slice(4)); };
tabs.onkeydown = (pressed) => {
  const step = {ArrowRight: 1, ArrowLeft: -1}[pressed.key];
  if (!step) return;
  const shown = screens.filter((name) => !document.getElementById(`tab-${name}`).hidden);
  const next = shown[(shown.indexOf(document.activeElement.id.slice(4)) + step + shown.length) % shown.length];
  show(next);
  document.getElementById(`tab-${next}`).focus();
};
matchMedia("(prefers-color-scheme: dark)").onchange = () => location.reload();
if (screens.includes(location.hash.slice(1))) show(location.hash.slice(1));
