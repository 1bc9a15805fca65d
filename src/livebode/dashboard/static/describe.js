// @ts-check
// What a screen reader says of each plot. It changes at a calm pace and only if it differs: it is not a live region.
import { moment } from "./clock.js";
import { tr, trn } from "./language.js";
import { ofLoop } from "./marks.js";
import { angle, frequency, level } from "./values.js";
import { worded } from "./worded.js";
import { hertz, plain } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { Page } from "./messages.js" */
/** @import { Trends } from "./trends.js" */

const EVERY_MS = 3000;

/** @param {Bode} bode */
function highest(bode) {
  const found = bode.drawn[bode.main]?.db ?? [];
  let best = -1;
  for (const [i, at] of bode.at.entries())
    if (Number.isFinite(found[at]) && (best < 0 || Number(found[at]) > Number(found[bode.at[best]]))) best = i;
  if (best < 0) return "";
  return tr("highest {level} at {frequency}", {
    level: level(Number(found[bode.at[best]]), bode.view),
    frequency: frequency(bode.lines[best], bode.view),
  });
}

/** The phase at the line of the cursor. @param {Bode} bode */
function atCursor(bode) {
  const found = bode.valuesAt(bode.line)[bode.main];
  if (!found || !Number.isFinite(found.deg)) return "";
  return tr("{phase} at {frequency}", {
    phase: angle(found.deg),
    frequency: frequency(bode.lines[bode.line], bode.view),
  });
}

/** The margins that are drawn. @param {Bode} bode @param {(mark: import("./marks.js").Mark) => boolean} drawn */
const margins = (bode, drawn) =>
  ofLoop(bode)
    ? bode.known
        .margins()
        .filter(drawn)
        .map(({ words, hz }) => tr("{margin} at {hz} Hz", { margin: words, hz: plain(hz, 3) }))
    : [];

/** @param {(string | false)[]} words */
const text = (...words) => words.filter(Boolean).join(", ");

/**
 * Each chart of parameters: its newest value, the times, and between which values it is.
 *
 * @param {Trends} trends
 */
function describeTrends({ items, span, title }) {
  for (const { made, name, unit, words, t, v } of items.values()) {
    const host = made?.root.parentElement;
    if (!host) continue;
    const [from, to] = span ?? [-Infinity, Infinity],
      seen = [...v.keys()].filter((i) => Number.isFinite(v[i]) && t[i] >= from && t[i] <= to);
    if (!seen.length) {
      label(host, text(title(name), words.textContent ?? ""));
      continue;
    }
    const values = seen.map((i) => v[i]),
      times = { from: moment(t[seen[0]], true), to: moment(t[seen[seen.length - 1]], true) },
      [low, high] = [plain(Math.min(...values)), `${plain(Math.max(...values))} ${worded(unit)}`.trim()];
    const reach = tr("between {low} and {high}", { low, high });
    label(host, text(title(name), words.textContent ?? "", tr("{from} to {to}", times), reach));
  }
}

/**
 * @param {Page} page
 * @param {object} parts
 * @param {Bode} parts.bode
 * @param {import("./tracking.js").Tracking} parts.tracking
 * @param {import("./map.js").LineMap} parts.map
 * @param {Trends[]} parts.trends
 */
export function describe(page, { bode, tracking, map, trends }) {
  const plots = [tr("magnitude"), tr("phase"), tr("coherence")].map((name) => `${tr("Bode plot")}: ${name}`);
  const now = () => {
    const { hosts, lines, view, plane } = bode;
    for (const charts of trends) describeTrends(charts);
    if (!page.facts?.begun || !lines.length) {
      for (const [i, host] of hosts.entries()) label(host, plots[i]);
      label(tracking.host, tr("Tracking"));
      label(map.canvas, map.words);
      return;
    }
    const of = `${worded(page.quantity ?? "")} ${bode.symbol}`,
      band = tr("{from} to {to}", { from: frequency(lines[0], view), to: frequency(lines[lines.length - 1], view) }),
      curve = text(of, trn("{n} line", "{n} lines", lines.length), band),
      time = tr("at {time}", { time: moment(bode.curves.measured?.frame?.timeS[0], true) }),
      span = tr("{from} to {to}", { from: moment(tracking.fromS, true), to: moment(tracking.toS, true) });
    const more = [highest(bode), atCursor(bode), ""];
    for (const [i, host] of hosts.entries())
      label(host, text(plots[i], curve, more[i], ...margins(bode, ({ chart }) => chart === i), time));
    if (plane) label(plane.host, text(plane.title, curve, atCursor(bode), ...margins(bode, () => true), time));
    label(tracking.host, text(tr("Tracking"), of, span, ...tracking.chosen.map((i) => `${hertz(lines[i])} Hz`)));
    label(map.canvas, text(map.words, curve));
  };
  setInterval(now, EVERY_MS);
}

/**
 * @param {HTMLElement} host
 * @param {string} text
 */
function label(host, text) {
  if (host.getAttribute("aria-label") !== text) host.setAttribute("aria-label", text);
}
