// @ts-check
// The matrix of a run: a small magnitude plot of each entry, outputs down and inputs across, of which a person picks one;
// singular values, condition of the inputs and multiple coherence over frequency.
import { chosen, remember } from "./address.js";
import { moment } from "./clock.js";
import { figure } from "./figure.js";
import { highDb, lowDb } from "./frames.js";
import { tr } from "./language.js";
import { ask, reason } from "./link.js";
import { byId as $, element } from "./make.js";
import { hertz, plain, signed } from "./words.js";

/** @import { MatrixAnswer } from "./answer.js" */
/** @import { Addition, Page, Sent } from "./messages.js" */
/** @import { Timeline } from "./timeline.js" */

const AGAIN_MS = 2000,
  FEW_LINES = 40, // as in the Bode plot: between few lines nothing is known
  INKS = ["t0", "t1", "t2", "t3", "t4", "t5", "t6", "t7"],
  DASHES = ["", "7 3", "2 3", "9 3 2 3", "4 4", "12 4", "6 2 2 2", "3 3"],
  SPAN_DB = 80;

/** @type {Record<string, string>} */
const REASONS = {
  incomplete: tr("experiments are missing"),
  "not excited": tr("not excited"),
  "not separated": tr("not separated from the other inputs"),
};

/** Add the elements to the page. */
function attach() {
  const open = element(
    "button",
    {
      id: "matrix-open",
      type: "button",
      "aria-pressed": "false",
      title: tr("All entries, singular values and coherence"),
      hidden: true,
    },
    tr("Matrix"),
  );
  $("quantities").after(open);
  const heading = element(
    "header",
    {},
    element("h2", { id: "matrix-title" }, tr("Matrix of responses")),
    element("p", { class: "note", id: "matrix-about" }),
  );
  document
    .querySelector("main")
    ?.before(
      element(
        "main",
        { id: "matrix", class: "matrix", "aria-labelledby": "matrix-title", hidden: true },
        element("div", { class: "card" }, heading, element("div", { class: "matrix-cells", id: "matrix-cells" })),
        element("div", { class: "matrix-figures", id: "matrix-figures" }),
      ),
    );
}

class Matrix {
  /** @param {Page} page @param {Timeline} timeline @param {(axis: number) => void} choose */
  constructor(page, timeline, choose) {
    this.page = page;
    this.timeline = timeline;
    this.choose = choose;
    attach();
    this.section = $("matrix");
    this.button = $("matrix-open");
    this.shown = chosen("matrix", String()) !== "0";
    /** @type {MatrixAnswer | null} */
    this.answer = null;
    this.asking = false;
    this.focused = -1;
    this.button.addEventListener("click", () => this.show(!this.shown));
    this.section.addEventListener("keydown", (event) => this.move(event));
    setInterval(() => this.again(), AGAIN_MS);
  }

  get run() {
    const { facts } = this.page;
    return facts?.begun ? facts.matrix : null;
  }

  begin() {
    const matrix = this.run;
    this.button.hidden = !matrix;
    if (this.answer && matrix?.first_axis !== this.answer.first_axis) this.answer = null;
    this.lay();
  }

  /** @param {boolean} shown */
  show(shown) {
    this.shown = shown;
    remember("matrix", shown ? "" : "0", "");
    this.lay();
    if (shown) this.cell(this.page.axis)?.focus();
  }

  lay() {
    const on = this.shown && this.run !== null;
    this.section.hidden = !on;
    document.body.classList.toggle("matrices", on);
    this.button.setAttribute("aria-pressed", String(on));
    if (!on) return;
    if (this.answer) this.render();
    this.fetch();
  }

  again() {
    const { live, growing } = this.timeline.span;
    if ((live || growing) && this.timeline.atS === null) this.fetch();
  }

  async fetch() {
    if (this.section.hidden || this.asking) return;
    this.asking = true;
    const { atS } = this.timeline,
      { axis } = this.page;
    try {
      const answer = await ask("/api/matrix", atS === null ? { axis } : { axis, at: atS });
      this.answer = JSON.parse(new TextDecoder().decode(answer));
      this.render();
    } catch (error) {
      $("matrix-about").textContent = reason(error);
    }
    this.asking = false;
    if (atS !== this.timeline.atS) this.fetch();
  }

  /** @param {number} axis */
  cell(axis) {
    return /** @type {HTMLElement | null} */ (this.section.querySelector(`[data-axis="${axis}"]`));
  }

