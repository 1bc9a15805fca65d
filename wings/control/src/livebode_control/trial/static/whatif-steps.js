// @ts-check
// Steps and torque noise of the described loop and of a trial, with their bands: predicted by the server as by
// `livebode tune` (trial_steps.py), for the trial on which the sliders rest.
import { axis, chart } from "./chart.js";
import { tr } from "./language.js";
import { ask, reason } from "./link.js";
import { element } from "./make.js";
import { colour } from "./theme.js";
import { textOf } from "./trial.js";
import { plain, signed } from "./words.js";

/** @import { Chart } from "./chart.js" */
/** @import { LoopFacts, NoiseRange, StepBand, StepsAnswer, StepsSide } from "./loop.js" */
/** @import { Trial } from "./trial.js" */
/** @typedef {"reference" | "disturbance"} Kind */

const REST_MS = 150;
/** @type {Record<Kind, string>} */
const TITLES = {
  reference: tr("Step of the reference"),
  disturbance: tr("Step of a disturbance at the plant input"),
};
const UNSTABLE = tr("After: the loop would be unstable. It has no step and no noise.");

class StepChart {
  /** @param {HTMLElement} host @param {Kind} kind */
  constructor(host, kind) {
    this.kind = kind;
    this.unit = "";
    this.title = element("h3", {}, TITLES[kind]);
    this.plot = element("div", { class: "plot", role: "img", "aria-label": TITLES[kind] });
    host.append(element("div", { class: "step", "data-name": kind }, this.title, this.plot));
    /** @type {Chart | null} */
    this.made = null;
  }

  build() {
    /** @param {string} ink @param {number[]} [dash] @returns {uPlot.Series} */
    const line = (ink, dash) => ({ stroke: () => colour(ink), width: 1.6, dash, points: { show: false } });
    /** @type {uPlot.Series} */
    const edge = { stroke: () => "transparent", width: 0, points: { show: false } };
    const faint = (/** @type {string} */ ink) => () => `${colour(ink)}38`;
    return chart(
      this.plot,
      {
        padding: [6, 12, 0, 0],
        cursor: { show: false },
        scales: { x: { time: false }, y: {} },
        axes: [
          axis(tr("time in ms"), { size: 22, labelSize: 15, space: 44 }),
          axis(() => this.unit, { size: 46, space: 22, values: (_u, splits) => splits.map((v) => plain(v, 3)) }),
        ],
        series: [{}, line("measured"), line("t8", [7, 3]), edge, edge, edge, edge],
        bands: [
          { series: [4, 3], fill: faint("measured") },
          { series: [6, 5], fill: faint("t8") },
        ],
      },
      [[], [], [], [], [], [], []],
    );
  }

  /** @param {number[]} timeMs @param {StepBand | null} before @param {StepBand} after @param {string} unit of a step of 1; empty if it is 1 */
  draw(timeMs, before, after, unit) {
    this.unit = unit;
    this.made ??= this.build();
    const absent = timeMs.map(() => null);
    const of = (/** @type {StepBand | null} */ one, /** @type {keyof StepBand} */ name) => one?.[name] ?? absent;
    this.made.setData([
      timeMs,
      of(before, "value"),
      after.value,
      of(before, "low"),
      of(before, "high"),
      of(after, "low"),
      of(after, "high"),
    ]);
    const last = after.value.length - 1,
      peak = Math.max(...after.value.map(Math.abs));
    const words = tr("{title}, after: largest {peak} {unit}, {last} at {time} ms", {
      title: TITLES[this.kind],
      peak: plain(peak, 3),
      unit,
      last: plain(after.value[last], 3),
      time: plain(timeMs[last], 3),
    });
    this.plot.setAttribute("aria-label", words);
  }
}

