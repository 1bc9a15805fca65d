// @ts-check
// What the drawn fit knows: margins of the loop, modes with their damping, the delay.
import { tr } from "./language.js";
import { bounded } from "./trends.js";

/** @import { Mark } from "./marks.js" */
/** @import { Series } from "./series.js" */
/** `value` is the frequency with its bound. @typedef {{peak: boolean, hz: number, damping: number, value: string, words: string}} Mode */

/**
 * Margins as marks on the open loop. Gain margins are read where the phase crosses −180°, phase and delay margin where
 * the magnitude crosses 0 dB.
 *
 * @param {Map<string, Series>} items rows of the model "margins", by name
 * @returns {Mark[]}
 */
export function marginMarks(items) {
  /** @param {string} name */
  const read = (name) => {
    const series = items.get(name),
      row = series?.shown,
      hz = items.get(`${name}_frequency`)?.shown?.v ?? NaN;
    if (!row || !Number.isFinite(row.v) || !Number.isFinite(hz)) return null;
    return { name, hz, value: row.v, words: bounded(row.v, row.s, series.unit) };
  };
  /** @type {Mark[]} */
  const found = [];
  for (const [name, words, sign] of /** @type {[string, string, number][]} */ ([
    ["gain_margin", tr("gain margin"), -1],
    ["gain_reduction", tr("gain may fall by"), 1],
  ])) {
    const margin = read(name);
    if (margin)
      found.push({ ...margin, chart: 0, level: sign * Math.abs(margin.value), words: `${words} ${margin.words}` });
  }
  const [phase, delay] = [read("phase_margin"), read("delay_margin")];
  if (phase) {
    const both = delay && Math.abs(delay.hz / phase.hz - 1) < 0.01;
    const words = [tr("phase margin {value}", { value: phase.words })];
    if (both) words.push(tr("delay margin {value}", { value: delay.words }));
    found.push({ ...phase, chart: 1, level: phase.value, words: words.join(", ") });
    if (both) return found;
  }
  if (delay) {
    const level = (delay.value / 1000) * delay.hz * 360;
    found.push({ ...delay, chart: 1, level, words: tr("delay margin {value}", { value: delay.words }) });
  }
  return found;
}

const MODE = /^(anti)?resonance(_\d+)?$/;

/**
 * Resonances and antiresonances of the fitted model.
 *
 * @param {Iterable<Series>} all
 * @returns {Mode[]}
 */
export function modes(all) {
  const items = [...all];
  return items.flatMap((series) => {
    const beside = items.find((s) => s.model === series.model && s.name === `${series.name}_damping`);
    if (!MODE.test(series.name) || !series.shown || !beside?.shown) return [];
    const { v: hz, s } = series.shown,
      { v: damping, s: spread } = beside.shown;
    if (!(hz > 0)) return [];
    const value = bounded(hz, s, "Hz");
    const words = tr("fit: {hz}, damping {damping}", {
      hz: value,
      damping: bounded(damping, spread, ""),
    });
    return [{ peak: !series.name.startsWith("anti"), hz, damping, value, words }];
  });
}

/**
 * Fitted delay in ms; NaN if none is fitted.
 *
 * @param {Iterable<Series>} all
 */
export function delayMs(all) {
  for (const { name, shown } of all) if (name === "delay" && shown?.v) return 1000 * shown.v;
  return NaN;
}
