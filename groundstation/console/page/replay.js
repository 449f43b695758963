// A recording under the same screens: play, pause, scrub, speed, jumps.

import {clock, el, set} from "./words.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30];

export class Replay {
  constructor(link) {
    this.link = link;
    this.bar = document.getElementById("replay");
    this.isHeld = false;
  }

  page(rig) {
    if (rig.kind !== "replay") return;
    this.bar.hidden = false;
    this.play = el("button", {onclick: () => this.ask({what: this.now?.is_playing ? "pause" : "play"})}, "Play");
    this.slider = el("input", {type: "range", min: 0, max: rig.replay.duration_s, step: 0.01, value: 0, "aria-label": "Time in the recording",
      oninput: () => { this.isHeld = true; this.ask({what: "seek", t_s: Number(this.slider.value)}); }, onchange: () => { this.isHeld = false; }});
    this.time = el("span", {class: "small", role: "timer"});
    const speed = el("select", {"aria-label": "Speed", onchange: () => this.ask({what: "speed", factor: Number(speed.value)})}, ...SPEEDS.map((factor) => el("option", {value: factor, selected: factor === 1}, `${factor}x`)));
    const jump = (what, label) => el("button", {onclick: () => this.ask({what})}, label);
    this.bar.replaceChildren(this.play, this.slider, this.time, speed, jump("next_fault", "Next fault"), jump("next_refused", "Next refused fix"));
    if (rig.replay.other) this.bar.append(el("span", {class: "small"}, `dashed: ${rig.replay.other}`));
  }

  ask(message) { this.link.send({type: "replay", ...message}); }

  state(state) {
    if (!state.replay || this.bar.hidden) return;
    this.now = state.replay;
    set(this.play, state.replay.is_playing ? "Pause" : "Play");
    set(this.time, `${clock(state.replay.t_s)}.${Math.floor(10 * (state.replay.t_s % 1))} of ${clock(Number(this.slider.max))}`);
    if (!this.isHeld) this.slider.value = state.replay.t_s;
  }
}
