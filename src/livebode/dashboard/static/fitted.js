// @ts-check
// What the fits know at a time: margins of the loop, modes with their damping, the delay.
import { tr } from "./language.js";
import { bounded } from "./trends.js";

/** @import { Mark } from "./marks.js" */
/** @import { Series } from "./series.js" */
/** @typedef {{peak: boolean, hz: number, damping: number, words: string}} Mode */

/**
 * Margins as marks on the open loop. Gain margins are read where the phase crosses −180°, phase and delay margin where
 * the magnitude crosses 0 dB.
 *
 * @param {Map<string, Series>} items rows of the model "margins", by name
 * @param {number} atS NaN: the newest
 * @returns {Mark[]}
 */
export function marginMarks(items, atS) {
  /** @param {string} name */
  const read = (name) => {
    const [series, place] = [items.get(name), items.get(`${name}_frequency`)];
    if (!series?.t.length || !place?.t.length) return null;
    const at = series.at(atS),
      [value, hz] = [series.v[at], place.v[place.at(atS)]];
    if (!Number.isFinite(value) || !Number.isFinite(hz)) return null;
    return { name, hz, value, words: bounded(value, series.s[at], series.unit) };
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
 * @param {number} atS
 * @returns {Mode[]}
 */
export function modes(all, atS) {
  const items = [...all];
  return items.flatMap((series) => {
    const beside = items.find((s) => s.model === series.model && s.name === `${series.name}_damping`);
    if (!MODE.test(series.name) || !series.t.length || !beside?.t.length) return [];
    const [at, also] = [series.known(atS), beside.known(atS)];
    const [hz, damping] = [series.v[at], beside.v[also]];
    if (!(hz > 0)) return [];
    const words = tr("fit: {hz}, damping {damping}", {
      hz: bounded(hz, series.s[at], "Hz"),
      damping: bounded(damping, beside.s[also], ""),
    });
    return [{ peak: !series.name.startsWith("anti"), hz, damping, words }];
  });
}

/**
 * Fitted delay in ms; NaN if none is fitted.
 *
 * @param {Iterable<Series>} all
 * @param {number} atS
 */
export function delayMs(all, atS) {
  for (const series of all) {
    if (series.name !== "delay" || !series.t.length) continue;
    const value = series.v[series.known(atS)];
    if (value) return 1000 * value;
  }
  return NaN;
}
