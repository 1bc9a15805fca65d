// @ts-check
// The card "What if" beside the Bode plot: sliders for gains and filters, the margins that they give, and the values as text.
import { chosen, remember } from "./address.js";
import { tr } from "./language.js";
import { ask, reason } from "./link.js";
import { byId as $, element } from "./make.js";
import { slider } from "./slider.js";
import { factor, isNothing, NOTCHES_MAX, nothing, textOf, trialOf } from "./trial.js";
import { attach } from "./whatif-elements.js";
import { briefWords, TrialMargins } from "./whatif-margins.js";
import { TriedCurve } from "./whatif-marks.js";
import { TrialSteps } from "./whatif-steps.js";
import { checkWords, filtersText, tomlText } from "./whatif-text.js";
import { worded } from "./worded.js";
import { signed } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { LoopAnswer, LoopFacts } from "./loop.js" */
/** @import { Addition, Page, Quantity } from "./messages.js" */
/** @import { Trial } from "./trial.js" */

const AGAIN_MS = 10_000; // of a live run: its mean changes slowly
const SPAN = 20; // of a gain or a time to both sides
const HIGHEST = 0.48; // of the rate: filters are below half of it

/** @type {Record<string, [words: string, unit: string]>} */
const VALUES = {
  gain: [tr("gain"), ""],
  integral_time_s: [tr("integral time"), "s"],
  derivative_time_s: [tr("derivative time"), "s"],
  position_gain: [tr("position gain"), "1/s"],
};

