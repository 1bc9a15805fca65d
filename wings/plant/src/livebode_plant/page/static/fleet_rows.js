// @ts-check
// Rows of a list that is drawn again each second: what has not changed keeps its element, and the focus its place.
import { roving } from "./roving.js";

/** @typedef {{name: string, of: unknown, make: () => HTMLElement}} Row `of` is all that the row shows */

export class Rows {
  /** @type {Map<string, {key: string, row: HTMLElement}>} */
  made = new Map();
  /** @type {string | undefined} the row that last had the focus */
  chosen = undefined;

  /**
   * @param {HTMLElement} host
   * @param {(name: string, event: KeyboardEvent, row: HTMLElement) => boolean} act whether a key was used
   */
  constructor(host, act) {
    this.host = host;
    this.list = roving(host, (row, event) => act(row.dataset.row ?? "", event, row));
    host.addEventListener("focusin", ({ target }) => {
      const row = target instanceof Element && target.closest("[data-row]");
      if (row instanceof HTMLElement) this.chosen = row.dataset.row;
    });
  }

  /** @param {Row[]} rows */
  draw(rows) {
    const { host } = this,
      focused = host.contains(document.activeElement);
    /** @type {typeof this.made} */
    const made = new Map();
    for (const { name, of, make } of rows) {
      const key = JSON.stringify(of),
        known = this.made.get(name);
      const row = known?.key === key ? known.row : make();
      row.dataset.row = name;
      made.set(name, { key, row });
    }
    this.made = made;
    const shown = [...made.values()].map(({ row }) => row);
    if (shown.length !== host.children.length || shown.some((row, i) => row !== host.children[i]))
      host.replaceChildren(...shown);
    const stop = shown.find((row) => row.dataset.row === this.chosen) ?? shown[0];
    for (const row of shown) row.tabIndex = row === stop ? 0 : -1;
    if (focused && !host.contains(document.activeElement)) this.list.focus();
  }
}
