// @ts-check
// Light, dark, or the setting of the system; stored in this browser.
const WORDS = ["auto", "light", "dark"];
const dark = matchMedia("(prefers-color-scheme: dark)");
/** @type {Set<() => void>} */
const listeners = new Set();

let word = "auto";
try {
  if (WORDS.includes(localStorage.theme)) word = localStorage.theme;
} catch {
  /* a browser that remembers nothing */
}

export function applyTheme() {
  document.documentElement.dataset.theme = word === "auto" ? (dark.matches ? "dark" : "light") : word;
  colours.clear();
  for (const listener of listeners) listener();
}

export function nextTheme() {
  word = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  try {
    localStorage.theme = word;
  } catch {
    /* it is not remembered */
  }
  applyTheme();
}

/** @param {() => void} listener */
export function onTheme(listener) {
  listeners.add(listener);
}

/** @type {Map<string, string>} */
const colours = new Map();
/**
 * A colour of look.css, for canvases.
 *
 * @param {string} name
 */
export function colour(name) {
  const known = colours.get(name);
  if (known !== undefined) return known;
  const found = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  colours.set(name, found);
  return found;
}

/**
 * Draw in the colours of a theme what is not shown on the page.
 *
 * @template T
 * @param {"light" | "dark"} name
 * @param {(ink: typeof colour) => T} act
 */
export function inTheme(name, act) {
  const { dataset } = document.documentElement,
    before = dataset.theme;
  dataset.theme = name;
  colours.clear();
  try {
    return act(colour);
  } finally {
    dataset.theme = before;
    colours.clear();
  }
}

dark.addEventListener("change", applyTheme);

/**
 * What draws on a canvas.
 *
 * @param {HTMLCanvasElement} canvas
 */
export function drawing(canvas) {
  const ctx = canvas.getContext("2d");
  if (!ctx) throw new Error("this browser cannot draw on a canvas");
  return ctx;
}
