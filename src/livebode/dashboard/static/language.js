// @ts-check
// The language of the page: sentences by their English text, and numbers. The server selects the catalogue from the
// choice in the help (a cookie), `[serve] language` or the language of the browser. For its messages see worded.js.

/**
 * @typedef {object} Catalogue
 * @property {string} code BCP 47
 * @property {string} decimal
 * @property {string} date for strftime
 * @property {string} plural digit n is the plural form for n < 200; from there on they repeat every hundred
 * @property {Record<string, string | string[]>} messages
 * @property {Record<string, string>} languages their names by code
 */

/** @type {Catalogue} */
const ENGLISH = {
  code: "en",
  decimal: ".",
  date: "%Y-%m-%d %H:%M:%S %Z",
  plural: "",
  messages: {},
  languages: { en: "English" },
};
const YEAR_S = 365 * 86400;
const SHOWN = ["title", "aria-label", "placeholder"];

/** @returns {Promise<Catalogue>} */
async function load() {
  const answer = await fetch("/catalogue").catch(() => null); // each page preloads it
  return answer?.ok ? answer.json() : ENGLISH;
}

export const language = await load();

/**
 * Store the choice in this browser, and show the page in it.
 *
 * @param {string} code
 */
export function choose(code) {
  // biome-ignore lint/suspicious/noDocumentCookie: the cookie store needs HTTPS.
  document.cookie = `language=${code}; path=/; max-age=${YEAR_S}; samesite=strict`;
  location.reload();
}

/** @typedef {Record<string, string | number>} Values */

/**
 * @param {string} text
 * @param {Values} values
 */
export const filled = (text, values) => text.replace(/\{(\w+)(?::[^{}]*)?\}/g, (_all, name) => String(values[name]));

/**
 * The sentence in the language of the page; `text` is a literal, which `make catalogues` finds here.
 *
 * @param {string} text English, with values as {name}
 * @param {Values} [values] numbers already formatted
 */
export function tr(text, values = {}) {
  const own = language.messages[text];
  return filled(typeof own === "string" ? own : text, values);
}

/**
 * The same with plural forms; the number is the value {n}.
 *
 * @param {string} one
 * @param {string} many
 * @param {number} n
 * @param {Values} [values]
 */
export function trn(one, many, n, values = {}) {
  const own = language.messages[one];
  const form = Number(language.plural[n < 200 ? n : 100 + (n % 100)]);
  return filled(Array.isArray(own) ? own[form] : n === 1 ? one : many, { n, ...values });
}

/**
 * A formatted number with the decimal sign of the language.
 *
 * @param {string} text
 */
export const numeral = (text) => text.replace(".", language.decimal);

// Translate the texts and titles of the page itself.
function translate() {
  document.documentElement.lang = language.code;
  const walker = document.createTreeWalker(document.documentElement, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const text = (node.textContent ?? "").trim().replace(/\s+/g, " ");
    const own = language.messages[text];
    if (typeof own === "string") node.textContent = (node.textContent ?? "").replace(/\S[\s\S]*\S|\S/, () => own);
  }
  for (const name of SHOWN)
    for (const element of document.querySelectorAll(`[${name}]`)) {
      const own = language.messages[element.getAttribute(name) ?? ""];
      if (typeof own === "string") element.setAttribute(name, own);
    }
}

translate();
