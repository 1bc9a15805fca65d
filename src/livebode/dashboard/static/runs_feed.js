// @ts-check
// The list of all runs, asked for again every few seconds: only what has changed comes.
import { ask } from "./link.js";

/**
 * @typedef {object} RunRow A run; see run_entry.py.
 * @property {string} name
 * @property {"finished" | "recording" | "stopped" | "broken"} state
 * @property {number | null} written seconds since 1970
 * @property {number} size_bytes
 * @property {string} message
 * @property {import("./messages.js").Words} said the message
 * @property {string} machine
 * @property {string} recording
 * @property {string} signals
 * @property {number | null} begun seconds since 1970
 * @property {number | null} duration_s
 * @property {number} lines
 * @property {number | null} low_hz
 * @property {number | null} high_hz
 * @property {string} estimator
 * @property {boolean} averaged
 * @property {"ok" | "check" | "alarm" | "open"} tone
 * @property {number} alarms
 * @property {string} model
 * @property {[name: string, value: number, bound: number, unit: string][]} fit
 * @property {string[]} tags
 * @property {string} notes
 * @property {string} words
 */
/** @typedef {{version: number, names: string[] | null, runs: RunRow[], role: string, directory: string}} Answer */

const EVERY_MS = 3000;

/**
 * @param {string} path
 * @param {Record<string, string | number>} query
 */
export const json = async (path, query) => JSON.parse(new TextDecoder().decode(await ask(path, query)));

export class RunsFeed {
  /** @type {Map<string, RunRow>} */
  runs = new Map();
  version = 0;
  role = "";
  directory = "";
  /** @type {Promise<void> | null} */
  asking = null;

  /**
   * @param {() => void} onChange
   * @param {(error: unknown) => void} onError null when the server answers again
   */
  constructor(onChange, onError) {
    this.onChange = onChange;
    this.onError = onError;
  }

  start() {
    const next = () => (document.hidden ? Promise.resolve() : this.look()).finally(() => setTimeout(next, EVERY_MS));
    return next();
  }

  look() {
    this.asking ??= this.take().finally(() => {
      this.asking = null;
    });
    return this.asking;
  }

  async take() {
    try {
      /** @type {Answer} */
      const answer = await json("/api/runs", { since: this.version });
      this.onError(null);
      const first = !this.version;
      Object.assign(this, { version: answer.version, role: answer.role, directory: answer.directory });
      for (const run of answer.runs) this.runs.set(run.name, run);
      if (answer.names) {
        const there = new Set(answer.names);
        for (const name of this.runs.keys()) if (!there.has(name)) this.runs.delete(name);
      }
      if (first || answer.names) this.onChange();
    } catch (error) {
      this.onError(error);
    }
  }
}