  /** The arrow keys move from entry to entry. @param {KeyboardEvent} event */
  move(event) {
    const { run } = this,
      cell = event.target instanceof Element ? event.target.closest("[data-axis]") : null;
    if (!run || !(cell instanceof HTMLElement) || event.ctrlKey || event.metaKey || event.altKey) return;
    const columns = run.inputs.length,
      at = Number(cell.dataset.axis) - run.first_axis,
      [row, column] = [Math.floor(at / columns), at % columns];
    /** @type {Record<string, [number, number]>} */
    const moves = {
      ArrowRight: [row, column + 1],
      ArrowLeft: [row, column - 1],
      ArrowDown: [row + 1, column],
      ArrowUp: [row - 1, column],
      Home: [row, 0],
      End: [row, columns - 1],
    };
    const to = moves[event.key];
    if (!to) return;
    event.preventDefault();
    event.stopPropagation();
    const [r, c] = [Math.min(run.outputs.length - 1, Math.max(0, to[0])), Math.min(columns - 1, Math.max(0, to[1]))];
    this.stop(run.first_axis + r * columns + c);
    this.cell(run.first_axis + r * columns + c)?.focus();
  }

  /** The one tab stop of all entries. @param {number} axis */
  stop(axis) {
    for (const cell of this.section.querySelectorAll("[data-axis]"))
      cell.setAttribute("tabindex", cell instanceof HTMLElement && Number(cell.dataset.axis) === axis ? "0" : "-1");
  }

  /** A new answer is shown when it arrives. */
  draw() {}

  moment() {
    this.fetch();
  }

  render() {
    const { answer, page } = this;
    if (!answer) return;
    const focused = this.section.contains(document.activeElement)
      ? document.activeElement?.getAttribute("data-axis")
      : null;
    const { outputs, inputs, first_axis: first } = answer;
    const ranges = rangesOf(answer);
    const head = element(
      "tr",
      {},
      element("td", {}),
      ...inputs.map((name) => element("th", { scope: "col" }, tr("from {input}", { input: name }))),
    );
    const rows = outputs.map((output, o) =>
      element(
        "tr",
        {},
        element("th", { scope: "row" }, output),
        ...inputs.map((_, i) => element("td", {}, this.entry(answer, o, i, ranges))),
      ),
    );
    $("matrix-cells").replaceChildren(
      element("table", { class: "entries" }, element("thead", {}, head), element("tbody", {}, ...rows)),
    );
    $("matrix-figures").replaceChildren(...figuresOf(answer));
    $("matrix-about").textContent = tr("{rows} × {columns} at {time}; bounds: 95 %; a click shows the entry.", {
      rows: outputs.length,
      columns: inputs.length,
      time: moment(answer.time_s),
    });
    const here = page.axis >= first && page.axis < first + outputs.length * inputs.length ? page.axis : first;
    this.stop(focused === null || focused === undefined ? here : Number(focused));
    if (focused) this.cell(Number(focused))?.focus();
  }

  /**
   * @param {MatrixAnswer} answer
   * @param {number} o
   * @param {number} i
   * @param {Map<string, [number, number]>} ranges
   */
  entry({ entries, reasons, frequency_hz: hz, outputs, inputs, first_axis: first }, o, i, ranges) {
    const { db, reach, unit } = entries[o][i],
      axis = first + o * inputs.length + i,
      valid = db.filter((v) => v !== null).length,
      why = Object.keys(reasons[i]).map((word) => REASONS[word] ?? word);
    const state = tr("valid at {valid} of {lines} lines", { valid, lines: hz.length }),
      words = valid === hz.length ? state : `${state}: ${why.join(", ")}`;
    const top = db.reduce(
      (/** @type {number} */ best, v, k) => (v !== null && v > (db[best] ?? -Infinity) ? k : best),
      0,
    );
    const peak = valid
      ? tr("largest {level} dB at {hz} Hz", { level: signed(db[top] ?? NaN, 1), hz: hertz(hz[top]) })
      : "";
    const range = ranges.get(unit) ?? [-1, 1];
    const picture = figure({
      width: 200,
      height: 100,
      hz,
      curves: [{ ink: "measured", values: db, low: edge(db, reach, lowDb), high: edge(db, reach, highDb) }],
      range,
      points: hz.length <= FEW_LINES,
      axes: false,
    });
    const current = axis === this.page.axis,
      name = tr("{output} from {input}", { output: outputs[o], input: inputs[i] });
    return element(
      "button",
      {
        type: "button",
        class: `entry${valid ? "" : " invalid"}`,
        "data-axis": axis,
        "aria-current": current ? "true" : null,
        onclick: () => {
          if (axis !== this.page.axis) this.choose(axis);
          this.show(false);
          $("matrix-open").focus();
        },
      },
      element("span", { class: "unseen" }, `${name}; ${state}; `),
      element(
        "span",
        { class: "scale" },
        `${signed(range[1], 0)} … ${signed(range[0], 0)} dB${unit ? ` re 1 ${unit}` : ""}`,
      ),
      picture,
      element("span", { class: valid === hz.length ? "state" : "state bad" }, valid === hz.length ? peak : words),
    );
  }
}

