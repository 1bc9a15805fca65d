// @ts-check
// The time that is shown: the newest, or a time in the record.
import { moment } from "./clock.js";
import { tr } from "./language.js";

/** @typedef {Omit<import("./messages.js").Span, "clock" | "start_s">} Span */

export class Timeline {
  /**
   * @param {{slider: HTMLInputElement, pause: HTMLElement, from: HTMLElement, to: HTMLElement, now: HTMLElement}} parts
   * @param {{onMoment: (timeS: number) => void, onLive: () => void}} listeners
   */
  constructor({ slider, pause, from, to, now }, { onMoment, onLive }) {
    this.slider = slider;
    this.pause = pause;
    this.from = from;
    this.to = to;
    this.now = now;
    this.onMoment = onMoment;
    this.onLive = onLive;
    this.span = { first_s: NaN, last_s: NaN, live: false, growing: false };
    /** @type {number | null} null follows the newest */
    this.atS = null;
    slider.addEventListener("input", () => this.go(this.value()));
    pause.addEventListener("click", () => this.toggle());
  }

  value() {
    const { first_s: first, last_s: last } = this.span;
    return first + (Number(this.slider.value) / 1000) * (last - first);
  }

  /** @param {Span} span */
  take(span) {
    this.span = { ...span, first_s: span.first_s ?? NaN, last_s: span.last_s ?? NaN };
    const { first_s: first, last_s: last } = this.span;
    // The time that is shown belongs to a previous run.
    if (this.atS !== null && (this.atS < first || this.atS > last)) this.go(this.atS);
    else this.draw();
  }

  /**
   * Show a time in the record.
   *
   * @param {number} timeS
   */
  go(timeS) {
    const { first_s: first, last_s: last } = this.span;
    if (!Number.isFinite(first)) return;
    this.atS = Math.min(last, Math.max(first, timeS));
    this.draw();
    this.onMoment(this.atS);
  }

  /** @param {number} byS */
  step(byS) {
    this.go((this.atS ?? this.span.last_s) + byS);
  }

  toggle() {
    if (this.atS === null) this.go(this.span.last_s);
    else {
      this.atS = null;
      this.draw();
      this.onLive();
    }
  }

  draw() {
    const { first_s: first, last_s: last, live } = this.span,
      paused = this.atS !== null,
      shown = this.atS ?? last;
    this.slider.value = String(paused && last > first ? (1000 * (shown - first)) / (last - first) : 1000);
    this.slider.setAttribute("aria-valuetext", moment(shown));
    this.from.textContent = moment(first);
    this.to.textContent = moment(last);
    this.now.textContent = !Number.isFinite(first)
      ? ""
      : paused
        ? tr("shown: {time}", { time: moment(shown, true) })
        : live
          ? tr("newest")
          : tr("end");
    this.pause.textContent = paused ? (live ? tr("Live") : tr("End")) : tr("Pause");
    this.pause.classList.toggle("primary", paused);
  }
}
