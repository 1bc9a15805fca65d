// @ts-check
// Which plot shows the curves: Bode, Nyquist or Nichols.
import { tr } from "./language.js";
import { byId as $ } from "./make.js";
import { Option } from "./options.js";
import { Plane } from "./plane.js";

/** @import { Bode } from "./bode.js" */

/** @type {["bode" | "nyquist" | "nichols", string][]} */
const KINDS = [
  ["bode", tr("Bode")],
  ["nyquist", tr("Nyquist")],
  ["nichols", tr("Nichols")],
];

/**
 * @param {Bode} bode
 * @param {(text: string) => void} complain
 * @returns {() => void} shows the next one
 */
export function kinds(bode, complain) {
  const host = $("plane"),
    near = $("near");
  const option = new Option($("bode-kind"), "view", KINDS, (kind) => {
    host.hidden = kind === "bode";
    near.hidden = kind === "bode";
    for (const other of bode.hosts) other.hidden = kind !== "bode";
    bode.plane = kind === "bode" ? null : new Plane(bode, host, kind);
    $("bode-title").textContent = bode.plane?.title ?? tr("Bode plot");
    bode.rebuild();
  });
  option.entry = true;
  near.addEventListener("click", () => {
    if (bode.plane?.loop) bode.plane.near();
    else complain(tr("The critical point −1 belongs to the open loop: choose the open loop."));
  });
  return () => {
    const at = KINDS.findIndex(([kind]) => kind === option.value);
    option.choose(KINDS[(at + 1) % KINDS.length][0]);
  };
}
