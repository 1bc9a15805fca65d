// @ts-check
// The menu "Curves" of the Bode plot: references, what is saved with the run, computed curves, annotations, the link.
import { moment } from "./clock.js";
import { LISTED } from "./curves.js";
import { tr } from "./language.js";
import { swatch } from "./looks.js";
import { element } from "./make.js";
import { nameOf } from "./names.js";
import { popover } from "./popover.js";
import { frequency } from "./values.js";

/** @import { Operation } from "./arithmetic.js" */
/** @import { Bode } from "./bode.js" */
/** @import { Curves, Reference } from "./messages.js" */
/** @import { References } from "./references.js" */
/** @import { Saved } from "./saved.js" */

/**
 * @typedef {object} Parts
 * @property {Bode} bode
 * @property {References} references
 * @property {Saved} saved
 * @property {() => boolean} operator whether this person may save
 * @property {(text: string) => void} complain
 */

/** @param {string} text @param {() => void} onclick @param {string} [words] */
const button = (text, onclick, words) =>
  element("button", { type: "button", onclick, "aria-label": words, title: words }, text);

/**
 * @param {HTMLElement} opener
 * @param {HTMLElement} panel
 * @param {Parts} parts
 */
export function curvesMenu(opener, panel, parts) {
  const controls = () => [.../** @type {NodeListOf<HTMLElement>} */ (panel.querySelectorAll("input, select, button"))];
  const fill = () => {
    const focused = controls().indexOf(/** @type {HTMLElement} */ (document.activeElement));
    panel.replaceChildren(
      ...referenceRows(parts),
      ...savedRows(parts),
      ...computedRows(parts),
      ...annotationRows(parts),
    );
    controls()[focused]?.focus();
  };
  return { show: popover(opener, panel, fill), fill: () => panel.hidden || fill() };
}

/** @param {string} text */
const heading = (text) => element("h3", {}, text);

/** @param {Parts} parts */
function referenceRows({ bode, references, saved, operator }) {
  const rows = references.names.map((slot) => {
    const name = element("input", {
      type: "text",
      maxlength: 60,
      value: nameOf(slot),
      "aria-label": tr("name of the reference"),
    });
    name.addEventListener("change", () => references.rename(slot, name.value.trim() || slot));
    const row = element("div", { class: "row", "data-reference": slot }, swatch(slot, bode.few), name);
    const timeS = references.stored.get(slot)?.timeS;
    if (operator() && typeof timeS === "number")
      row.append(
        button(
          tr("Save"),
          () => saved.change({ kind: "reference", text: nameOf(slot), time_s: timeS }),
          tr("save this reference with the run"),
        ),
      );
    row.append(button("×", () => references.release(slot), tr("release this reference")));
    return row;
  });
  const freeze = button(tr("Freeze the curve that is shown (F)"), () => references.freeze());
  return [heading(tr("References")), ...rows, freeze];
}

/** @param {Parts} parts */
function savedRows({ references, saved, operator }) {
  const rows = saved.all.references.map(({ id, name, time_s: timeS }) => {
    const row = element(
      "div",
      { class: "row", "data-saved": id },
      element("span", {}, `${name} (${moment(timeS, true)})`),
    );
    row.append(button(tr("Show"), () => references.add({ timeS: null, saved: id }, name)));
    if (operator())
      row.append(button("×", () => saved.change({ kind: "remove", text: id }), tr("delete this saved reference")));
    return row;
  });
  return rows.length ? [heading(tr("Saved with the run")), ...rows] : [];
}

/** @param {Parts} parts */
function computedRows({ bode, references }) {
  /** @type {Curves[]} */
  const names = LISTED.filter(
    (n) =>
      n !== "result" && n !== "what if" && (bode.curves[n] || references.names.includes(/** @type {Reference} */ (n))),
  );
  /** @param {string} which @param {Curves} value */
  const curve = (which, value) => {
    const select = element(
      "select",
      { "aria-label": which },
      ...names.map((n) => element("option", { value: n }, `${which}: ${nameOf(n)}`)),
    );
    select.value = value;
    return select;
  };
  const other = names.find((n) => n !== "measured") ?? "measured";
  const a = curve("A", bode.operation?.a ?? "measured"),
    b = curve("B", bode.operation?.b ?? other);
  const kind = element(
    "select",
    { "aria-label": tr("what is computed"), "data-option": "operation" },
    element("option", { value: "" }, tr("nothing")),
    element("option", { value: "ratio" }, tr("A/B in dB and °")),
    element("option", { value: "difference" }, tr("A − B, complex")),
  );
  kind.value = bode.operation?.kind ?? "";
  const apply = () =>
    bode.compute(kind.value ? /** @type {Operation} */ ({ kind: kind.value, a: a.value, b: b.value }) : null);
  for (const select of [a, b, kind]) select.addEventListener("change", apply);
  return [heading(tr("Computed curve")), element("div", { class: "row" }, kind, a, b)];
}

/** @param {Parts} parts */
function annotationRows({ bode, saved, operator }) {
  const rows = saved.all.annotations.map(({ id, text, frequency_hz: hz }) => {
    const row = element("div", { class: "row" }, element("span", {}, `${frequency(hz, bode.view)}: ${text}`));
    if (operator())
      row.append(button("×", () => saved.change({ kind: "remove", text: id }), tr("delete this annotation")));
    return row;
  });
  if (operator() && bode.lines.length) {
    const text = element("input", { type: "text", maxlength: 200, "aria-label": tr("text of the annotation") });
    const add = () => {
      const hz = bode.extremum?.hz ?? bode.lines[bode.line];
      if (text.value.trim()) saved.change({ kind: "annotation", text: text.value.trim(), frequency_hz: hz });
    };
    text.addEventListener("keydown", ({ key }) => key === "Enter" && add());
    rows.push(element("div", { class: "row" }, text, button(tr("Add at the cursor or peak"), add)));
  }
  return rows.length ? [heading(tr("Annotations, saved with the run")), ...rows] : [];
}
