// @ts-check
// What a person has chosen is in the address of the page: it survives a reload, and a link shares it.

const known = new URLSearchParams(location.hash.slice(1));
// Browsers limit how often an address may change: Safari 100 times in 30 s. Some changes at once, then one per pause.
const PAUSE_MS = 400,
  AT_ONCE = 20;
let free = AT_ONCE,
  written = 0,
  waiting = 0,
  entering = false;

/** The next choice is an entry of the history: Back returns to the one before it. All others replace the address. */
export function enter() {
  entering = true;
}

function write() {
  const now = performance.now();
  free = Math.min(AT_ONCE, free + (now - written) / PAUSE_MS) - 1;
  written = now;
  if (entering && link() !== location.href) history.pushState(null, "", link());
  else history.replaceState(null, "", link());
  entering = false;
}

/** The address of what is shown now. */
export function link() {
  const text = known.toString();
  return `${location.origin}${location.pathname}${location.search}${text ? `#${text}` : ""}`;
}

/**
 * A choice in the address; `fallback` without one, or with one that is not among `choices`.
 *
 * @template {string} V
 * @param {string} name
 * @param {V} fallback
 * @param {readonly V[]} [choices]
 * @returns {V}
 */
export function chosen(name, fallback, choices) {
  const value = /** @type {V | null} */ (known.get(name));
  return value === null || (choices && !choices.includes(value)) ? fallback : value;
}

/**
 * Put a choice into the address; a choice that equals `fallback` needs no place there.
 *
 * @param {string} name
 * @param {string} value
 * @param {string} fallback
 */
export function remember(name, value, fallback) {
  if (value === fallback) known.delete(name);
  else known.set(name, value);
  clearTimeout(waiting);
  if (free + (performance.now() - written) / PAUSE_MS >= 1) write();
  else waiting = setTimeout(write, PAUSE_MS);
}

// Another address was typed, or one of before was gone back to: the page starts again with its choices.
addEventListener("hashchange", () => location.reload());
