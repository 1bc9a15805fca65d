// Light, dark, or the setting of the system; stored in this browser.
const WORDS = ["auto", "light", "dark"];
const dark = matchMedia("(prefers-color-scheme: dark)");
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

export function onTheme(listener) {
  listeners.add(listener);
}

const colours = new Map();
// A colour of look.css, for canvases.
export function colour(name) {
  if (!colours.has(name))
    colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  return colours.get(name);
}

dark.addEventListener("change", applyTheme);
