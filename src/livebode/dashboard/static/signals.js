// @ts-check
// The last second of the raw signals, or their spectrum: of the moment shown if the samples are recorded.
import { moment } from "./clock.js";
import { tr } from "./language.js";
import { ask, reason } from "./link.js";
import { answerOf, inSourceUnits } from "./signal-answer.js";
import { SignalChart } from "./signal-chart.js";
import { plain } from "./words.js";

/** @import { Page, Run } from "./messages.js" */
/** @import { Answer } from "./signal-answer.js" */

// The server retains samples only while a page asks at least every 2 s.
const EVERY_MS = 200;
/** @type {Record<string, string>} */
const WHY_NOT = {
  collecting: tr("Waiting for samples."),
  spectra: tr("This source sends spectra: the page has no samples."),
  unrecorded: tr("The samples of this time are not recorded: set samples = true under [record]."),
  outside: tr("The record has no samples of this time."),
};
/** @type {Record<string, string>} */
const ROLES = {
  excitation: tr("excitation"),
  input: tr("input"),
  output: tr("output"),
  schedule: tr("schedule"),
};

export class Signals {
  /**
   * @param {{words: HTMLElement, charts: HTMLElement}} hosts
   * @param {Page} page
   * @param {import("./timeline.js").Timeline} timeline
   * @param {import("./view.js").View} view
   */
  constructor(hosts, page, timeline, view) {
    this.hosts = hosts;
    this.page = page;
    this.timeline = timeline;
    this.view = view;
    /** @type {"time" | "spectrum"} */
    this.picture = "time";
    /** @type {SignalChart[]} */
    this.charts = [];
    /** @type {Answer | null} */
    this.answer = null;
    this.request = "";
    // Run and picture of the answer if it has the newest samples of a live run.
    this.newest = "";
    this.layout = "";
    this.repeat();
  }

  async repeat() {
    try {
      if (this.seen()) await this.renew();
    } catch (error) {
      this.say(reason(error));
      this.request = "";
    }
    setTimeout(() => this.repeat(), EVERY_MS);
  }

  // Whether a person can see them: not in the wall mode, nor on another tab.
  seen() {
    return this.page.up && this.page.facts?.begun && !document.hidden && this.hosts.charts.offsetParent !== null;
  }

  get asked() {
    const spectrum = this.view.linear ? "linear" : "log";
    return { axis: this.page.axis, picture: this.picture === "time" ? "time" : spectrum };
  }

  // Run and kind of picture that are chosen.
  get chosen() {
    const { page, picture } = this;
    return JSON.stringify([page.axis, page.facts?.begun && page.facts.directory, picture]);
  }

  async renew() {
    const { timeline, asked, chosen } = this,
      atS = timeline.atS,
      live = atS === null && timeline.span.live;
    const request = JSON.stringify([chosen, asked, live ? null : (atS ?? timeline.span.last_s)]);
    if (!live && this.contains(atS)) {
      if (this.layout !== this.layoutOf(this.names)) this.draw(); // the view has changed
      return;
    }
    if (!live && request === this.request && this.layout === this.layoutOf(this.names)) return;
    const buffer = await ask("/api/signals", atS === null ? asked : { ...asked, at: atS });
    // Another choice was made in the meantime; its own answer follows.
    if (chosen !== this.chosen || atS !== timeline.atS) return;
    this.request = request;
    this.newest = live ? chosen : "";
    this.answer = answerOf(buffer, this.picture === "spectrum");
    this.draw();
  }

  /**
   * Whether the newest samples are shown and contain the window of the moment at which a person has just paused.
   *
   * @param {number | null} atS
   */
  contains(atS) {
    const { answer, page } = this,
      { facts } = page;
    if (this.newest !== this.chosen || atS === null || !answer || !facts?.begun) return false;
    const halfS = facts.window / facts.rate_hz / 2;
    return answer.from_s <= atS - halfS && atS + halfS <= answer.to_s;
  }

  // The clock has changed.
  redraw() {
    this.layout = "";
    this.draw();
  }

  clear() {
    this.answer = null;
    this.request = this.newest = "";
    this.lay([]);
    this.say("");
  }

  get names() {
    return this.answer && !this.answer.why_not ? this.answer.channels.map(({ name }) => name) : [];
  }

  draw() {
    const { answer, page } = this;
    if (!answer || !page.facts?.begun) return;
    this.lay(this.names);
    for (const [i, chart] of this.charts.entries()) {
      const channel = answer.channels[i];
      chart.draw(answer, this.view.inDrive ? inSourceUnits(channel) : channel, rolesOf(page.facts, channel.name));
    }
    this.say(answer.why_not ? WHY_NOT[answer.why_not] : this.words(answer));
  }

  /** @param {string[]} names */
  layoutOf(names) {
    return JSON.stringify([names, this.picture, this.view.options]);
  }

  /** @param {string[]} names */
  lay(names) {
    const spectrum = this.picture === "spectrum",
      layout = this.layoutOf(names);
    if (layout === this.layout) return;
    this.layout = layout;
    for (const chart of this.charts) chart.remove();
    this.charts = names.map((name) => new SignalChart(this.hosts.charts, name, spectrum, this.view));
  }

  /** @param {Answer} answer */
  words({ from_s: from, to_s: to, samples, rate_hz: rate }) {
    const span = tr("{from} to {to}", { from: moment(from, true), to: moment(to, true) }),
      count = tr("{n} samples at {rate} Hz", { n: samples, rate: plain(rate) }),
      how = tr("peak amplitude of a sine, Hann window, mean removed; ● excited lines, □ detection lines");
    return this.picture === "time" ? `${span}, ${count}` : `${span}: ${how}`;
  }

  /** @param {string} text */
  say(text) {
    if (this.hosts.words.textContent !== text) this.hosts.words.textContent = text;
  }
}

/**
 * The roles of a channel in the configuration.
 *
 * @param {Run} facts
 * @param {string} name
 */
const rolesOf = ({ signals }, name) =>
  Object.entries(ROLES)
    .filter(([role]) => signals[role] === name)
    .map(([, words]) => words)
    .join(", ");