export class WhatIfCard {
  /**
   * @param {Page} page
   * @param {Bode} bode
   * @param {{watch: (quantity: Quantity) => void, complain: (text: string) => void}} actions
   */
  constructor(page, bode, { watch, complain }) {
    this.page = page;
    this.bode = bode;
    this.watch = watch;
    this.complain = complain;
    attach();
    this.curve = bode.derived = new TriedCurve(bode);
    this.card = $("what-if-card");
    this.button = $("what-if");
    this.rows = $("what-if-rows");
    this.check = $("what-if-check");
    this.margins = new TrialMargins($("what-if-margins"));
    this.steps = new TrialSteps($("what-if-steps"));
    this.trial = trialOf(/** @type {string} */ (chosen("what-if", "")));
    /** @type {LoopFacts | null} */
    this.facts = null;
    this.of = "";
    this.button.addEventListener("click", () => this.open(Boolean(this.card.hidden)));
    this.card.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.open(false);
    });
    $("what-if-close").addEventListener("click", () => this.open(false));
    $("what-if-reset").addEventListener("click", () => this.try(nothing()));
    $("what-if-toml").addEventListener("click", () => this.copy(tomlText));
    $("what-if-biquads").addEventListener("click", () => this.copy(filtersText));
    $("what-if-open-loop").addEventListener("click", () => watch("open loop"));
    setInterval(() => this.again(), AGAIN_MS);
    // On a telephone the plot is above the sliders, without its coherence; see whatif.css.
    matchMedia("(max-width: 620px)").addEventListener("change", () => bode.rebuild());
    this.show(chosen("sliders", String()) === "1");
    this.changed();
  }

  /** @param {boolean} open */
  show(open) {
    this.card.hidden = !open;
    this.card.parentElement?.classList.toggle("trying", open);
    this.button.setAttribute("aria-expanded", String(open));
    $("what-if-brief").hidden = !open;
    this.curve.alone = open;
    this.bode.rebuild();
  }

  /** @param {boolean} open */
  open(open) {
    remember("sliders", open ? "1" : "", "");
    this.show(open);
    this.begin();
    this.page.dirty.add("additions");
    if (!open) this.button.focus();
    else this.card.querySelector("input")?.focus();
  }

  get live() {
    return Boolean(this.page.facts?.live);
  }

  again() {
    if (this.live && !this.card.hidden) this.fetch();
  }

  /** Another axis or run, or other lines; nothing is requested until a person wants it. */
  begin() {
    const { page, card, trial } = this;
    if (!page.facts?.begun || (card.hidden && isNothing(trial))) return;
    const of = `${page.facts.directory} ${page.measured}`;
    if (of === this.of) return;
    this.of = of;
    this.facts = null;
    this.fetch();
  }

  async fetch() {
    const { page, of } = this;
    try {
      const answer = await ask("/api/loop", { axis: page.axis });
      if (of === this.of) this.answered(JSON.parse(new TextDecoder().decode(answer)));
    } catch (error) {
      if (of === this.of) this.of = "";
      this.complain(reason(error));
    }
  }

  /** @param {LoopAnswer} answer */
  answered(answer) {
    const first = !this.facts;
    if (answer.described === undefined) {
      this.facts = null;
      this.check.className = "check open";
      this.check.textContent = worded(answer.why_not);
      $("what-if-margins").replaceChildren();
      this.steps.clear("");
      this.rows.replaceChildren();
      this.changed();
      return;
    }
    this.facts = answer;
    const [tone, words] = checkWords(answer);
    this.check.className = `check ${tone}`;
    this.check.textContent = words;
    this.margins.begin(answer);
    // Values in the address that this loop does not have, or that its rate does not permit.
    const { trial } = this,
      top = HIGHEST * answer.rate_hz;
    trial.values = Object.fromEntries(Object.entries(trial.values).filter(([name]) => name in answer.values));
    trial.notches = trial.notches.filter(({ hz }) => hz <= top);
    trial.lowPassHz = Math.min(trial.lowPassHz, top);
    if (first) this.fill();
    this.changed();
  }

  /** @param {Trial} trial */
  try(trial) {
    this.trial = trial;
    this.fill();
    this.changed();
  }

  /** The trial has changed: its curve and its margins follow at the next frame. */
  changed() {
    const { curve, facts, trial, page } = this,
      on = !isNothing(trial);
    remember("what-if", on ? textOf(trial) : "", "");
    curve.factor = on && facts ? (one) => factor(facts, trial, one) : null;
    this.button.classList.toggle("changed", on);
    // Without a loop there is no value to copy, and nothing to return to.
    for (const id of ["what-if-toml", "what-if-biquads", "what-if-reset"]) $(id).hidden = !facts;
    page.dirty.add("bode").add("additions");
  }

  /** A person has changed the trial: it is shown where it can be seen, which is not in the plant. */
  moved() {
    if (this.bode.quantity === "plant") this.watch("open loop");
    this.changed();
  }

  /** The table follows the sliders; called once a frame. */
  draw() {
    if (this.card.hidden || !this.facts) return;
    this.margins.draw(this.trial);
    this.steps.follow(this.page.axis, this.facts, this.trial, this.margins.after !== null);
    $("what-if-brief").textContent = this.facts.band ? briefWords(this.margins.after) : "";
    $("what-if-plant").hidden = this.bode.quantity !== "plant" || isNothing(this.trial);
  }

  /** All rows, from the described loop and the trial. */
  fill() {
    const { facts, rows } = this;
    if (!facts) return;
    const proposed = facts.proposed;
    rows.replaceChildren(
      ...Object.entries(facts.values).flatMap(([name, value]) => (value ? [this.valueRow(name, value)] : [])),
      ...this.trial.notches.map((_, i) => this.notchRows(i)),
      ...this.lowPassRows(),
      this.delayRow(),
      element(
        "div",
        { class: "row" },
        this.adding(),
        ...(this.trial.lowPassHz ? [] : [this.act(tr("add a low-pass"), () => this.addLowPass())]),
        ...(proposed ? [this.act(tr("proposed by livebode tune"), () => this.propose(proposed))] : []),
      ),
    );
  }

  /**
   * A button that changes which rows there are; the focus is then on the newest filter, or on the first row.
   *
   * @param {string} words
   * @param {() => void} act
   */
  act(words, act) {
    const onclick = () => {
      act();
      this.fill();
      this.moved();
      const filters = this.rows.querySelectorAll("fieldset");
      (filters[filters.length - 1] ?? this.rows).querySelector("input")?.focus();
    };
    return element("button", { type: "button", onclick }, words);
  }

  /** @param {string} name @param {number} described */
  valueRow(name, described) {
    const [words, unit] = VALUES[name] ?? [name, ""],
      size = Math.abs(described);
    return slider({
      name,
      words,
      unit,
      beside: name === "gain" ? (v) => `${signed(20 * Math.log10(Math.abs(v) / size), 1)} dB` : undefined,
      low: size / SPAN,
      high: size * SPAN,
      limits: described < 0 ? [-1e9, -1e-12] : [1e-12, 1e9],
      value: this.trial.values[name] ?? described,
      onChange: (v) => {
        if (v === described) delete this.trial.values[name];
        else this.trial.values[name] = v;
        this.moved();
      },
    });
  }

  /** Lowest and highest frequency of a filter. @returns {[number, number]} */
  band() {
    const { frequency_hz: hz = [1], rate_hz = 2 } = this.facts ?? {};
    return [Math.min(hz[0] / 2, 0.01 * rate_hz), HIGHEST * rate_hz];
  }

  /** @param {number} i */
  notchRows(i) {
    const notch = this.trial.notches[i],
      [low, high] = this.band();
    /** @param {"hz" | "depthDb" | "damping"} part @param {string} words @param {string} unit @param {number} from @param {number} to @param {[number, number]} limits */
    const row = (part, words, unit, from, to, limits) =>
      slider({
        name: `notch ${i + 1} ${part}`,
        words,
        unit,
        low: from,
        high: to,
        linear: part === "depthDb",
        limits,
        value: notch[part],
        onChange: (v) => {
          notch[part] = v;
          this.moved();
        },
      });
    return element(
      "fieldset",
      {},
      element("legend", {}, tr("notch {n}", { n: i + 1 })),
      row("hz", tr("frequency"), "Hz", low, high, [1e-3 * low, high]),
      row("depthDb", tr("depth"), "dB", 0, 40, [0, 80]),
      row("damping", tr("width (damping)"), "", 0.02, 2, [1e-3, 10]),
      this.removing(tr("remove notch {n}", { n: i + 1 }), () => this.trial.notches.splice(i, 1)),
    );
  }

  lowPassRows() {
    const { trial } = this,
      [low, high] = this.band();
    if (!trial.lowPassHz) return [];
    const row = slider({
      name: "low-pass",
      words: tr("corner (−3 dB)"),
      unit: "Hz",
      low,
      high,
      limits: [1e-3 * low, high],
      value: trial.lowPassHz,
      onChange: (v) => {
        trial.lowPassHz = v;
        this.moved();
      },
    });
    const gone = this.removing(tr("remove the low-pass"), () => {
      trial.lowPassHz = 0;
    });
    return [element("fieldset", {}, element("legend", {}, tr("low-pass of second order")), row, gone)];
  }

  delayRow() {
    const { trial } = this,
      rate = this.facts?.rate_hz ?? 1;
    return slider({
      name: "delay",
      words: tr("additional delay"),
      unit: "ms",
      low: 0,
      high: Number((20_000 / rate).toPrecision(1)),
      linear: true,
      limits: [0, 10_000],
      value: trial.delayMs,
      onChange: (v) => {
        trial.delayMs = v;
        this.moved();
      },
    });
  }

  /** @param {string} words @param {() => void} remove */
  removing(words, remove) {
    const made = this.act("×", remove);
    made.className = "remove";
    made.setAttribute("aria-label", words);
    made.title = words;
    return made;
  }

  adding() {
    const made = this.act(tr("add a notch"), () => this.addNotch());
    made.disabled = this.trial.notches.length >= NOTCHES_MAX;
    return made;
  }

  /** At the frequency where L is nearest to −1, or in the middle. */
  addNotch() {
    const [low, high] = this.band(),
      near = this.margins.nearHz;
    const hz = near > low && near < high ? near : Math.sqrt(low * high);
    this.trial.notches.push({ hz: Number(hz.toPrecision(4)), depthDb: 10, damping: 0.3 });
  }

  addLowPass() {
    this.trial.lowPassHz = Number((this.band()[1] / 2).toPrecision(3));
  }

  /** @param {NonNullable<LoopFacts["proposed"]>} proposed */
  propose({ gains, notches, low_passes_hz: corners }) {
    const four = (/** @type {number} */ v) => Number(v.toPrecision(4));
    for (const [name, v] of Object.entries(gains ?? {})) this.trial.values[name] = four(v);
    this.trial.notches = notches
      .slice(0, NOTCHES_MAX)
      .map(({ hz, depth_db, damping }) => ({ hz: four(hz), depthDb: four(depth_db), damping: four(damping) }));
    this.trial.lowPassHz = four(corners[0] ?? 0);
    this.complain(
      gains
        ? tr("Gains and filters are those of the newest livebode tune of this run.")
        : tr("The filters are those of filters.h; set the gains that livebode tune printed."),
    );
  }

  /** @param {(facts: LoopFacts, trial: Trial) => string} made */
  async copy(made) {
    if (!this.facts) return;
    const text = made(this.facts, this.trial),
      field = $("what-if-text", HTMLTextAreaElement);
    try {
      await navigator.clipboard.writeText(text);
      field.hidden = true;
      this.complain(tr("The values were copied."));
    } catch {
      // Without TLS browsers give no clipboard to pages of other computers.
      field.hidden = false;
      field.value = text;
      field.select();
    }
  }
}

/** @type {Addition} */
export const addition = (page, bode, actions) => new WhatIfCard(page, bode, actions);
