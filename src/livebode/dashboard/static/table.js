// @ts-check
// All lines of the Bode plot as a table, for a person who does not see the curves or wants their numbers.
import { moment } from "./clock.js";
import { halfDeg, highDb, lowDb } from "./frames.js";
import { tr } from "./language.js";
import { byId as $, element } from "./make.js";
import { nameOf } from "./names.js";
import { shown } from "./parts.js";
import { angle, bounds, frequency, halfAngle, level } from "./values.js";
import { fixed, plain } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { AtCursor, Curves } from "./messages.js" */

/** The parts of a bound that are shown of a curve. @param {Bode} bode @param {Curves} name */
const partsOf = ({ parted, parts }, name) => (parted && name === "measured" ? shown(parts) : []);

/**
 * @param {AtCursor | undefined} value
 * @param {import("./view.js").View} view
 * @param {import("./parts.js").Shown[]} parts
 */
function cells(value, view, parts) {
  if (!value) return ["", "", "", ...parts.map(() => "")];
  const { db, deg, reach, coherence } = value,
    known = Number.isFinite(reach) && lowDb(db, reach) > -999;
  return [
    known ? `${level(db, view)} (${bounds(lowDb(db, reach), db, highDb(db, reach), view)})` : level(db, view),
    Number.isFinite(reach) ? `${angle(deg)} ${halfAngle(halfDeg(reach))}` : angle(deg),
    Number.isFinite(coherence) ? fixed(coherence, 3) : "",
    ...parts.map(({ i }) => (Number.isFinite(reach) ? plain(100 * value.parts[i], 2) : "")),
  ];
}

/** @param {Bode} bode */
function filled(bode) {
  const values = bode.lines.map((_, line) => bode.valuesAt(line)),
    names = /** @type {Curves[]} */ ([...new Set(values.flatMap((found) => Object.keys(found)))]);
  const heads = names.flatMap((name) => [
    `${nameOf(name)}: ${tr("magnitude")}`,
    `${nameOf(name)}: ${tr("phase")}`,
    `${nameOf(name)}: ${tr("coherence")}`,
    ...partsOf(bode, name).map(({ words }) => `${nameOf(name)}: ${words}, %`),
  ]);
  return [
    element(
      "thead",
      {},
      element("tr", {}, ...[tr("frequency"), ...heads].map((text) => element("th", { scope: "col" }, text))),
    ),
    element(
      "tbody",
      {},
      ...bode.lines.map((hz, line) =>
        element(
          "tr",
          {},
          element("th", { scope: "row" }, frequency(hz, bode.view)),
          ...names
            .flatMap((name) => cells(values[line][name], bode.view, partsOf(bode, name)))
            .map((text) => element("td", {}, text)),
        ),
      ),
    ),
  ];
}

/**
 * @param {Bode} bode
 * @returns {() => void} opens the table
 */
export function table(bode) {
  const dialog = $("table", HTMLDialogElement);
  return () => {
    const frame = bode.curves.measured?.frame;
    const words = frame ? tr("at {time}, bounds: 95 %", { time: moment(frame.timeS[0], true) }) : "";
    $("table-values").replaceChildren(element("caption", {}, `${bode.symbol} ${words}`), ...filled(bode));
    if (!dialog.open) dialog.showModal();
  };
}
