// @ts-check
// The menu "View" of the Bode plot: scales, units, derivative or integral, removed delay.
import { tr } from "./language.js";
import { element } from "./make.js";
import { popover } from "./popover.js";
import { plain } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { Option } from "./view.js" */

/** @type {[option: Option, words: string, choices: [value: string, words: string][]][]} */
const CHOICES = [
  [
    "frequency",
    tr("frequency axis"),
    [
      ["log", tr("logarithmic")],
      ["linear", tr("linear")],
    ],
  ],
  [
    "unit",
    tr("unit of frequency"),
    [
      ["hz", "Hz"],
      ["rad", "rad/s"],
    ],
  ],
  [
    "magnitude",
    tr("magnitude"),
    [
      ["db", "dB"],
      ["absolute", tr("absolute, logarithmic")],
    ],
  ],
  [
    "phase",
    tr("phase"),
    [
      ["unwrapped", tr("unwrapped")],
      ["wrapped", tr("wrapped to ±180°")],
    ],
  ],
];
/** @type {[value: string, words: string][]} */
const POWERS = [
  ["-2", tr("integrated twice, /(jω)²")],
  ["-1", tr("integrated, /(jω)")],
  ["0", tr("as it is")],
  ["1", tr("differentiated, ×(jω)")],
  ["2", tr("differentiated twice, ×(jω)²")],
];

/**
 * @param {HTMLElement} button
 * @param {HTMLElement} panel
 * @param {Bode} bode
 * @param {() => number} fittedDelayMs NaN without one
 */
export function viewMenu(button, panel, bode, fittedDelayMs) {
  const { view } = bode;
  /** @param {() => void} change */
  const apply = (change) => {
    change();
    bode.rebuild();
    mark();
  };
  const mark = () => button.classList.toggle("changed", view.inDrive || Boolean(view.words));
  /** @param {Option} option @param {string} words @param {[string, string][]} choices */
  const choice = (option, words, choices) => {
    const select = element(
      "select",
      { "data-option": option },
      ...choices.map(([value, text]) => element("option", { value }, text)),
    );
    select.value = view.options[option];
    select.addEventListener("change", () =>
      apply(() => {
        // Another magnitude: a range that was chosen for the previous one shows nothing.
        if (option === "power" || option === "units") bode.zooming.heights.fill(null);
        if (option === "phase") bode.zooming.heights[1] = null;
        view.choose(option, select.value);
      }),
    );
    return element("label", {}, element("span", {}, words), select);
  };
  const fill = () => {
    const unit = (/** @type {string} */ power) => bode.units[Number(power) + 2] ?? "";
    const powers = POWERS.map(
      ([value, words]) => /** @type {[string, string]} */ ([value, unit(value) ? `${words}: ${unit(value)}` : words]),
    );
    const delay = element("input", { type: "number", step: "any", "data-option": "delay", value: view.delayMs });
    const remove = (/** @type {number} */ ms) => {
      bode.zooming.heights[1] = null;
      apply(() => view.removeDelay(ms));
      delay.value = String(view.delayMs);
    };
    delay.addEventListener("change", () => remove(delay.valueAsNumber));
    const fitted = fittedDelayMs();
    const { unitsSi } = bode,
      at = view.power + 2;
    /** @param {string} words @param {string[] | undefined} units */
    const named = (words, units) => (units?.[at] ? `${words}: ${units[at]}` : words);
    /** @type {[value: string, words: string][]} */
    const units = [
      ["si", named(tr("SI"), unitsSi)],
      ["drive", named(tr("of the drive"), view.drive?.units)],
    ];
    panel.replaceChildren(
      ...(bode.ofDrive ? [choice("units", tr("units of magnitude and signals"), units)] : []),
      ...CHOICES.map(([option, words, choices]) => choice(option, words, choices)),
      choice("power", tr("derivative or integral"), powers),
      element("label", {}, element("span", {}, tr("delay removed, in ms")), delay),
    );
    if (Number.isFinite(fitted))
      panel.append(
        element(
          "button",
          { type: "button", onclick: () => remove(fitted) },
          tr("remove the fitted delay of {ms} ms", { ms: plain(fitted, 3) }),
        ),
      );
  };
  mark();
  return popover(button, panel, fill);
}
