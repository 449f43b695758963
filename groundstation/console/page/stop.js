// The stop: it stands alone, and needs neither the charts nor the rest of the page to work.

const SECOND_WAY_MS = 4000;                                // a vehicle has three seconds to confirm
const HINTS = ["brakes, holds, lands all", "press again: cuts the air of all, now"];

export class Stop {
  constructor(link, notice) {
    this.link = link;
    this.notice = notice;
    this.button = document.getElementById("stop");
    this.hint = document.getElementById("stop-hint");
    this.button.addEventListener("pointerdown", (event) => { event.preventDefault(); this.press(); });
    this.button.addEventListener("keydown", (event) => { if (event.key === "Enter" && !event.repeat) { event.preventDefault(); this.press(); } });
    window.addEventListener("keydown", (event) => {
      if (event.code !== "Space" || event.repeat || isTyping(event.target)) return;
      event.preventDefault();
      event.stopPropagation();
      this.press();
    }, true);
    window.addEventListener("keyup", (event) => { if (event.code === "Space" && !isTyping(event.target)) event.preventDefault(); }, true);
    this.button.addEventListener("click", (event) => { if (event.detail === 0 && performance.now() - this.pressed > 300) this.press(); });  // by a screen reader
    this.pressed = 0;
  }

  page(isLive) { this.isLive = isLive; }

  latched(isLatched) {
    this.hint.textContent = this.isLive ? HINTS[isLatched ? 1 : 0] : "a recording: nothing flies";
    this.button.classList.toggle("again", Boolean(isLatched) && this.isLive);
  }

  press() {
    this.pressed = performance.now();
    if (this.isLive === false) { this.notice("a recording: there is nothing to stop", true); return; }
    const tap = `${Date.now()}-${Math.random()}`;          // one press, whichever way it arrives
    this.notice("STOP pressed …", true);
    clearTimeout(this.second);
    if (this.link.send({type: "stop", tap})) this.second = setTimeout(() => this.post(tap), SECOND_WAY_MS);
    else this.post(tap);
  }

  async post(tap) {
    try {
      this.answer(await (await fetch("/api/stop", {method: "POST", keepalive: true, headers: {"Content-Type": "application/json"}, body: JSON.stringify({tap})})).json());
    } catch { this.notice("STOP NOT SENT: the console does not answer. Cut the air by hand."); }
  }

  answer(outcome) {
    clearTimeout(this.second);
    const modes = Object.entries(outcome.stopped ?? {}).map(([name, mode]) => `${name} is ${mode}`).join(", ");
    if (outcome.accepted) this.notice(`STOP: ${modes}`, true);
    else this.notice(`STOP NOT CONFIRMED by ${(outcome.not_confirmed ?? []).join(", ") || "anybody"}: go and cut the air by hand`);
  }
}

// a space is a letter here; everywhere else, a ticked box or a list included, it is the stop
function isTyping(target) {
  return target.tagName === "TEXTAREA" || (target.tagName === "INPUT" && !/^(checkbox|radio|range|button)$/.test(target.type));
}
