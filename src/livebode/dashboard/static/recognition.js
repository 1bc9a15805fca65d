// @ts-check
// English sentences of the server and of the record, in the language of the page, as `livebode.language.recognition`
// finds them: a template in the catalogue finds the values in a sentence; what no template fits stays English.
import { filled, language } from "./language.js";

const SIZE = String.raw`[-+−]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?`;
const NUMBER = new RegExp(`^${SIZE}(?: ± ${SIZE}| … ${SIZE})?(?: ?(?:s|ms|Hz|dB|°|%))?$`);
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

/**
 * @param {string} text
 * @returns {string}
 */
export const recognised = (text) => (language.code === "en" ? text : (known(text) ?? byPieces(text, CUTS)));

/**
 * Sentence by sentence; those that are unknown clause by clause.
 *
 * @param {string} text
 * @param {RegExp[]} cuts
 * @returns {string}
 */
function byPieces(text, [cut, ...more]) {
  if (!cut) return text;
  return text
    .split(cut)
    .map((piece) => known(piece) ?? byPieces(piece, more))
    .join(" ");
}

/**
 * The sentence, with or without the mark at its end.
 *
 * @param {string} text
 * @returns {string | undefined}
 */
function known(text) {
  const found = whole(text),
    mark = text.slice(-1);
  if (found !== undefined || !/[.;]/.test(mark)) return found;
  const without = whole(text.slice(0, -1));
  return without === undefined ? undefined : without + (language.messages[mark] ?? mark);
}

/**
 * @param {string} text
 * @returns {string | undefined}
 */
function whole(text) {
  const own = language.messages[text];
  if (typeof own === "string") return own;
  for (const { pattern, names, translation } of TEMPLATES) {
    const match = pattern.exec(text);
    if (match) return filled(translation, Object.fromEntries(names.map((name, i) => [name, value(match[i + 1])])));
  }
  return undefined;
}

/**
 * @param {string} text
 * @returns {string}
 */
function value(text) {
  if (!NUMBER.test(text)) return recognised(text);
  return language.decimal === "." ? text : text.replace(/[.,]/g, (sign) => (sign === "." ? language.decimal : "."));
}
