// @ts-check
// One chart of the Bode plot: its axes, the series of each curve, and what is drawn above and below them.
import { PANELS } from "./bode.js";
import { axis, chart, fitting, letters } from "./chart.js";
import { gestures } from "./gestures.js";
import { tr } from "./language.js";
import { ink, look } from "./looks.js";
import { drawMarks } from "./marks.js";
import { PARTS } from "./parts.js";
import { drawPoints, jumps } from "./points.js";
import { colour } from "./theme.js";
import { frequencyAxis, left, magnitudeAxis, phaseAxis } from "./ticks.js";
import { scaled, shifted } from "./zoom.js";

/** @import { Bode } from "./bode.js" */
/** @import { Chart, Range } from "./chart.js" */
/** @import { Curves } from "./messages.js" */

const COHERENCE = /** @type {Range} */ ([-0.1, 1.25]); // room for the cursor's ring around 0 and 1

/** With its unit, and without it for a chart that is too low. @param {Bode} bode */
function magnitudeLabels({ symbol, units, view, operation }) {
  const unit = operation?.kind === "ratio" ? "" : (units[view.power + 2] ?? "");
  const of = operation ? (operation.kind === "ratio" ? "A/B" : "A − B") : symbol;
  const power = view.power && operation?.kind !== "ratio" ? `(jω)${superscript(view.power)} ` : "";
  const shown = `${power}${of}`;
  const brief = view.absolute ? `|${shown}|` : tr("|{symbol}| in dB", { symbol: shown });
  if (!unit) return [brief];
  const values = { symbol: shown, unit };
  return [view.absolute ? tr("|{symbol}| in {unit}", values) : tr("|{symbol}| in dB re 1 {unit}", values), brief];
}

/** @param {number} power */
const superscript = (power) => (power < 0 ? "⁻" : "") + (Math.abs(power) === 2 ? "²" : power < 0 ? "¹" : "");

/**
 * @param {Bode} bode
 * @param {Curves} name
 * @param {number} index of the chart
 */
function seriesOf(bode, name, index) {
  const show = bode.shown.has(name),
    own = name === "measured" || name === "result",
    scattered = bode.few && name !== "model";
  /** @type {Extract<uPlot.Series.GapsRefiner, Function>} */
  const cut = (u, _i, _from, _to, gaps) => {
    const deg = bode.drawn[name]?.deg;
    return index === 1 && bode.view.wrapped && deg ? [...gaps, ...jumps(u, deg)].sort(([a], [b]) => a - b) : gaps;
  };
  // Between few lines nothing is known: a straight line there would be read as the response.
  const stroke = () => (scattered ? "transparent" : ink(name));
  /** @type {uPlot.Series[]} */
  const series = [
    {
      label: name,
      show,
      stroke,
      width: (own ? 2 : 1.6) * letters(),
      dash: look(name).dash.map((v) => v * letters()),
      points: { show: false },
      gaps: cut,
    },
  ];
  if (index === 2 || name === "model") return series;
  // Of the whole, and where it has parts, of noise and distortion and of the noise.
  for (const edge of ["high", "low", "high", "low", "high", "low"].slice(0, bode.banded(name) ? 6 : 2))
    series.push({
      label: `${name} ${edge}`,
      show,
      stroke: () => "transparent",
      width: 0,
      points: { show: false },
      gaps: cut,
    });
  return series;
}

/**
 * The parts of a bound side by side, so that no colour is mixed: from the upper edge to the lower one.
 *
 * @param {number} first series of the curve; the edges of the whole, of noise and distortion, and of the noise follow it
 * @returns {uPlot.Band[]}
 */
function strips(first) {
  const shade = (/** @type {number} */ part) => () => `${colour(PARTS[part].ink)}${part ? "a0" : "50"}`;
  const between = [
    [1, 3, 2],
    [3, 5, 1],
    [5, 6, 0],
    [6, 4, 1],
    [4, 2, 2],
  ];
  return between.map(([high, low, part]) => ({ series: [first + high, first + low], fill: shade(part) }));
}

/** The chart with the frequencies; on a wall, and above sliders on a telephone, there is no room for the coherence. @param {Bode} bode */
const lowest = ({ hosts }) => PANELS.length - (hosts[2].offsetParent ? 1 : 2);

