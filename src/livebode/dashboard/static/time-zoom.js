// @ts-check
// The span of time of the tracking plot, the map and the trends: wheel, drag, two fingers and keys; fetched in the
// resolution that fits.
import { remember } from "./address.js";
import { moment, onClock, toAddress } from "./clock.js";
import { gestures } from "./gestures.js";
import { tr } from "./language.js";
import { timeInAddress } from "./shared.js";
import { scaled, shifted } from "./zoom.js";

/** @import { Chart } from "./chart.js" */
/** @import { Page, Span } from "./messages.js" */

const FETCH_MS = 150,
  LEAST_S = 0.05,
  PAN = 0.2,
  STEP = 1.5;

export class TimeZoom {
  /**
   * @param {Page} page
   * @param {import("./tracking.js").Tracking} tracking
   * @param {import("./timeline.js").Timeline} timeline
   * @param {HTMLElement} button shows the span, and ends it
   * @param {() => void} fill
   */
  constructor(page, tracking, timeline, button, fill) {
    this.page = page;
    this.tracking = tracking;
    this.timeline = timeline;
    this.button = button;
    this.fill = fill;
    this.waiting = 0;
    /** @type {number | null} the time that was shown before a click */
    this.before = null;
    tracking.host.addEventListener("keydown", (event) => this.key(event));
    button.addEventListener("click", () => this.reset());
    tracking.onBuilt = (u) => {
      if (tracking.over === "time") gestures(u, this.actions(u), "x");
    };
    onClock(() => this.draw());
  }

  /** @param {Chart} u @returns {import("./gestures.js").Gestures} */
  actions(u) {
    // Not of the chart, which is drawn later.
    const at = (/** @type {number} */ share) => this.seen[0] + share * (this.seen[1] - this.seen[0]);
    return {
      scale: (x, _y, factor) => this.scale(at(x), factor),
      shift: (x) => this.pan(x),
      box: (x) => x && this.set(at(x[0]), at(x[1])),
      place: () => {
        this.before = this.timeline.atS;
        this.timeline.go(at((u.cursor.left ?? 0) / u.over.clientWidth));
      },
      reset: () => this.back(),
    };
  }

  // Two clicks show all, at the time that was shown before the first of them.
  back() {
    if (this.before !== null) this.timeline.go(this.before);
    else if (this.timeline.atS !== null) this.timeline.newest();
    this.reset();
  }

  /** @returns {[from: number, to: number]} */
  get seen() {
    return this.page.zoom ?? [this.tracking.fromS, this.tracking.toS];
  }

  /**
   * @param {number} from
   * @param {number} to
   */
  set(from, to) {
    const { first_s: first, last_s: last } = this.timeline.span,
      size = Math.max(LEAST_S, to - from);
    if (this.tracking.over !== "time" || !(last > first) || !Number.isFinite(from + to)) return;
    if (size >= last - first) {
      this.reset();
      return;
    }
    const begin = Math.min(last - size, Math.max(first, from));
    this.page.zoom = [begin, begin + size];
    this.changed();
  }

  reset() {
    if (!this.page.zoom) return;
    this.page.zoom = null;
    this.page.rows.clear();
    this.changed();
  }

  changed() {
    const { zoom, dirty } = this.page;
    remember("from", zoom ? toAddress(zoom[0]) : "", "");
    remember("to", zoom ? toAddress(zoom[1]) : "", "");
    dirty.add("rows").add("trends");
    clearTimeout(this.waiting);
    this.waiting = setTimeout(this.fill, FETCH_MS);
    this.draw();
  }

  draw() {
    const { zoom } = this.page;
    this.button.hidden = !zoom;
    if (!zoom) return;
    const span = tr("{from} to {to}", { from: moment(zoom[0], true), to: moment(zoom[1], true) });
    this.button.textContent = `${span} ✕`;
  }

  /**
   * The span of the address.
   *
   * @param {Span} span
   * @param {(text: string) => void} complain
   */
  restore(span, complain) {
    const from = timeInAddress("from", span, complain),
      to = timeInAddress("to", span, complain);
    if (to > from) this.set(from, to);
  }

  // A run with other times has begun.
  renew() {
    const { first_s: first, last_s: last } = this.timeline.span,
      { zoom } = this.page;
    if (zoom && (zoom[1] <= first || zoom[0] >= last)) this.reset();
  }

  /**
   * @param {number} atS stays where it is
   * @param {number} factor
   */
  scale(atS, factor) {
    this.set(...scaled(this.seen, atS, factor, false));
  }

  /** @param {number} share of the span */
  pan(share) {
    if (this.page.zoom) this.set(...shifted(this.seen, share, false));
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const [from, to] = this.seen,
      middle = (from + to) / 2;
    /** @type {Record<string, () => void>} */
    const acts = {
      ArrowLeft: () => this.pan(-PAN),
      ArrowRight: () => this.pan(PAN),
      "+": () => this.scale(middle, 1 / STEP),
      "-": () => this.scale(middle, STEP),
      0: () => this.reset(),
      Escape: () => this.reset(),
    };
    const act = acts[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    act();
  }
}
