// The web socket: reconnects with increasing delay, sends requests of the page, distributes the messages.
import { framesOf } from "./frames.js";

const PAUSE_MS_MAX = 8000;

export class Link {
  constructor({ onNews, onFrame, onState }) {
    Object.assign(this, { onNews, onFrame, onState });
    this.wishes = new Map(); // requests to repeat after a reconnection, by kind
    this.pauseMs = 250;
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.pauseMs = 250;
      for (const wish of this.wishes.values()) this.socket.send(JSON.stringify(wish));
      this.onState(true);
    };
    this.socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.onNews(JSON.parse(data));
      else for (const frame of framesOf(data)) this.onFrame(frame);
    };
    this.socket.onclose = (event) => {
      this.onState(false);
      if (event.code === 1008) {
        location.reload();
        return;
      }
      if (event.code === 4000) this.pauseMs = PAUSE_MS_MAX; // another browser has this place
      setTimeout(() => this.connect(), this.pauseMs);
      this.pauseMs = Math.min(2 * this.pauseMs, PAUSE_MS_MAX);
    };
  }

  // `keep` is the name under which the request is repeated after a reconnection; a later one of this name replaces it.
  wish(wish, keep) {
    if (keep) this.wishes.set(keep, wish);
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(wish));
  }

  forget(keep) {
    this.wishes.delete(keep);
  }
}

export async function ask(path, query) {
  const answer = await fetch(`${path}?${new URLSearchParams(query)}`);
  if (answer.status === 401) location.reload();
  if (!answer.ok) throw new Error((await answer.json()).error);
  return answer.arrayBuffer();
}

export async function post(path, body) {
  const answer = await fetch(path, {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(body),
  });
  if (!answer.ok) throw new Error((await answer.json()).error);
}
