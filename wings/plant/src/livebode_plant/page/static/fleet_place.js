// @ts-check
// Site, line, machine: where the page is, and the parts of that place with their states.

import { Rows } from "./fleet_rows.js";
import { LOOKS, thousands, URGENT } from "./fleet_words.js";
import { tr } from "./language.js";
import { element } from "./make.js";

const PARTS_MAX = 300;

export class Place {
  path = "";
  /** @type {{name: string, from: number, to: number}[]} */
  parts = [];

  /**
   * @param {HTMLElement} crumbs
   * @param {HTMLElement} host
   * @param {(path: string) => void} onGo
   */
  constructor(crumbs, host, onGo) {
    this.crumbs = crumbs;
    this.onGo = onGo;
    this.rows = new Rows(host, () => false);
  }

  /** @param {string} path @param {string[]} paths @param {string} name of the fleet */
  go(path, paths, name) {
    this.path = path;
    const inside = path ? `${path}/` : "";
    const first = inside ? paths.findIndex((one) => one.startsWith(inside)) : 0;
    this.parts = [];
    for (let at = Math.max(0, first); at < paths.length && paths[at].startsWith(inside); at++) {
      const end = paths[at].indexOf("/", inside.length);
      const part = paths[at].slice(0, end < 0 ? undefined : end);
      const last = this.parts.at(-1);
      if (last?.name === part) last.to = at + 1;
      else this.parts.push({ name: part, from: at, to: at + 1 });
    }
    this.draw(path, name);
  }

  /** @param {string} path @param {string} name */
  draw(path, name) {
    const levels = path ? path.split("/") : [];
    const buttons = [name, ...levels].map((level, i) => {
      const to = levels.slice(0, i).join("/"),
        current = i === levels.length;
      return element(
        "button",
        { type: "button", "aria-current": current ? "location" : null, onclick: () => this.onGo(to) },
        level,
      );
    });
    this.crumbs.replaceChildren(
      ...buttons.flatMap((one, i) => (i ? [element("span", { "aria-hidden": "true" }, "›"), one] : [one])),
    );
  }

  /** @param {Uint8Array} looks */
  count(looks) {
    const rows = this.parts.slice(0, PARTS_MAX).map(({ name, from, to }) => {
      const counts = new Uint32Array(LOOKS.length);
      for (let at = from; at < to; at++) counts[looks[at]]++;
      const some = URGENT.filter((look) => look > 1 && counts[look]);
      const shown = name.slice(name.lastIndexOf("/") + 1);
      return { name, of: [...counts], make: () => this.row(name, shown, to - from, some, counts) };
    });
    this.rows.draw(rows);
  }

  /** @param {string} path @param {string} name @param {number} axes @param {number[]} some @param {Uint32Array} counts */
  row(path, name, axes, some, counts) {
    const signs = some.map((look) =>
      element(
        "span",
        { class: `look-${LOOKS[look].key}` },
        element("span", { "aria-hidden": "true" }, `${LOOKS[look].sign} ${counts[look]}`),
        element("span", { class: "unseen" }, ` ${counts[look]} ${LOOKS[look].words},`),
      ),
    );
    return element(
      "button",
      { type: "button", class: "node", onclick: () => this.onGo(path) },
      element("b", {}, name),
      element("span", { class: "axes" }, tr("{count} axes", { count: thousands(axes) })),
      element("span", { class: "counts" }, ...signs),
    );
  }
}
