// Guided calibrations: what to do now, how far it is, what came out, accept or discard.

import {el} from "./words.js";

export class Wizards {
  constructor(notice) { this.notice = notice; this.box = document.getElementById("wizards"); }

  page(rig, mayCommand) {
    this.rig = rig;
    this.box.replaceChildren(el("p", {class: "small"}, mayCommand ? "No guided calibration is installed." : "Only an operator calibrates."));
  }

  take() {}
}