export class TrialSteps {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host;
    this.words = element("p", { class: "note", role: "status" });
    this.noise = element("p", { class: "noise" });
    this.legend = element(
      "p",
      { class: "note steps-legend" },
      element("span", { class: "before" }, tr("before")),
      element("span", { class: "after" }, tr("after")),
      element("span", {}, tr("shaded: 95 % band")),
    );
    const charts = element("div", { class: "steps" });
    host.append(charts, this.legend, this.noise, this.words);
    /** @type {StepChart[]} */
    this.charts = [];
    this.plots = charts;
    this.axis = 0;
    /** @type {LoopFacts | null} */
    this.facts = null;
    /** The newest trial; null if it is unstable. @type {string | null} */
    this.text = null;
    /** What is shown. @type {StepsAnswer | null} */
    this.answer = null;
    this.asking = this.rested = false;
    this.timer = 0;
    this.clear("");
  }

  /** The card shows this trial: its steps follow when it has rested. @param {number} axis @param {LoopFacts} facts @param {Trial} trial @param {boolean} stable */
  follow(axis, facts, trial, stable) {
    const text = stable ? textOf(trial) : null;
    if (facts === this.facts && text === this.text) return;
    Object.assign(this, { axis, facts, text });
    clearTimeout(this.timer);
    this.rested = false;
    if (!facts.band) this.clear("");
    else if (text === null) this.clear(UNSTABLE);
    else {
      this.host.classList.add("older");
      this.timer = setTimeout(() => this.renew(), REST_MS);
    }
  }

  /** One request at a time; the answer of a trial that is not the newest one is dropped. */
  async renew() {
    this.rested = true;
    if (this.asking) return;
    this.asking = true;
    const { axis, facts, text } = this,
      newest = () => facts === this.facts && text === this.text;
    try {
      const found = await ask("/api/steps", { axis, trial: text });
      if (newest()) this.show(JSON.parse(new TextDecoder().decode(found)));
    } catch (error) {
      if (newest()) this.clear(reason(error));
    }
    this.asking = false;
    if (!newest() && this.rested) this.renew();
  }

  /** @param {string} words */
  clear(words) {
    this.answer = null;
    this.host.classList.remove("older");
    this.say(words);
    for (const one of [this.plots, this.legend, this.noise]) one.hidden = true;
  }

  /** @param {string} words */
  say(words) {
    this.words.hidden = !words;
    if (this.words.textContent !== words) this.words.textContent = words;
  }

  /** @param {StepsAnswer} answer */
  show(answer) {
    const { before, after } = answer;
    if (!after) {
      this.clear(UNSTABLE);
      return;
    }
    this.answer = answer;
    this.host.classList.remove("older");
    for (const one of [this.plots, this.legend]) one.hidden = false;
    const kinds = /** @type {Kind[]} */ (after.disturbance ? ["reference", "disturbance"] : ["reference"]);
    if (this.charts.length !== kinds.length) {
      for (const { made } of this.charts) made?.destroy();
      this.plots.replaceChildren();
      this.charts = kinds.map((kind) => new StepChart(this.plots, kind));
    }
    const unit = answer.unit || "y/u";
    for (const one of this.charts) {
      const side = after[one.kind];
      if (side) one.draw(answer.time_ms, before?.[one.kind] ?? null, side, one.kind === "reference" ? "" : unit);
    }
    this.noise.hidden = !after.noise;
    if (after.noise) this.noise.textContent = noiseWords(before?.noise ?? null, after.noise);
    this.say(remarks(answer, after));
  }
}

/** @param {NoiseRange | null} before @param {NoiseRange} after */
function noiseWords(before, after) {
  const one = (/** @type {NoiseRange | null} */ range) =>
    range === null
      ? tr("unstable")
      : range.low === null || range.high === null
        ? plain(range.value, 3)
        : `${plain(range.value, 3)} (${plain(range.low, 3)} … ${plain(range.high, 3)})`;
  const words = tr("Torque noise (rms, for white noise of 1 at the output): {before} before, {after} after", {
    before: one(before),
    after: one(after),
  });
  return before ? `${words}: ${signed(20 * Math.log10(after.value / before.value), 1)} dB` : words;
}

/** @param {StepsAnswer} answer @param {StepsSide} after */
function remarks({ before, places }, after) {
  return [
    before ? "" : tr("The described loop would be unstable: it has no step."),
    after.reference.low ? "" : tr("⚠ The loop of a plant within the bounds may be unstable: there is no band."),
    places > 1 ? tr("Steps: at the first of {places} places. Torque noise: of the worst.", { places }) : "",
  ]
    .filter(Boolean)
    .join(" ");
}
