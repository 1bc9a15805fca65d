// @ts-check
// State of the source and of the tracking, in one line.
import { tr } from "./language.js";
import { element } from "./make.js";
import { fixed, plain } from "./words.js";

/** @import { Health, Run } from "./messages.js" */
/** @typedef {[name: string, value: string, bad: boolean, title: string]} Tile */

/** @param {number} n */
const whole = (n) => (Number.isFinite(n) ? Math.round(n).toLocaleString("en-GB").replaceAll(",", " ") : "–");
/** @param {number | null | undefined} v */
const ms = (v) => (v === null || v === undefined ? "–" : `${v < 10 ? fixed(v, 1) : Math.round(v)} ms`);

/**
 * @param {Health} found
 * @param {Run} facts
 * @param {boolean} live
 */
function tilesOf(found, facts, live) {
  const { source, counts } = found;
  /** @type {Tile[]} */
  const tiles = [];
  /**
   * @param {string} name
   * @param {string} value
   */
  const tile = (name, value, bad = false, title = "") => tiles.push([name, value, bad, title]);
  if (live && source) tile(tr("source"), source.connected ? tr("connected") : tr("not connected"), !source.connected);
  const measured = source?.measured_hz;
  tile(
    tr("rate"),
    measured
      ? tr("{rate} Hz, measured {measured} Hz", { rate: plain(facts.rate_hz, 6), measured: plain(measured, 5) })
      : `${plain(facts.rate_hz, 6)} Hz`,
    Boolean(measured && Math.abs(measured / facts.rate_hz - 1) > 0.02),
    tr("samples per second"),
  );
  const perS = found.responses_per_s;
  if (live) tile(tr("responses"), perS === null ? "–" : tr("{count} per s", { count: plain(perS, 3) }));
  else tile(tr("responses"), whole(found.responses));
  const samples = found.samples ?? counts?.samples,
    gaps = found.gaps ?? counts?.gaps;
  if (samples !== undefined) tile(tr("samples"), whole(samples));
  if (gaps !== undefined) tile(tr("gaps"), whole(gaps), gaps > 0);
  if (source) {
    tile(tr("lost"), tr("{count} samples", { count: whole(source.lost) }), source.lost > 0);
    if (live) {
      tile(
        tr("silent"),
        source.silent_s === null ? "–" : ms(1000 * source.silent_s),
        Boolean(found.stale),
        tr("time since the last batch"),
      );
      if (source.latency_s !== null)
        tile(tr("latency"), ms(1000 * source.latency_s), false, tr("clock of this computer minus clock of the sender"));
      tile(tr("waiting"), `${plain(source.waiting_bytes / 1024, 3)} KiB`, source.waiting_bytes > 1 << 20);
      if (source.waiting_s !== undefined)
        tile(
          tr("backlog"),
          `${fixed(source.waiting_s, 1)} s`,
          Boolean(found.backlog_s),
          tr("received, but not yet tracked"),
        );
    }
  }
  if (found.behind_p99_ms !== undefined)
    tile(
      tr("arrival to response"),
      `${ms(found.behind_ms)}, p99 ${ms(found.behind_p99_ms)}`,
      found.behind_p99_ms > 1000,
    );
  if (found.given_up)
    tile(
      tr("not shown"),
      whole(found.given_up),
      true,
      tr("updates that arrived faster than they could be shown; the record contains them"),
    );
  if (found.refused) tile(tr("wrong tokens"), whole(found.refused), true);
  const windowMs = plain((1000 * facts.window) / facts.rate_hz, 4);
  tile(tr("window"), tr("{count} samples, {ms} ms", { count: whole(facts.window), ms: windowMs }));
  return tiles;
}

/**
 * @param {HTMLElement} host
 * @param {Health} found
 * @param {Run} facts
 * @param {{live: boolean}} span
 */
export function health(host, found, facts, { live }) {
  const tiles = tilesOf(found, facts, live);
  if (host.children.length !== tiles.length)
    host.replaceChildren(...tiles.map(() => element("div", {}, "", element("b"))));
  host.querySelectorAll("div").forEach((made, i) => {
    const [name, value, bad, title] = tiles[i],
      [label, number] = made.childNodes;
    label.textContent = name;
    number.textContent = `${value}${bad ? " ⚠" : ""}`;
    made.className = bad ? "bad" : "";
    made.title = title;
  });
}
