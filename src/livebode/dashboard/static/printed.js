// @ts-check
// The page on paper: pictures with their legends, verdict, margins and events; no controls, white ground.
import { printTime } from "./clock.js";
import { tr } from "./language.js";
import { byId as $, element } from "./make.js";
import { picture } from "./picture.js";

/** @import { Plot } from "./picture.js" */
/** @import { PlotName } from "./plots.js" */

/** @type {[name: PlotName, width: number, height: number][]} */
const PLOTS = [
  ["bode", 900, 640],
  ["tracking", 900, 400],
  ["map", 900, 400],
];
const SCALE = 2;

/**
 * A copy of a part of the page, without its buttons and names.
 *
 * @param {HTMLElement} part
 */
function copied(part) {
  const copy = /** @type {HTMLElement} */ (part.cloneNode(true));
  copy.hidden = false;
  for (const inner of [copy, ...copy.querySelectorAll("[id]")]) inner.removeAttribute("id");
  for (const button of copy.querySelectorAll("button, .plot, .trends, .zone-note")) button.remove();
  return copy;
}

/**
 * Pictures cannot be drawn while the browser prints, so they are drawn before.
 *
 * @param {(name: PlotName) => Plot} plot
 * @param {() => boolean} ready whether there is something to print
 */
export function printed(plot, ready) {
  const sheet = $("sheet");
  addEventListener("beforeprint", () => {
    if (!ready()) return;
    const pictures = PLOTS.map(([name, width, height]) =>
      picture(plot(name), { width: width * SCALE, height: height * SCALE, scale: SCALE, theme: "light" }),
    );
    const [verdict, health, readout, margins, events] = ["verdict", "health", "readout", "pane-margins", "events"].map(
      (id) => copied($(id)),
    );
    sheet.replaceChildren(
      element("h1", {}, document.title),
      element("p", { class: "judged" }, verdict.textContent ?? "", ` – ${$("verdict").title}`),
      element("p", {}, tr("Printed at {time}", { time: printTime() })),
      health,
      pictures[0],
      readout,
      ...pictures.slice(1),
      element("h2", {}, tr("Margins")),
      margins,
      element("h2", {}, tr("Events")),
      events,
    );
  });
  addEventListener("afterprint", () => sheet.replaceChildren());
}
