// @ts-check
// The trend of an axis over a year, beneath its values: what the lake of the fleet has of it.
import { AxisTrendChart } from "./fleet_trend_chart.js";
import { tr, trn } from "./language.js";
import { reason } from "./link.js";
import { element } from "./make.js";
import { json } from "./runs_feed.js";
import { day, quantity as words } from "./runs_words.js";
import { worded } from "./worded.js";
import { afterNumber, pair, signed } from "./words.js";

/** @import { Range } from "./chart.js" */
/** @import { LinePoint } from "./fleet_trend_chart.js" */
/** @typedef {[at: number, value: number, bound: number, low: number, high: number, others: boolean]} SentValue */
/** @typedef {{line: LinePoint[], per_month: number, bound_95: number, percent: number | null, since_s: number}} SentTrend */
/**
 * @typedef {object} Answer See fleet_trend.py; what follows `state` is there if it is "shown".
 * @property {"no lake" | "no values" | "shown"} state
 * @property {boolean} stopped
 * @property {string[]} damaged files of the lake
 * @property {[model: string, name: string, unit: string][]} quantities
 * @property {number} chosen
 * @property {SentValue[]} points
 * @property {number} days
 * @property {number} days_min
 * @property {SentTrend | null} trend
 */

export class AxisTrend {
  path = "";
  /** @type {Answer | null} */
  answer = null;
  /** @type {AxisTrendChart | null} */
  chart = null;
  /** @type {Range | null} */
  zoom = null;

  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host;
    this.choice = element("select", { onchange: () => this.ask(this.choice.value) });
    this.label = element("label", { hidden: true }, `${tr("Quantity")} `, this.choice);
    this.card = element("div");
    this.words = element("p", { class: "said", role: "status" });
    host.replaceChildren(element("h3", {}, tr("Last year"), this.label), this.card, this.words);
  }

  /** @param {string} path */
  open(path) {
    this.close();
    this.path = path;
    this.words.textContent = tr("The lake is read …");
    this.ask("");
  }

  close() {
    this.path = "";
    this.answer = this.zoom = null;
    this.chart?.remove();
    this.chart = null;
    this.label.hidden = true;
    this.words.textContent = "";
  }

  /** @param {string} quantity model:name; empty for the main one */
  async ask(quantity) {
    const { path } = this;
    try {
      /** @type {Answer} */
      const answer = await json("/api/trend", { axis: path, quantity });
      // A slow answer must not appear beneath another axis, nor beneath another choice.
      if (path !== this.path || (quantity && quantity !== this.choice.value)) return;
      this.answer = answer;
      this.zoom = null;
      this.show();
    } catch (error) {
      if (path === this.path) this.words.textContent = reason(error);
    }
  }

  show() {
    const { answer } = this;
    if (!answer) return;
    this.words.textContent = said(answer);
    if (answer.state !== "shown") return;
    this.offer(answer);
    this.draw(answer);
  }

  /** @param {Answer} answer */
  offer({ quantities, chosen }) {
    const names = quantities.map(([, name]) => name);
    this.label.hidden = quantities.length < 2;
    this.choice.replaceChildren(
      ...quantities.map(([model, name]) => {
        const alone = names.indexOf(name) === names.lastIndexOf(name);
        return element("option", { value: `${model}:${name}` }, words(alone ? name : `${name} (${model})`));
      }),
    );
    this.choice.selectedIndex = chosen;
  }

  /** @param {Answer} answer */
  draw({ quantities, chosen, points, trend }) {
    const [model, name, unit] = quantities[chosen];
    this.chart ??= new AxisTrendChart(this.card, (range) => this.look(range));
    const { chart } = this;
    chart.line = trend?.line ?? [];
    chart.zoomed = this.zoom !== null;
    const found = points.map(([at, value, bound, low, high, written]) => ({
      run: String(at),
      at,
      timeS: 0,
      value,
      bound,
      low,
      high,
      written,
    }));
    const first = points[0][0],
      last = points[points.length - 1][0],
      more = Math.max(0.02 * (last - first), 600);
    chart.take({ model, name, unit, points: found }, [], this.zoom ?? [first - more, last + more], []);
  }

  /** @param {Range | null} range */
  look(range) {
    this.zoom = range;
    if (this.answer) this.draw(this.answer);
  }
}

/** @param {Answer} answer */
function said(answer) {
  if (answer.state === "no lake")
    return tr("There is no lake to read a trend from: set sink.lake in FLEET.toml, and run livebode fleet sink.");
  const found =
    answer.state === "shown"
      ? slope(answer)
      : [tr("The lake has no value of this axis in the last year: fit a model, and run livebode fleet sink.")];
  if (answer.stopped) found.push(tr("The lake answers slowly: earlier values were not read."));
  const [file] = answer.damaged;
  if (file)
    found.push(
      trn(
        "{n} file of the lake is damaged, and its values are missing here: restore {file} from a backup.",
        "{n} files of the lake are damaged, and their values are missing here: restore {file} and the others from a backup.",
        answer.damaged.length,
        { file },
      ),
    );
  return found.join(" ");
}

/** @param {Answer} answer @returns {string[]} */
function slope({ trend, days, days_min: least, quantities, chosen, points }) {
  const found = [];
  if (trend) {
    const unit = afterNumber(worded(quantities[chosen][2])),
      change = pair(trend.per_month, trend.bound_95) + unit,
      percent = trend.percent === null ? "" : ` (${signed(trend.percent * trend.per_month, 2)}\u00a0%)`;
    found.push(
      Math.abs(trend.per_month) > trend.bound_95
        ? tr("Since {date} it changes by {change} a month{percent}.", {
            date: day(trend.since_s),
            change,
            percent,
          })
        : tr("No significant change a month: {change}{percent}.", { change, percent }),
    );
  } else
    found.push(
      tr("A trend needs values on {least} days, over four weeks at least; there are {days}.", { least, days }),
    );
  if (points.some((point) => point[5]))
    found.push(tr("Hollow or grey points: computed with other settings, and not part of the trend."));
  return found;
}
