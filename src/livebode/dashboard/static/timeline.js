// @ts-check
// The time that is shown: the newest, or a time in the record; a finished recording is played.
import { moment } from "./clock.js";
import { tr } from "./language.js";

/** @typedef {Omit<import("./messages.js").Span, "clock" | "start_s">} Span */

const TICK_MS = 100;

export class Timeline {
  /**
   * @param {{slider: HTMLInputElement, pause: HTMLElement, from: HTMLElement, to: HTMLElement, now: HTMLElement}} parts
   * @param {{onMoment: (timeS: number) => void, onLive: () => void, drawnS: () => number | undefined}} page `drawnS`: the time of the response that is drawn
   */
  constructor({ slider, pause, from, to, now }, { onMoment, onLive, drawnS }) {
    this.slider = slider;
    this.pause = pause;
    this.from = from;
    this.to = to;
    this.now = now;
    this.onMoment = onMoment;
    this.onLive = onLive;
    this.drawnS = drawnS;
    this.span = { first_s: NaN, last_s: NaN, live: false, growing: false };
    /** @type {number | null} null follows the newest */
    this.atS = null;
    this.playing = 0;
    slider.addEventListener("input", () => {
      if (!this.following && slider.value === slider.max) this.newest();
      else this.go(this.value());
    });
    pause.addEventListener("click", () => this.toggle());
  }

  /** Whether data are still added. */
  get following() {
    return this.span.live || this.span.growing;
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

  /** Pause or resume what is recorded now; play or pause a finished recording. */
  toggle() {
    if (this.playing) this.stop();
    else if (!this.following) this.play();
    else if (this.atS === null) this.go(this.span.last_s);
    else this.newest();
  }

  /** Show the newest, or the end of a finished recording. */
  newest() {
    this.stop();
    this.atS = null;
    this.draw();
    this.onLive();
  }

  /** As fast as it was recorded, from the time that is shown; from the start if that is the end. */
  play() {
    const { first_s: first, last_s: last } = this.span;
    if (!(last > first)) return;
    if (this.atS === null || this.atS >= last) this.go(first);
    let beforeMs = performance.now();
    this.playing = setInterval(() => {
      const nowMs = performance.now(),
        nextS = (this.atS ?? first) + (nowMs - beforeMs) / 1000;
      beforeMs = nowMs;
      if (nextS >= this.span.last_s) this.newest();
      else this.go(nextS);
    }, TICK_MS);
    this.draw();
  }

  stop() {
    clearInterval(this.playing);
    this.playing = 0;
    this.draw();
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
        ? tr("shown: {time}", { time: moment(this.drawnS() ?? shown, true) })
        : live
          ? tr("newest")
          : tr("end");
    this.pause.textContent = this.words(paused);
    this.pause.classList.toggle("primary", paused && this.following);
  }

  /** What the button does. @param {boolean} paused */
  words(paused) {
    if (!this.following) return this.playing ? tr("Pause") : tr("Play");
    if (!paused) return tr("Pause");
    return this.span.live ? tr("Live") : tr("End");
  }
}
