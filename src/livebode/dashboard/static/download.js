// @ts-check
// Downloads: the picture from the canvases, the exact numbers from the server.
import { address } from "./link.js";
import { element } from "./make.js";
import { colour, drawing } from "./theme.js";

/**
 * @param {string} name
 * @param {Blob} blob
 */
function save(name, blob) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/**
 * The displayed Bode plot with a title, as a PNG.
 *
 * @param {string} name
 * @param {string} title
 * @param {string} words
 * @param {import("./chart.js").Chart[]} charts
 */
export function picture(name, title, words, charts) {
  const ratio = devicePixelRatio,
    head = 54 * ratio;
  const canvases = charts.map((made) => made.ctx.canvas);
  const sheet = element("canvas");
  sheet.width = Math.max(...canvases.map((c) => c.width));
  sheet.height = head + canvases.reduce((sum, c) => sum + c.height, 0);
  const ctx = drawing(sheet);
  ctx.fillStyle = colour("paper");
  ctx.fillRect(0, 0, sheet.width, sheet.height);
  ctx.fillStyle = colour("ink");
  ctx.font = `600 ${16 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
  ctx.fillText(title, 14 * ratio, 24 * ratio);
  ctx.fillStyle = colour("muted");
  ctx.font = `${12.5 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
  ctx.fillText(words, 14 * ratio, 44 * ratio);
  let top = head;
  for (const canvas of canvases) {
    ctx.drawImage(canvas, 0, top);
    top += canvas.height;
  }
  sheet.toBlob((blob) => blob && save(name, blob), "image/png");
}

/**
 * @param {import("./link.js").Query} query
 * @param {string} name
 */
export async function numbers(query, name) {
  const answer = await fetch(address("/api/export", query));
  if (!answer.ok) throw new Error((await answer.json()).error);
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
