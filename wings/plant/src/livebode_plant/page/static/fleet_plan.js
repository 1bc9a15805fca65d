// @ts-check
// The floor plan: shapes whose id or data-axis is the path of an axis, a machine or a line show its state.
import { LOOKS, URGENT } from "./fleet_words.js";
import { below } from "./link.js";

const SVG = "http://www.w3.org/2000/svg";
/** @typedef {{shape: SVGGraphicsElement, mark: SVGTextElement, path: string, from: number, to: number, look: number}} Part */

export class FloorPlan {
  /** @type {Part[]} */
  parts = [];
  asked = false;

  /**
   * @param {HTMLElement} host
   * @param {(path: string, axis: number | null) => void} onGo `axis` if the shape is one
   */
  constructor(host, onGo) {
    this.host = host;
    this.onGo = onGo;
    host.addEventListener("keydown", (event) => this.key(event));
  }

  /** @param {string[]} paths @param {Uint8Array} looks */
  async show(paths, looks) {
    if (!this.asked) {
      this.asked = true;
      const answer = await fetch(below("/api/plan"));
      if (!answer.ok) return;
      const drawing = new DOMParser().parseFromString(await answer.text(), "image/svg+xml").documentElement;
      this.host.replaceChildren(document.importNode(drawing, true));
    }
    const svg = this.host.querySelector("svg");
    if (!svg) return;
    svg.setAttribute("role", "group");
    for (const { mark } of this.parts) mark.remove();
    this.parts = [...svg.querySelectorAll("[data-axis], [id]")].flatMap((shape) => {
      const path = shape.getAttribute("data-axis") ?? shape.id,
        inside = `${path}/`;
      const from = paths.findIndex((one) => one === path || one.startsWith(inside));
      if (from < 0 || !(shape instanceof SVGGraphicsElement)) return [];
      let to = from + 1;
      while (to < paths.length && paths[to].startsWith(inside)) to++;
      return [this.part(svg, shape, path, from, paths[from] === path ? from + 1 : to)];
    });
    this.colour(looks);
  }

  /** @param {SVGSVGElement} svg @param {SVGGraphicsElement} shape @param {string} path @param {number} from @param {number} to */
  part(svg, shape, path, from, to) {
    const { x, y, width, height } = shape.getBBox(),
      mark = document.createElementNS(SVG, "text"),
      side = Math.max(4, 0.6 * Math.min(width, height));
    // A transformed shape has its box in its own coordinates.
    const point = new DOMPoint(x + width / 2, y + height / 2).matrixTransform(shape.getCTM() ?? undefined);
    const at = point.matrixTransform(svg.getCTM()?.inverse());
    mark.setAttribute("x", String(at.x));
    mark.setAttribute("y", String(at.y));
    mark.setAttribute("font-size", String(side));
    mark.setAttribute("class", "plan-mark");
    mark.setAttribute("aria-hidden", "true");
    svg.append(mark);
    shape.setAttribute("tabindex", this.host.querySelector('[tabindex="0"]') ? "-1" : "0");
    shape.setAttribute("role", "button");
    shape.onclick = () => this.onGo(path, to === from + 1 ? from : null);
    return { shape, mark, path, from, to, look: -1 };
  }

  /** @param {Uint8Array} looks */
  colour(looks) {
    for (const part of this.parts) {
      let look = 1;
      for (let at = part.from; at < part.to; at++)
        if (URGENT.indexOf(looks[at]) < URGENT.indexOf(look)) look = looks[at];
      if (look === part.look) continue;
      const { key, sign, words } = LOOKS[look];
      part.look = look;
      part.shape.setAttribute("class", `plan-part plan-${key}`);
      part.shape.setAttribute("aria-label", `${part.path}: ${words}`);
      part.mark.setAttribute("class", `plan-mark plan-${key}`);
      part.mark.textContent = sign;
    }
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const at = this.parts.findIndex(({ shape }) => shape === document.activeElement);
    if (at < 0) return;
    /** @type {Record<string, number>} */
    const steps = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };
    const { path, from, to } = this.parts[at];
    if (event.key === "Enter" || event.key === " ") this.onGo(path, to === from + 1 ? from : null);
    else if (steps[event.key]) {
      const next = this.parts[(at + steps[event.key] + this.parts.length) % this.parts.length].shape;
      this.parts[at].shape.setAttribute("tabindex", "-1");
      next.setAttribute("tabindex", "0");
      next.focus();
    } else return;
    event.preventDefault();
  }
}
