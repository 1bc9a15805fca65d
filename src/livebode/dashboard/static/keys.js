// The keyboard and its help.
import { element } from "./make.js";

// Whether the element with the focus uses a key itself.
function uses({ tagName, type }, key) {
  if (tagName === "INPUT" && type === "range") return key.startsWith("Arrow");
  if (tagName === "INPUT" && type === "checkbox") return key === " ";
  if (tagName === "BUTTON" || tagName === "SUMMARY") return key === " " || key === "Enter";
  if (tagName === "A") return key === "Enter";
  return tagName === "INPUT" || tagName === "SELECT";
}

// `actions` are [keys, words, act]; `each` has the action of a key that shares its words with others.
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
    if (uses(event.target, event.key)) return;
    const act = known.get(event.key) || (event.key.length === 1 && known.get(event.key.toUpperCase()));
    if (!act) return;
    event.preventDefault();
    act();
  });
}
