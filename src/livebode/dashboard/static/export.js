// @ts-check
// The dialog that asks for plot, size and colours of a picture.
import { save } from "./download.js";
import { tr } from "./language.js";
import { byId as $, element } from "./make.js";
import { picture } from "./picture.js";

/** @import { PlotName } from "./plots.js" */

const SIDE_PX_MIN = 200,
  SIDE_PX_MAX = 8000,
  // Letters of 12 px are legible on a picture of this area.
  USUAL_PX = 1000 * 700;
/** @type {[words: string, width: number, height: number, scale: number][]} */
const SIZES = [
  [tr("slide, 16:9"), 1920, 1080, 1.6],
  [tr("paper, 160 mm × 120 mm at 300 dpi"), 1890, 1417, 2.4],
  [tr("paper, one column of 85 mm at 600 dpi"), 2008, 1700, 4],
];

/**
 * @param {(name: PlotName) => import("./picture.js").Plot} plot
 * @param {(name: PlotName) => string} fileName without its ending
 * @param {(text: string) => void} complain
 */
export function exportDialog(plot, fileName, complain) {
  const dialog = $("export", HTMLDialogElement),
    what = $("export-what", HTMLSelectElement),
    size = $("export-size", HTMLSelectElement),
    [width, height] = [$("export-width", HTMLInputElement), $("export-height", HTMLInputElement)],
    theme = $("export-theme", HTMLSelectElement);
  /** @type {[value: PlotName, words: string][]} */
  const names = [
    ["bode", tr("Bode plot")],
    ["tracking", tr("Tracking")],
    ["map", tr("Map")],
  ];
  what.append(...names.map(([value, words]) => element("option", { value }, words)));
  size.append(
    ...SIZES.map(([words], i) => element("option", { value: i }, words)),
    element("option", { value: SIZES.length }, tr("own size")),
  );
  const chooseSize = () => {
    const [, w, h] = SIZES[size.selectedIndex] ?? [];
    if (!w || !h) return;
    width.value = String(w);
    height.value = String(h);
  };
  chooseSize();
  size.addEventListener("change", chooseSize);
  for (const side of [width, height]) {
    side.min = String(SIDE_PX_MIN);
    side.max = String(SIDE_PX_MAX);
    side.addEventListener("input", () => {
      size.selectedIndex = SIZES.length;
    });
  }
  $("export-form", HTMLFormElement).addEventListener("submit", () => {
    const [w, h] = [Number(width.value), Number(height.value)];
    const scale = SIZES[size.selectedIndex]?.[3] ?? Math.max(0.5, Math.sqrt((w * h) / USUAL_PX));
    const name = names[what.selectedIndex][0];
    const paper = { width: w, height: h, scale, theme: theme.value === "dark" ? "dark" : "light" };
    const sheet = picture(plot(name), /** @type {import("./picture.js").Paper} */ (paper));
    sheet.toBlob((blob) => {
      if (blob) save(`${fileName(name)}.png`, blob);
      else complain(tr("This browser cannot draw a picture of {width} × {height} pixels.", { width: w, height: h }));
    }, "image/png");
  });
  $("export-cancel").addEventListener("click", () => dialog.close());
  return () => dialog.showModal();
}
