// @ts-check
// The web socket of a fleet's page: looks of all axes as bytes (fleet_pages.py), lists as JSON.
import { below, Link } from "./link.js";

/**
 * @typedef {object} AxisRow An axis in a list; see fleet_board.py.
 * @property {number} axis
 * @property {number} look
 * @property {string} parameter
 * @property {string} kind
 * @property {"none" | "low" | "medium" | "high"} priority
 * @property {string} state
 * @property {number | null} effective_s
 * @property {number | null} lag_s
 * @property {number | null} value
 * @property {number | null} bound
 * @property {number | null} change_percent
 * @property {number} lost
 * @property {number} gaps
 * @property {number} raised
 * @property {number} raised_s
 * @property {string} [by]
 * @property {string} [comment]
 * @property {{by: string, until_s: number, reason: string} | null} [shelf]
 * @property {string} [unit]
 * @property {string} [url]
 * @property {number} [partition]
 * @property {string} [worker]
 */
/** @typedef {{worker: string, partitions: number, axes: number, waiting: number, lag_s: number, age_s: number}} Worker */
/** @typedef {{partition: number, axes: number, age_s: number | null}} Silent */
/** @typedef {{rows: Worker[], count: number, partitions: number, silent: Silent[], silent_count: number, waiting: number, dropped: number}} Workers */
/** @typedef {{rows: AxisRow[], count: number}} Alarms */
/** @typedef {{rows: AxisRow[], axes: number, gaps: number, lost: number}} Gaps */
/** @typedef {{name: string, role: string, layout: number, axes: number, plan: boolean, trends: string}} Fleet */
/**
 * @typedef {object} News
 * @property {Fleet} [fleet]
 * @property {number} [layout]
 * @property {string} [trouble]
 * @property {number} [open]
 * @property {AxisRow[]} [worst]
 * @property {Alarms} [alarms]
 * @property {Gaps} [gaps]
 * @property {Workers} [workers]
 * @property {AxisRow | null} [axis]
 * @property {string} [error]
 * @property {import("./messages.js").Words} [words]
 */

const AXIS = 0x0fffffff;

export class FleetFeed {
  /** @type {Fleet | null} */
  fleet = null;
  /** @type {string[]} path of each axis */
  paths = [];
  looks = new Uint8Array();
  /** @type {Record<string, unknown>} */
  watched = { list: "worst", axis: null };
  /** @type {Link<News, Record<string, unknown>> | null} */
  link = null;
  frames = 0;

  /**
   * @param {object} listeners
   * @param {() => void} listeners.onAxes other axes
   * @param {() => void} listeners.onLooks
   * @param {(news: News) => void} listeners.onNews
   * @param {(up: boolean) => void} listeners.onState
   */
  constructor(listeners) {
    this.listeners = listeners;
  }

  start() {
    let waiting = Promise.resolve();
    /** @param {() => void | Promise<void>} take */
    const inOrder = (take) => {
      waiting = waiting.then(take); // the axes are fetched between two messages
    };
    this.link = new Link({
      onNews: (news) => inOrder(() => this.take(news)),
      onBytes: (data) => inOrder(() => this.frame(data)),
      onState: this.listeners.onState,
    });
    this.watch({});
  }

  /** @param {Record<string, unknown>} change of the list, or of the axis */
  watch(change) {
    this.watched = { ...this.watched, ...change };
    this.link?.request(this.watched, "watched");
  }

  /** @param {News} news */
  async take(news) {
    if (news.fleet) await this.begin(news.fleet);
    if (news.layout === undefined || news.layout === this.fleet?.layout) this.listeners.onNews(news);
  }

  /** @param {Fleet} fleet */
  async begin(fleet) {
    const answer = await fetch(below("/api/axes"));
    if (!answer.ok) return;
    const text = await answer.text();
    this.fleet = { ...fleet, layout: Number(answer.headers.get("x-layout")) };
    this.paths = text ? text.split("\n") : [];
    this.looks = new Uint8Array(this.paths.length);
    this.listeners.onAxes();
  }

  /** @param {ArrayBuffer} buffer */
  frame(buffer) {
    const view = new DataView(buffer),
      count = view.getUint32(12, true);
    if (view.getUint32(0) !== 0x4c424654 || view.getUint8(4) !== 1) throw new Error("this is not a frame of tiles");
    if (view.getUint32(8, true) !== this.fleet?.layout) return; // of axes that are being replaced
    const { looks } = this;
    if (view.getUint8(5) === 1) {
      for (const word of new Uint32Array(buffer, 16, count)) looks[word & AXIS] = word >>> 28;
    } else {
      const pairs = new Uint8Array(buffer, 16);
      for (let i = 0; i < count; i++) looks[i] = (pairs[i >> 1] >> (4 * (i & 1))) & 15;
    }
    this.frames++;
    this.listeners.onLooks();
  }
}
