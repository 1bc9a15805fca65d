// @ts-check
// A lost server or a silent machine: since when, and the plots are greyed; both end by themselves. The server of a run
// that has ended is not lost.
import { clockTime, onClock } from "./clock.js";
import { tr } from "./language.js";

/** @import { Facts, Health } from "./messages.js" */

export class Lost {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host;
    /** @type {Date | null} */
    this.since = null;
    /** @type {"" | "over" | "server" | "machine"} */
    this.what = "";
    this.connected = false;
    /** Whether the run was at its end when its server was last heard. */
    this.over = false;
    onClock(() => this.draw());
  }

  /**
   * @param {{up: boolean, facts: Facts | null, health: Health | null}} known
   * @param {boolean} following the newest data, not a record or a time in the past
   */
  show({ up, facts, health }, following) {
    this.connected ||= up;
    if (up && health) this.over = Boolean(health.ending);
    const silent = following && facts?.begun && health?.stale;
    const what = !up && this.connected ? (this.over ? "over" : "server") : up && silent ? "machine" : "";
    if (what !== this.what) {
      const silentS = what === "machine" ? (health?.silent_s ?? 0) : 0;
      this.since = what ? new Date(Date.now() - 1000 * silentS) : null;
      this.what = what;
    }
    this.draw();
  }

  draw() {
    document.body.classList.toggle("stale", this.since !== null && this.what !== "over");
    this.host.hidden = this.since === null;
    this.host.classList.toggle("over", this.what === "over");
    if (!this.since) return;
    const time = clockTime(this.since);
    const words = {
      over: tr("The run and its server ended at {time}; `livebode view` shows the run again.", { time }),
      server: tr("No connection to the server since {time}; the plots show that moment.", { time }),
      machine: tr("No samples from the machine since {time}; the plots show that moment.", { time }),
    };
    this.host.textContent = this.what && words[this.what];
  }
}
