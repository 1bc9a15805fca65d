// @ts-check
// The web socket: reconnects with increasing delay, sends requests of the page, distributes the messages.
import { tr } from "./language.js";
import { worded } from "./worded.js";

/** @import { News, ClientRequest } from "./messages.js" */

const PAUSE_MS_MAX = 8000;
// The page of one run of many is /run/NAME/, and its requests are below that.
const HERE = new URL(".", location.href).pathname;

/** @param {string} path with a leading slash */
export const below = (path) => HERE + path.slice(1);

/**
 * @template {object} [Sent=News] what the server sends as JSON
 * @template {object} [Request=ClientRequest] what the page asks for
 */
export class Link {
  /**
   * @param {object} listeners
   * @param {(news: Sent) => void} listeners.onNews
   * @param {(data: ArrayBuffer) => void} listeners.onBytes
   * @param {(up: boolean) => void} listeners.onState
   */
  constructor({ onNews, onBytes, onState }) {
    this.onNews = onNews;
    this.onBytes = onBytes;
    this.onState = onState;
    /** @type {Map<string, Request>} requests to repeat after a reconnection, by kind */
    this.repeated = new Map();
    this.pauseMs = 250;
    this.socket = this.connect();
  }

  connect() {
    const socket = new WebSocket(
      `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${below("/live")}`,
    );
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.pauseMs = 250;
      for (const request of this.repeated.values()) socket.send(JSON.stringify(request));
      this.onState(true);
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.onNews(JSON.parse(data));
      else this.onBytes(data);
    };
    socket.onclose = (event) => {
      this.onState(false);
      if (event.code === 1008) {
        location.reload();
        return;
      }
      if (event.code === 4000) this.pauseMs = PAUSE_MS_MAX; // another browser has this place
      setTimeout(() => {
        this.socket = this.connect();
      }, this.pauseMs);
      this.pauseMs = Math.min(2 * this.pauseMs, PAUSE_MS_MAX);
    };
    return socket;
  }

  /**
   * @param {Request} request
   * @param {string} [keep] name under which the request is repeated after a reconnection; a later one replaces it
   */
  request(request, keep) {
    if (keep) this.repeated.set(keep, request);
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }

  /** @param {string} keep */
  forget(keep) {
    this.repeated.delete(keep);
  }
}

/** @typedef {Record<string, string | number | null>} Query */

/**
 * @param {string} path
 * @param {Query} query
 */
export const address = (path, query) =>
  `${below(path)}?${new URLSearchParams(Object.entries(query).map(([name, value]) => [name, String(value)]))}`;

/**
 * @param {string} path
 * @param {Query} query
 */
export async function ask(path, query) {
  const answer = await fetch(address(path, query));
  if (answer.status === 401) location.reload();
  if (!answer.ok) throw await refusal(answer);
  return answer.arrayBuffer();
}

/**
 * What a person reads of an error.
 *
 * @param {unknown} error
 */
export const reason = (error) => (error instanceof Error ? error.message : String(error));

/**
 * The JSON of the answer.
 *
 * @param {string} path
 * @param {object} body
 */
export async function post(path, body) {
  const answer = await fetch(below(path), {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(body),
  });
  if (!answer.ok) throw await refusal(answer);
  return answer.json();
}

/**
 * The error of an answer, in the language of the page.
 *
 * @param {Response} answer
 */
export const refusal = async (answer) => new Error(refused(answer.status, await answer.text()));

/**
 * What a person reads of an answer that is none: the words of the server, or where it has failed itself, what to do.
 *
 * @param {number} status
 * @param {string} body
 */
export function refused(status, body) {
  try {
    const { error, words } = JSON.parse(body);
    return worded(words ?? error);
  } catch {
    if (status < 500 && body) return worded(body);
    return tr("Internal error of the server ({status}); its terminal shows the cause. Try again.", { status });
  }
}
