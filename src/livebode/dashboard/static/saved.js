// @ts-check
// What persons saved with the run: references and annotations.
import { ask, post, reason } from "./link.js";

/** @import { Annotation, SavedCurves } from "./messages.js" */

export class Saved {
  /**
   * @param {() => number} axis
   * @param {{changed: (annotations: Annotation[]) => void, complain: (text: string) => void}} actions
   */
  constructor(axis, { changed, complain }) {
    this.axis = axis;
    this.changed = changed;
    this.complain = complain;
    /** @type {SavedCurves} */
    this.all = { references: [], annotations: [] };
  }

  async fetch() {
    const axis = this.axis();
    try {
      const all = JSON.parse(new TextDecoder().decode(await ask("/api/saved", { axis })));
      if (axis === this.axis()) this.take(all);
    } catch (error) {
      this.complain(reason(error));
    }
  }

  /** @param {SavedCurves} all */
  take(all) {
    this.all = all;
    this.changed(all.annotations);
  }

  /**
   * Save or remove; true if it was done.
   *
   * @param {{kind: "reference", text: string, time_s: number} | {kind: "annotation", text: string, frequency_hz: number} | {kind: "remove", text: string}} change
   */
  async change(change) {
    try {
      await post("/api/saved", { axis: this.axis(), ...change });
      await this.fetch();
      return true;
    } catch (error) {
      this.complain(reason(error));
      return false;
    }
  }
}