/**
 * @param {Bode} bode
 * @param {number} index
 * @returns {Chart}
 */
export function panel(bode, index) {
  /** @type {uPlot.Series[]} */
  const series = [{ label: "frequency" }];
  /** @type {uPlot.Band[]} */
  const bands = [];
  for (const name of bode.laid) {
    const first = series.length;
    const own = name === "measured" || name === "result";
    series.push(...seriesOf(bode, name, index));
    if (series.length - first === 7) bands.push(...strips(first));
    else if (series.length - first === 3 && !bode.few)
      bands.push({ series: [first + 1, first + 2], fill: () => `${ink(name)}${own ? "38" : "24"}` });
  }
  const y = [
    { scale: { range: () => bode.limits(0) }, axis: () => magnitudeAxis(fitting(magnitudeLabels(bode)), bode.view) },
    { scale: { range: () => bode.limits(1) }, axis: () => phaseAxis(tr("phase in °"), bode.view) },
    {
      scale: { range: () => bode.zooming.heights[2] ?? COHERENCE },
      axis: () => axis(tr("coherence"), { size: left(bode.view), splits: () => [0, 0.5, 1] }),
    },
  ][index];
  return chart(
    bode.hosts[index],
    {
      scales: {
        x: { distr: bode.view.linear ? 1 : 3, time: false, range: () => bode.sight },
        y: /** @type {uPlot.Scale} */ (y.scale),
      },
      axes: [frequencyAxis(() => bode.lines, bode.view, index === lowest(bode)), y.axis()],
      series,
      bands,
      cursor: {
        sync: { key: "bode" },
        points: { show: false },
        drag: { x: false, y: false, setScale: false },
        y: false,
        bind: { dblclick: () => () => null },
      },
      hooks: {
        ready: [(u) => gestures(u, actions(bode, u, index))],
        setCursor: [(u) => bode.follow(u)],
        drawSeries: [(u, i) => above(bode, u, index, i)],
        draw: [(u) => drawMarks(bode, u, index)],
      },
    },
    bode.data(index),
  );
}

/**
 * The points of a curve, directly above its line, so that the model is above them.
 *
 * @param {Bode} bode
 * @param {Chart} u
 * @param {number} index
 * @param {number} i
 */
function above(bode, u, index, i) {
  const name = bode.laid.find((known) => known === u.series[i].label),
    curve = name && bode.curves[name];
  if (!curve || !bode.few || name === "model") return;
  drawPoints(u, name, curve, /** @type {import("./curves.js").Values} */ (u.data[i]), PANELS[index].value, bode.parted);
}

/**
 * @param {Bode} bode
 * @param {Chart} u
 * @param {number} index
 * @returns {import("./gestures.js").Gestures}
 */
function actions(bode, u, index) {
  const { zooming } = bode;
  const log = () => !bode.view.linear;
  /** @param {string} key @returns {Range} */
  const shown = (key) => [u.scales[key].min ?? 0, u.scales[key].max ?? 1];
  /** @param {number} share */
  const hz = (share) => u.posToVal(share * u.over.clientWidth, "x"),
    value = (/** @type {number} */ share) => u.posToVal(share * u.over.clientHeight, "y");
  return {
    scale(x, y, factorX, factorY) {
      if (factorX !== 1) zooming.across(scaled(bode.sight, hz(x), factorX, log()));
      if (factorY !== 1) zooming.along(index, scaled(shown("y"), value(y), factorY, false));
      bode.zoomed();
    },
    shift(x, y) {
      const [low, high] = shifted(bode.sight, x, log());
      if (low >= bode.whole[0] && high <= bode.whole[1]) zooming.across([low, high]);
      if (y) zooming.along(index, shifted(shown("y"), y, false));
      bode.zoomed();
    },
    box(x, y) {
      // Both from the same picture: the first zoom would move the second.
      const across = /** @type {Range | null} */ (x ? x.map(hz) : null),
        along = /** @type {Range | null} */ (y && [value(y[1]), value(y[0])]);
      if (across) zooming.across(across);
      if (along) zooming.along(index, along);
      bode.zoomed();
    },
    place: (second) => bode.place(second),
    reset() {
      bode.cursors.undo();
      bode.reset();
      bode.tell();
    },
  };
}
