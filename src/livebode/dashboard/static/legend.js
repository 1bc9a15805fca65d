// @ts-check
// The legend of the Bode plot; its buttons hide curves, and show the bound in parts or as a whole.

import { LISTED } from "./curves.js";
import { tr } from "./language.js";
import { partSwatch, swatch } from "./looks.js";
import { element } from "./make.js";
import { nameOf, resultOf } from "./names.js";
import { shown } from "./parts.js";

/** @import { Bode } from "./bode.js" */
/** @import { Curves, Facts } from "./messages.js" */

/**
 * @param {HTMLElement} host
 * @param {Bode} bode
 * @param {Facts | null} facts
 * @param {Curves[]} references those that are stored
 */
export function legend(host, bode, facts, references) {
  /** @param {Curves} name */
  const present = (name) => {
    if (bode.operation || name === "result") return Boolean(bode.operation) && name === "result";
    if (name === "baseline") return Boolean(facts?.begun && facts.baseline);
    if (name === "model") return Boolean(facts?.begun && facts.model);
    if (name === "what if") return Boolean(bode.curves["what if"]);
    return name === "measured" || references.includes(name);
  };
  const inside = host.contains(document.activeElement) && document.activeElement;
  const focused = inside instanceof HTMLElement ? inside.dataset.name : null;
  const again = () => legend(host, bode, facts, references);
  host.replaceChildren(
    ...LISTED.filter(present).map((name) =>
      element(
        "button",
        {
          type: "button",
          "aria-pressed": String(bode.shown.has(name)),
          "data-name": name,
          onclick: () => {
            bode.toggle(name, !bode.shown.has(name));
            again();
          },
        },
        swatch(name, bode.few),
        name === "result" && bode.operation ? resultOf(bode.operation) : nameOf(name),
      ),
    ),
    ...(bode.operation ? [] : partsOf(bode)),
  );
  const previous = focused && host.querySelector(`[data-name="${focused}"]`);
  if (previous instanceof HTMLElement) previous.focus();
}

/** The switch for the parts of the bound, and what each is; nothing where no part besides noise is known. @param {Bode} bode */
function partsOf(bode) {
  const { view, parts } = bode;
  if (!parts.size) return [];
  const onclick = () => {
    view.choose("bound", view.inParts ? "whole" : "parts");
    bode.rebuild();
  };
  return [
    element(
      "button",
      { type: "button", "aria-pressed": String(view.inParts), "data-name": "parts", onclick },
      tr("parts of the bound"),
    ),
    ...(view.inParts ? shown(parts) : []).map(({ ink, words }) =>
      element("span", { class: "key" }, partSwatch(ink), words),
    ),
  ];
}
