// @ts-check
// Wall mode: what a person reads from three metres, and nothing to operate.
import { chosen, remember } from "./address.js";
import { hourMinute } from "./clock.js";
import { tr } from "./language.js";
import { SIGNS } from "./look.js";
import { element } from "./make.js";
import { sentence, shortWord } from "./verdict.js";
import { drawTiles } from "./wall-tiles.js";

/** @import { Page } from "./messages.js" */

const RANK = ["alarm", "check", "open", "ok"];
const CLOCK_MS = 1000,
  OFFER_MS = 6000;

export class Wall {
  /**
   * @param {HTMLElement} host
   * @param {Page} page
   * @param {() => void} onChange the plots have another size of letters
   */
  constructor(host, page, onChange) {
    this.host = host;
    this.page = page;
    this.onChange = onChange;
    this.offered = 0;
    this.lamp = element("span", { class: "lamp" });
    this.name = element("h1", { class: "wall-name" });
    this.clock = element("time", { class: "wall-clock" });
    this.text = element("p", { class: "wall-sentence" });
    this.tiles = element("ul", { class: "wall-tiles", "aria-label": tr("Axes") });
    const leave = { class: "wall-leave", type: "button", hidden: true, onclick: () => this.show(false) };
    this.leave = element("button", leave, tr("Leave wall mode"));
    host.append(element("header", {}, this.lamp, this.name, this.clock), this.text, this.tiles, this.leave);
    document.addEventListener("pointerdown", ({ pointerType }) => {
      if (this.on && pointerType === "touch") this.offer();
    });
    document.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && this.on && !document.querySelector("dialog[open]")) this.show(false);
    });
    setInterval(() => this.tick(), CLOCK_MS);
    this.show(chosen("wall", /** @type {string} */ ("")) === "1");
  }

  get on() {
    return !this.host.hidden;
  }

  toggle() {
    this.show(!this.on);
  }

  // Without a keyboard a tap shows how to leave, for a while.
  offer() {
    this.leave.hidden = false;
    clearTimeout(this.offered);
    this.offered = setTimeout(() => {
      this.leave.hidden = true;
    }, OFFER_MS);
  }

  /** @param {boolean} on */
  show(on) {
    this.leave.hidden = true;
    this.host.hidden = !on;
    document.body.classList.toggle("wall", on);
    remember("wall", on ? "1" : "", "");
    this.tick();
    this.draw();
    this.onChange();
  }

  tick() {
    const text = hourMinute(Date.now() / 1000);
    if (this.on && this.clock.textContent !== text) this.clock.textContent = text;
  }

  draw() {
    if (!this.on) return;
    const { up, verdicts, facts } = this.page;
    const axes = verdicts
      .map((axis, index) => ({ axis, index, ...sentence(up, { ...axis, other: index !== facts?.axis }) }))
      .sort((a, b) => RANK.indexOf(a.tone) - RANK.indexOf(b.tone));
    const several = axes.length > 1,
      [worst] = axes;
    const { text, tone } = worst ?? sentence(up, null);
    this.name.textContent = facts?.name ?? ""; // of the axis in the picture
    const lamp = document.getElementById("lamp")?.className ?? "lamp";
    this.lamp.className = up ? lamp : "lamp lost";
    const shown = `${SIGNS[tone]} ${several && worst ? `${worst.axis.name}: ` : ""}${text}`;
    const whole = shown.replace(/(?<=\d) (?=\S)/g, "\u00a0"); // no line ends between a number and its unit
    if (this.text.textContent !== whole) this.text.textContent = whole;
    this.text.className = `wall-sentence ${tone}`;
    const tiles = axes.map(({ axis, index, text, tone }) => {
      return { name: axis.name, index, text, word: shortWord(up, axis), tone };
    });
    drawTiles(this.host, this.tiles, several ? tiles : [], facts?.axis);
  }
}
