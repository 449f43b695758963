// The last picture of a star camera: what was found in it, what it was taken for, and why there is no fix.

import {age, deg, el, set, shade} from "./words.js";

const LIGHT = 0, STAR = 1, STRANGER = 2, STREAK = 3, NOT_SEEN = 255;

export class Camera {
  constructor(link) {
    this.link = link;
    this.canvas = document.getElementById("picture");
    this.choice = document.getElementById("camera-vehicle");
    this.choice.onchange = () => this.look(true);
  }

  page(rig) {
    const names = Object.keys(rig.vehicles).filter((name) => rig.vehicles[name].stars);
    this.choice.replaceChildren(...names.map((name) => el("option", {value: name}, name)));
    if (this.isShown) this.look(true);
    if (!names.length) set(document.getElementById("camera-words"), "No vehicle of this rig has a star camera.");
  }

  look(isShown) {
    this.isShown = isShown;
    this.link.wish("camera", {type: "camera", vehicle: isShown ? this.choice.value : ""});
  }

  async take(head, blob) {
    const picture = await createImageBitmap(blob);
    const words = document.getElementById("camera-words");
    set(words, head.reason ? `${head.vehicle}: no fix: ${head.reason}` : `${head.vehicle}: fix at x ${head.pose[0].toFixed(3)} m, y ${head.pose[1].toFixed(3)} m, heading ${deg(head.pose[2]).toFixed(1)} deg, from ${head.spots.filter(([, , kind]) => kind === STAR).length} stars`);
    words.className = head.reason ? "bad" : "good";
    const {canvas} = this, g = canvas.getContext("2d");
    canvas.width = picture.width; canvas.height = picture.height;
    g.drawImage(picture, 0, 0);
    picture.close();
    g.font = "11px system-ui"; g.lineWidth = 1.5;
    for (const [u, v, kind] of head.spots) this.ring(g, u, v, kind === STAR ? "#3ddc84" : kind === STRANGER || kind === STREAK ? "#ff6b6b" : "#5bb8ff", kind === STAR ? 7 : 9, []);
    for (const [name, u, v, spot] of head.stars) {
      if (spot === NOT_SEEN) this.ring(g, u, v, "#ffc766", 10, [3, 3]);
      else { g.fillStyle = "#9fb8cc"; g.fillText(name, u + 10, v - 6); }
    }
  }

  ring(g, u, v, style, radius, dash) {
    g.strokeStyle = style; g.setLineDash(dash); g.beginPath(); g.arc(u, v, radius, 0, 7); g.stroke(); g.setLineDash([]);
  }
}
