// One WebSocket: frames in, wishes out. It comes back by itself, and says how fresh what is shown is.

const STALE_MS = 700, RETRY_MS = 400, LONGEST_RETRY_MS = 3000;

export class Link {
  constructor(hear) {
    this.hear = hear;            // {json(message), picture(head, blob), chart(fields), condition(word)}
    this.wishes = new Map();     // what this screen shows: told again after each reconnection
    this.retry = RETRY_MS;
    this.last = 0;
    this.open();
    setInterval(() => this.judge(), 100);
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.socket = new WebSocket(`${scheme}://${location.host}/ws`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.retry = RETRY_MS;
      for (const wish of this.wishes.values()) this.socket.send(JSON.stringify(wish));
    };
    this.socket.onmessage = (event) => this.take(event.data);
    this.socket.onclose = () => {
      this.judge();
      setTimeout(() => this.open(), this.retry);
      this.retry = Math.min(this.retry * 1.6, LONGEST_RETRY_MS);
    };
  }

  take(data) {
    const kind = String.fromCharCode(new Uint8Array(data, 0, 1)[0]);
    if (kind === "J") {
      const message = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 1)));
      if (message.type === "state") this.last = performance.now();
      this.hear.json(message);
      return;
    }
    const length = new DataView(data).getUint32(1, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 5, length)));
    let at = 5 + length;
    if (kind === "P") {
      this.hear.picture(head, new Blob([new Uint8Array(data, at)], {type: `image/${head.format.split(";").pop().trim() || "png"}`}));
    } else if (kind === "C") {
      for (const field of head.fields) {
        field.times = new Float64Array(data.slice(at, at += 8 * field.count));
        field.values = new Float64Array(data.slice(at, at += 8 * field.count));
      }
      this.hear.chart(head.fields);
    }
  }

  judge() {
    const isOpen = this.socket.readyState === WebSocket.OPEN;
    const isFresh = performance.now() - this.last < STALE_MS;
    this.hear.condition(!isOpen ? "disconnected" : isFresh ? "live" : "stale");
  }

  wish(name, message) {
    this.wishes.set(name, message);
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  send(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}

export async function post(path, body) {
  const token = sessionStorage.getItem("lease") || localStorage.getItem("lease") || "";
  try {
    const answer = await fetch(path, {
      method: "POST", headers: {"Content-Type": "application/json", "X-Lease-Token": token}, body: JSON.stringify(body),
    });
    return await answer.json();
  } catch {
    return {accepted: false, reason: "the console does not answer"};
  }
}
