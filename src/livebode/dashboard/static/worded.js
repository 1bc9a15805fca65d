// @ts-check
// Messages of the server and of the record in the language of the page, from the template and the facts that
// `for_page` of `livebode.language.message` sends. A name or a status is translated by its English text.
import { recordedTime } from "./clock.js";
import { filled, language, numeral } from "./language.js";

/** @import { Fact, Words } from "./messages.js" */

/** @param {string} template */
const own = (template) => {
  const found = language.messages[template];
  return typeof found === "string" ? found : template;
};

/**
 * @param {Words} words
 * @returns {string}
 */
export function worded(words) {
  if (typeof words === "string") return own(words);
  const [template, facts] = words;
  return filled(own(template), Object.fromEntries(Object.entries(facts).map(([name, fact]) => [name, value(fact)])));
}

/**
 * @param {Fact} fact
 * @returns {string}
 */
function value(fact) {
  if (typeof fact === "string") return fact;
  if (Array.isArray(fact)) return worded(fact);
  if ("number" in fact) return numeral(fact.number);
  if ("list" in fact) return fact.list.map(value).join(own("; "));
  return fact.unix_s === null ? numeral(fact.text) : recordedTime(fact.unix_s);
}