/** @param {Sent[]} db @param {Sent[]} reach @param {(db: number, reach: number) => number} of @returns {Sent[]} */
const edge = (db, reach, of) =>
  db.map((v, k) => {
    const by = reach[k];
    const found = v === null || by === null ? v : of(v, by);
    return found !== null && Number.isNaN(found) ? v : found;
  });

/** One scale for all entries of a unit, of whole tens of dB. @param {MatrixAnswer} answer */
function rangesOf({ entries }) {
  /** @type {Map<string, [number, number]>} */
  const found = new Map();
  for (const { db, unit } of entries.flat()) {
    const known = /** @type {number[]} */ (db.filter((v) => v !== null));
    if (!known.length) continue;
    const [low, high] = found.get(unit) ?? [Infinity, -Infinity];
    found.set(unit, [Math.min(low, ...known), Math.max(high, ...known)]);
  }
  for (const [unit, [low, high]] of found) {
    const top = 10 * Math.ceil((high + 1) / 10);
    found.set(unit, [Math.max(top - SPAN_DB, 10 * Math.floor((low - 1) / 10)), top]);
  }
  return found;
}

/** @param {MatrixAnswer} answer */
function figuresOf({ frequency_hz: hz, singular_db: singular, condition, coherence, outputs, entries }) {
  const units = new Set(entries.flat().map(({ unit }) => unit));
  const points = hz.length <= FEW_LINES;
  /** @param {string} title @param {string[]} names @param {Sent[][]} values @param {[number, number]} range @param {string} note @param {(v: number) => string} [words] */
  const one = (title, names, values, range, note, words) =>
    element(
      "figure",
      { class: "card" },
      element(
        "figcaption",
        {},
        element("h2", {}, title),
        ...(names.length > 1 ? names.map((name, k) => legendOf(name, k)) : []),
      ),
      figure({
        width: 440,
        height: 145,
        hz,
        curves: values.map((v, k) => ({ ink: INKS[k], dash: DASHES[k], values: v })),
        range,
        points,
        axes: true,
        words,
      }),
      element("p", { class: "note" }, [tr("frequency in Hz"), note].filter(Boolean).join(" · ")),
    );
  const known = /** @type {number[]} */ (singular.flat().filter((v) => v !== null));
  const top = known.length ? 10 * Math.ceil((Math.max(...known) + 1) / 10) : 0,
    low = known.length ? Math.max(top - SPAN_DB, 10 * Math.floor((Math.min(...known) - 1) / 10)) : -1;
  const logs = condition.map((v) => (v === null ? null : Math.log10(v))),
    most = Math.max(1, Math.ceil(Math.max(0, ...logs.filter((v) => v !== null))));
  const worst = condition.reduce((/** @type {number} */ at, v, k) => ((v ?? 0) > (condition[at] ?? 0) ? k : at), 0);
  return [
    one(
      tr("Singular values in dB"),
      singular.map((_, k) => `σ${k + 1}`),
      singular,
      [low, top],
      units.size > 1 ? tr("The units of the entries differ: the values depend on them.") : "",
    ),
    one(
      tr("Condition number of the inputs"),
      [],
      [logs],
      [0, most],
      condition[worst] === null
        ? ""
        : tr("largest {value} at {hz} Hz; 1: the inputs are orthogonal", {
            value: plain(condition[worst], 3),
            hz: hertz(hz[worst]),
          }),
      (v) => (Number.isInteger(v) ? plain(10 ** v, 3) : ""),
    ),
    one(tr("Multiple coherence"), outputs, coherence, [0, 1], ""),
  ];
}

/** @param {string} name @param {number} k */
function legendOf(name, k) {
  const ns = "http://www.w3.org/2000/svg",
    made = document.createElementNS(ns, "svg"),
    path = document.createElementNS(ns, "path");
  made.setAttribute("viewBox", "0 0 26 8");
  made.setAttribute("width", "26");
  made.setAttribute("height", "8");
  made.setAttribute("aria-hidden", "true");
  path.setAttribute("d", "M0 4h26");
  path.setAttribute("stroke-dasharray", DASHES[k]);
  path.style.stroke = `var(--${INKS[k]})`;
  path.style.strokeWidth = "2.4";
  made.append(path);
  return element("span", { class: "key" }, made, name);
}

/** @type {Addition} */
export const addition = (page, _bode, { timeline, choose }) => new Matrix(page, timeline, choose);
