// @ts-check
// Downloads: the exact numbers from the server, and their menu.
import { address, refusal } from "./link.js";
import { element } from "./make.js";

/**
 * @param {string} name
 * @param {Blob} blob
 */
export function save(name, blob) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/**
 * @param {import("./link.js").Query} query
 * @param {string} name
 */
export async function numbers(query, name) {
  const answer = await fetch(address("/api/export", query));
  if (!answer.ok) throw await refusal(answer);
  save(name, await answer.blob());
}

export class Menu {
  /**
   * @param {HTMLElement} button
   * @param {HTMLElement} menu
   * @param {[text: string, act: () => void][]} items
   */
  constructor(button, menu, items) {
    this.button = button;
    this.menu = menu;
    this.items = items.map(([text, act]) => {
      const onclick = () => {
        this.show(false);
        act();
      };
      return element("button", { type: "button", role: "menuitem", onclick }, text);
    });
    menu.replaceChildren(...this.items);
    button.addEventListener("click", () => this.show(Boolean(menu.hidden)));
    document.addEventListener("click", (event) => {
      if (!(event.target instanceof Node && button.parentElement?.contains(event.target))) this.show(false, false);
    });
    menu.addEventListener("keydown", (event) => {
      const step = event.key === "ArrowDown" ? 1 : event.key === "ArrowUp" ? -1 : 0;
      if (event.key === "Escape") this.show(false);
      if (!step) return;
      event.preventDefault();
      const at = this.items.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement)) + step;
      this.items[(at + this.items.length) % this.items.length].focus();
    });
  }

  /** @param {boolean} open */
  show(open, back = true) {
    if (this.menu.hidden === !open) return;
    this.menu.hidden = !open;
    this.button.setAttribute("aria-expanded", String(open));
    if (open) this.items[0].focus();
    else if (back) this.button.focus();
  }
}
