// @ts-check
// English sentences of the server and of the record, in the language of the page, as `livebode.language.recognition`
// finds them: a template in the catalogue finds the values in a sentence; what no template fits stays English.
import { filled, language } from "./language.js";

const SIZE = String.raw`[-+−]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?`;
const NUMBER = new RegExp(`^${SIZE}(?: ± ${SIZE}| … ${SIZE})?(?: ?(?:s|ms|Hz|dB|°|%))?$`);
const DATE = /^(\d{4})-(\d\d)-(\d\d) (\d\d:\d\d:\d\d) ?(\S*)$/;
const CUTS = [/(?<=\.) /, /(?<=;) /];

/** @param {string} literal */
const escaped = (literal) => literal.replace(/[.*+?^${}()|[\]\\]/g, "\\$&");

const TEMPLATES = language.recorded
  .map(([english, translation]) => {
    const literals = english.split(/\{\w+\}/);
    const names = [...english.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);
    return { pattern: new RegExp(`^${literals.map(escaped).join("([^]+?)")}$`), names, translation, literals };
  })
  .sort((a, b) => b.literals.join("").length - a.literals.join("").length);

const RESULTS_MAX = 1000;
/** @type {Map<string, string>} */
const results = new Map();

/** @param {string} text */
export function recognised(text) {
  if (language.code === "en") return text;
  if (results.size > RESULTS_MAX) results.clear();
  const found = results.get(text) ?? looked(text);
  results.set(text, found);
  return found;
}

/**
 * @param {string} text
 * @returns {string}
 */
function looked(text) {
  const found = translated(text);
  if (found !== undefined) return found;
  const cut = CUTS.find((each) => each.test(text));
  return cut ? text.split(cut).map(looked).join(" ") : text;
}

/**
 * All of it: as one sentence, sentence by sentence, clause by clause, or as a sentence that quotes others.
 *
 * @param {string} text
 * @returns {string | undefined}
 */
function translated(text) {
  const found = known(text, false);
  if (found !== undefined) return found;
  for (const cut of CUTS) {
    if (!cut.test(text)) continue;
    const pieces = text.split(cut).map(translated);
    if (pieces.every((piece) => piece !== undefined)) return pieces.join(" ");
  }
  return known(text, true);
}

/**
 * The sentence, with or without the mark at its end.
 *
 * @param {string} text
 * @param {boolean} quoting whether a value may contain sentences
 * @returns {string | undefined}
 */
function known(text, quoting) {
  const own = language.messages[text];
  if (typeof own === "string") return own;
  const mark = /[.;]$/.exec(text)?.[0] ?? "";
  const found = whole(mark ? text.slice(0, -1) : text, quoting);
  return found === undefined ? undefined : found + (language.messages[mark] ?? mark);
}

/**
 * @param {string} text
 * @param {boolean} quoting
 * @returns {string | undefined}
 */
function whole(text, quoting) {
  const own = language.messages[text];
  if (typeof own === "string") return own;
  for (const { pattern, names, translation } of TEMPLATES) {
    const match = pattern.exec(text)?.slice(1);
    if (match && (quoting || !match.some((part) => /[.;] /.test(part))))
      return filled(translation, Object.fromEntries(names.map((name, i) => [name, value(match[i])])));
  }
  return undefined;
}

/**
 * @param {string} text
 * @returns {string}
 */
function value(text) {
  const date = DATE.exec(text);
  if (date) return dated(date.slice(1));
  if (!NUMBER.test(text)) return looked(text);
  return language.decimal === "." ? text : text.replace(/[.,]/g, (sign) => (sign === "." ? language.decimal : "."));
}

/** @param {string[]} parts */
const dated = ([year, month, day, time, zone]) =>
  language.date
    .replace("%Y", year)
    .replace("%m", month)
    .replace("%d", day)
    .replace("%H:%M:%S", time)
    .replace("%Z", zone)
    .trimEnd();
