// @ts-check
// State of the source and of the tracking, in one line.
import { element } from "./make.js";
import { plain } from "./words.js";

/** @import { Health, Run } from "./messages.js" */
/** @typedef {[name: string, value: string, bad: boolean, title: string]} Tile */

/** @param {number} n */
const whole = (n) => (Number.isFinite(n) ? Math.round(n).toLocaleString("en-GB").replaceAll(",", " ") : "–");
/** @param {number | null | undefined} v */
const ms = (v) => (v === null || v === undefined ? "–" : `${v < 10 ? v.toFixed(1) : Math.round(v)} ms`);

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
  if (live && source) tile("source", source.connected ? "connected" : "not connected", !source.connected);
  const measured = source?.measured_hz;
  tile(
    "rate",
    `${plain(facts.rate_hz, 6)} Hz${measured ? `, measured ${plain(measured, 5)} Hz` : ""}`,
    Boolean(measured && Math.abs(measured / facts.rate_hz - 1) > 0.02),
    "samples per second",
  );
  if (live) tile("responses", found.responses_per_s === null ? "–" : `${plain(found.responses_per_s, 3)} per s`);
  else tile("responses", whole(found.responses));
  const samples = found.samples ?? counts?.samples,
    gaps = found.gaps ?? counts?.gaps;
  if (samples !== undefined) tile("samples", whole(samples));
  if (gaps !== undefined) tile("gaps", whole(gaps), gaps > 0);
  if (source) {
    tile("lost", `${whole(source.lost)} samples`, source.lost > 0);
    if (live) {
      tile(
        "silent",
        source.silent_s === null ? "–" : ms(1000 * source.silent_s),
        Boolean(found.stale),
        "time since the last batch",
      );
      if (source.latency_s !== null)
        tile("latency", ms(1000 * source.latency_s), false, "clock of this computer minus clock of the sender");
      tile("waiting", `${plain(source.waiting_bytes / 1024, 3)} KiB`, source.waiting_bytes > 1 << 20);
      if (source.waiting_s !== undefined)
        tile("backlog", `${source.waiting_s.toFixed(1)} s`, source.waiting_s > 2, "received, but not yet tracked");
    }
  }
  if (found.behind_p99_ms !== undefined)
    tile("arrival to response", `${ms(found.behind_ms)}, p99 ${ms(found.behind_p99_ms)}`, found.behind_p99_ms > 1000);
  if (found.given_up)
    tile(
      "not shown",
      whole(found.given_up),
      true,
      "updates that arrived faster than they could be shown; the record contains them",
    );
  if (found.refused) tile("wrong tokens", whole(found.refused), true);
  tile("window", `${whole(facts.window)} samples, ${plain((1000 * facts.window) / facts.rate_hz, 4)} ms`);
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
