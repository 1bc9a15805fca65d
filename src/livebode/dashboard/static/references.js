// @ts-check
// References: up to eight stored responses with names, held by the server for this page, remembered in the address.
import { chosen, remember } from "./address.js";
import { moment } from "./clock.js";
import { REFERENCES } from "./frames.js";
import { tr } from "./language.js";
import { call, nameOf } from "./names.js";

/** @import { Bode } from "./bode.js" */
/** @import { Link } from "./link.js" */
/** @import { Reference } from "./messages.js" */
/** @typedef {{timeS: number | null, saved: string | null}} Source A time of the record, or what was saved with the run. */

export class References {
  /**
   * @param {Bode} bode
   * @param {Link} link
   * @param {{changed: () => void, complain: (text: string) => void}} actions
   */
  constructor(bode, link, { changed, complain }) {
    this.bode = bode;
    this.link = link;
    this.changed = changed;
    this.complain = complain;
    /** @type {Map<Reference, Source>} */
    this.stored = new Map();
  }

  /** The stored ones, in their order. */
  get names() {
    return REFERENCES.filter((name) => this.stored.has(name));
  }

  /**
   * Store another one; false if there is no room.
   *
   * @param {Source} source
   * @param {string} name
   */
  add(source, name) {
    const free = REFERENCES.find((one) => !this.stored.has(one));
    if (!free) {
      this.complain(tr("There are eight references: release one first."));
      return false;
    }
    this.take(free, source, name);
    return true;
  }

  /**
   * Store it in the place of the one with the same name, if there is one.
   *
   * @param {Source} source
   * @param {string} name
   */
  replace(source, name) {
    const same = this.names.find((one) => nameOf(one) === name);
    if (same) this.take(same, source, name);
    else this.add(source, name);
  }

  // The response that is shown.
  freeze() {
    const timeS = this.bode.curves.measured?.frame?.timeS[0];
    if (timeS !== undefined) this.add({ timeS, saved: null }, moment(timeS, true));
  }

  /**
   * @param {Reference} slot
   * @param {Source} source
   * @param {string} name
   */
  take(slot, source, name) {
    this.stored.set(slot, source);
    this.bode.shown.add(slot);
    call(slot, name);
    const { timeS, saved } = source,
      number = REFERENCES.indexOf(slot) + 1;
    const from = saved === null ? { time_s: timeS ?? 0 } : { saved };
    this.link.request({ kind: "freeze", slot: number, ...from }, `freeze ${number}`);
    this.note();
  }

  /** @param {Reference} slot */
  release(slot) {
    const number = REFERENCES.indexOf(slot) + 1;
    this.stored.delete(slot);
    this.link.forget(`freeze ${number}`);
    this.link.request({ kind: "unfreeze", slot: number });
    this.bode.drop(slot);
    const { operation } = this.bode;
    if (operation && (operation.a === slot || operation.b === slot)) this.bode.compute(null);
    this.note();
  }

  // The one that was stored last.
  releaseNewest() {
    const newest = [...this.stored.keys()].at(-1);
    if (newest) this.release(newest);
  }

  releaseAll() {
    for (const slot of this.names) this.release(slot);
  }

  /**
   * @param {Reference} slot
   * @param {string} name
   */
  rename(slot, name) {
    call(slot, name);
    this.note();
  }

  // What the address has: after a reload, or from a link.
  restore() {
    try {
      for (const [number, timeS, saved, name] of JSON.parse(chosen("bode-references", "[]"))) {
        const slot = REFERENCES[Number(number) - 1];
        const known = typeof timeS === "number" || typeof saved === "string";
        if (slot && known) this.take(slot, { timeS, saved }, String(name).slice(0, 60));
      }
    } catch {
      this.complain(tr("The references in the address cannot be read."));
    }
  }

  note() {
    const all = [...this.stored].map(([slot, { timeS, saved }]) => [
      REFERENCES.indexOf(slot) + 1,
      timeS,
      saved,
      nameOf(slot),
    ]);
    remember("bode-references", JSON.stringify(all), "[]");
    this.changed();
  }
}
