// The stop: it stands alone, and needs neither the charts nor the rest of the page to work.

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
      if (event.code !== "Space" || event.repeat || /^(INPUT|TEXTAREA|SELECT)$/.test(event.target.tagName)) return;
      event.preventDefault();
      event.stopPropagation();
      this.press();
    }, true);
    window.addEventListener("keyup", (event) => { if (event.code === "Space" && event.target.tagName === "BUTTON") event.preventDefault(); }, true);
    this.button.addEventListener("click", (event) => { if (event.detail === 0 && performance.now() - this.pressed > 300) this.press(); });  // by a screen reader
    this.pressed = 0;
  }

  latched(isLatched) {
    this.hint.textContent = HINTS[isLatched ? 1 : 0];
    this.button.classList.toggle("again", isLatched);
  }

  async press() {
    this.pressed = performance.now();
    const sent = this.link.send({type: "stop"});          // the open socket is quickest
    if (sent) { this.notice("STOP pressed", true); return; }
    try {
      const answer = await (await fetch("/api/stop", {method: "POST", keepalive: true})).json();
      this.notice(answer.accepted ? "STOP pressed" : `STOP NOT CONFIRMED by ${(answer.not_confirmed ?? []).join(", ")}: cut the air by hand`, answer.accepted);
    } catch { this.notice("STOP NOT SENT: the console does not answer. Cut the air by hand."); }
  }
}
