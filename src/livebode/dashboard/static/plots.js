// @ts-check
// What a picture of each plot shows besides its curves: axis, quantity, time, lines, version.
import { moment } from "./clock.js";
import { tr, trn } from "./language.js";
import { byId as $ } from "./make.js";
import { legendOf } from "./picture.js";
import { worded } from "./worded.js";
import { fixed } from "./words.js";

/** @import { Page } from "./messages.js" */
/** @import { Plot } from "./picture.js" */

/** @typedef {"bode" | "tracking" | "map"} PlotName */

/**
 * @param {Page} page
 * @param {object} parts
 * @param {import("./bode.js").Bode} parts.bode
 * @param {import("./tracking.js").Tracking} parts.tracking
 * @param {import("./map.js").LineMap} parts.map
 * @returns {(name: PlotName) => Plot}
 */
export function plots(page, { bode, tracking, map }) {
  return (name) => {
    const { facts } = page,
      frame = bode.curves.measured?.frame;
    const count = facts?.begun ? facts.frequency_hz.length : 0;
    const lines = trn("{n} line", "{n} lines", count),
      span = tr("{from} to {to}", { from: moment(tracking.fromS, true), to: moment(tracking.toS, true) });
    const of = `${facts?.name ?? ""}: ${worded(page.quantity ?? "")}`;
    const common = { note: `livebode ${facts?.begun ? facts.version : ""}`, legend: () => [] };
    if (name === "tracking") {
      const tracked = tr("tracking"),
        some = tr("{count} of {lines} lines, bounds: 95 %", { count: tracking.chosen.length, lines: count });
      return {
        ...common,
        title: `${of}, ${tracked}`,
        words: `${span} · ${some}`,
        legend: () => legendOf($("tracking-lines")),
        charts: tracking.made ? [tracking.made] : [],
      };
    }
    if (name === "map") {
      return {
        ...common,
        title: `${of}, ${map.words}`,
        words: `${span} · ${lines}`,
        draw: (ctx, width, height) => map.drawOn(ctx, width, height),
      };
    }
    const place = frame?.schedule[0] ?? NaN,
      scheduled = page.schedule.name || tr("schedule"),
      over = Number.isFinite(place) ? ` · ${scheduled} ${fixed(place, 3)} ${page.schedule.unit}` : "";
    const at = tr("at {time}, bounds: 95 %", { time: moment(frame?.timeS[0], true) });
    return {
      ...common,
      title: [of, bode.plane?.title, bode.view.words].filter(Boolean).join(", "),
      words: `${at}${over} · ${lines}`,
      legend: () => legendOf($("legend")),
      charts: bode.charts,
    };
  };
}
