// The keyboard, and the page that says what it does.
import { element } from "./make.js";

// `actions` are [keys, words, act]; `each` has what a key does that shares its words with others.
export function keys(dialog, list, actions, each) {
  list.replaceChildren(
    ...actions.flatMap(([names, words]) => [
      element("dt", {}, ...names.flatMap((n) => [element("kbd", {}, n === " " ? "Space" : n), " "])),
      element("dd", {}, words),
    ]),
  );
  const real = { "←": "ArrowLeft", "→": "ArrowRight" };
  const known = new Map(
    actions.flatMap(([names, , act]) => names.map((name) => [real[name] || name, act || each[name]])),
  );
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || dialog.open) return;
    const { tagName, type } = event.target;
    const slides = type === "range" && event.key.startsWith("Arrow"),
      presses = tagName === "BUTTON" && (event.key === " " || event.key === "Enter");
    if (slides || presses || tagName === "SELECT" || type === "password") return;
    const act = known.get(event.key) || (event.key.length === 1 && known.get(event.key.toUpperCase()));
    if (!act) return;
    event.preventDefault();
    act();
  });
}
