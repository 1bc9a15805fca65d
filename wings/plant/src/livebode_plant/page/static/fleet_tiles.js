// @ts-check
// A tile for each axis, drawn on a canvas of the size of the window that scrolls: only what is visible is drawn.
import { arrange, EDGE, groupAt, HEAD, moved, SIZES } from "./fleet_groups.js";
import { LOOKS, thousands, URGENT } from "./fleet_words.js";
import { tr } from "./language.js";
import { element } from "./make.js";
import { colour, drawing, onTheme } from "./theme.js";

/** @import { Plan } from "./fleet_groups.js" */

const FONT = 'system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif',
  TIP_ROOM = 14;

export class Tiles {
  /** @type {Plan} */
  plan = { groups: [], columns: 1, height: 0, step: 1, rise: 1 };
  /** @type {ArrayLike<number>} numbers of the shown axes */
  shown = [];
  /** @type {string[]} */
  paths = [];
  looks = new Uint8Array();
  levels = 1;
  size = SIZES.small;
  /** Place of the tile with the cursor in `shown`. */
  at = 0;
  dirty = false;
  drawn = 0;

  /**
   * @param {HTMLElement} host that scrolls
   * @param {(axis: number) => void} onOpen
   */
  constructor(host, onOpen) {
    this.host = host;
    this.onOpen = onOpen;
    this.canvas = element("canvas", { "aria-hidden": "true" });
    this.ctx = drawing(this.canvas);
    this.space = element("div", { class: "space" });
    this.option = element("div", { role: "option", class: "unseen", id: "tile" });
    this.tip = element("div", { class: "tile-tip", "aria-hidden": "true", hidden: true });
    host.append(this.canvas, this.space, this.option);
    document.body.append(this.tip);
    this.sprites = document.createElement("canvas");
    host.addEventListener("scroll", () => this.soon());
    host.addEventListener("keydown", (event) => this.key(event));
    host.addEventListener("focus", () => this.tell());
    host.addEventListener("blur", () => this.soon());
    host.addEventListener("click", (event) => {
      const place = this.placeAt(event);
      if (place === null) return;
      this.at = place;
      this.tell();
      this.onOpen(this.shown[place]);
    });
    host.addEventListener("pointermove", (event) => this.point(event));
    host.addEventListener("pointerleave", () => {
      this.tip.hidden = true;
    });
    new ResizeObserver(() => this.resize()).observe(host);
    onTheme(() => this.paint());
  }

  /**
   * @param {ArrayLike<number>} shown
   * @param {number} levels by which they are grouped
   */
  show(shown, levels) {
    const axis = this.shown[this.at];
    this.shown = shown;
    this.levels = levels;
    const place = Array.prototype.indexOf.call(shown, axis);
    this.at = Math.max(0, place);
    this.named();
    this.resize();
  }

  /** @param {string} name of the size */
  resized(name) {
    this.size = SIZES[name];
    this.host.dataset.size = name;
    this.paint();
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    const ratio = devicePixelRatio;
    this.plan = arrange(this.shown, this.paths, this.levels, width, this.size);
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
      this.canvas.style.width = `${width}px`;
      this.canvas.style.height = `${height}px`;
    }
    this.space.style.height = `${this.plan.height}px`;
    if (this.ratio !== ratio) this.paint();
    this.soon();
  }

  // One picture of each look; a tile is a copy of it.
  paint() {
    const { height } = this.size,
      ratio = devicePixelRatio,
      side = Math.round(height * ratio);
    this.ratio = ratio;
    this.sprites.width = side * LOOKS.length;
    this.sprites.height = side;
    const ctx = drawing(this.sprites);
    ctx.scale(side / height, side / height);
    ctx.textAlign = "center";
    ctx.textBaseline = "middle";
    ctx.font = `${Math.round(height * 0.72)}px ${FONT}`;
    for (const [i, { sign, fill, ink, key }] of LOOKS.entries()) {
      const x = i * height;
      ctx.fillStyle = colour(fill || "paper");
      ctx.fillRect(x, 0, height, height);
      ctx.strokeStyle = colour(fill && fill !== "ground" ? fill : ink);
      ctx.lineWidth = height < 20 ? 1.5 : 2;
      const inset = ctx.lineWidth / 2;
      ctx.strokeRect(x + inset, inset, height - 2 * inset, height - 2 * inset);
      ctx.fillStyle = colour(ink);
      // A quiet page: a small tile that is in order has no sign.
      if (key !== "ok" || height >= 20) ctx.fillText(sign, x + height / 2, height / 2 + height * 0.04);
    }
    this.soon();
  }

  soon() {
    if (this.dirty) return;
    this.dirty = true;
    requestAnimationFrame(() => {
      this.dirty = false;
      this.draw();
    });
  }

  draw() {
    const { ctx, host, plan } = this,
      { clientWidth: width, clientHeight: height, scrollTop: top } = host;
    if (!width || !height) return;
    ctx.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    ctx.fillStyle = colour("paper");
    ctx.fillRect(0, 0, width, height);
    ctx.textBaseline = "middle";
    this.drawn++;
    if (!plan.groups.length) return;
    for (let g = groupAt(plan.groups, top); g < plan.groups.length && plan.groups[g].y < top + height; g++)
      this.group(g, top, width, height);
    if (document.activeElement === host) this.cursor(top);
  }

  /** @param {number} g @param {number} top @param {number} width @param {number} height */
  group(g, top, width, height) {
    const { ctx, plan, size } = this,
      { from, to, y, name, height: whole } = plan.groups[g],
      first = y + HEAD - top;
    const begin = Math.max(0, Math.floor(-first / plan.rise)),
      end = Math.min(Math.ceil((to - from) / plan.columns), Math.ceil((height - first) / plan.rise));
    const side = size.height * devicePixelRatio;
    for (let at = from + begin * plan.columns; at < Math.min(to, from + end * plan.columns); at++) {
      const axis = this.shown[at],
        look = this.looks[axis],
        row = Math.floor((at - from) / plan.columns),
        x = EDGE + ((at - from) % plan.columns) * plan.step,
        tileY = first + row * plan.rise;
      ctx.drawImage(this.sprites, look * side, 0, side, side, x, tileY, size.height, size.height);
      if (size.words) this.words(axis, x + size.height + 6, tileY + size.height / 2);
    }
    this.heading(name, from, to, Math.max(y - top, Math.min(0, y - top + whole - HEAD)), width);
  }

  /** @param {number} axis @param {number} x @param {number} y */
  words(axis, x, y) {
    const { ctx, size } = this;
    ctx.font = `13px ${FONT}`;
    ctx.textAlign = "left";
    ctx.fillStyle = colour("ink");
    const path = this.paths[axis],
      name = path.slice(path.slice(0, path.lastIndexOf("/")).lastIndexOf("/") + 1);
    ctx.save();
    ctx.beginPath();
    ctx.rect(x, y - size.height / 2, size.width - size.height - 8, size.height);
    ctx.clip();
    ctx.fillText(name, x, y);
    ctx.restore();
  }

  // It stays at the top while its tiles are visible.
  /** @param {string} name @param {number} from @param {number} to @param {number} y @param {number} width */
  heading(name, from, to, y, width) {
    const { ctx } = this;
    ctx.fillStyle = colour("paper");
    ctx.fillRect(0, y, width, HEAD - 2);
    ctx.textAlign = "left";
    ctx.fillStyle = colour("ink");
    ctx.font = `600 13px ${FONT}`;
    ctx.fillText(name, EDGE, y + HEAD / 2);
    const x = EDGE + ctx.measureText(name).width + (name ? 12 : 0);
    ctx.fillStyle = colour("muted");
    ctx.font = `13px ${FONT}`;
    ctx.fillText(summary(this.shown, this.looks, from, to), x, y + HEAD / 2);
  }

  /** @param {number} top */
  cursor(top) {
    const { ctx, plan, size } = this,
      box = this.box(this.at);
    if (!box) return;
    ctx.strokeStyle = colour("accent");
    ctx.lineWidth = 3;
    ctx.strokeRect(box.x - 2, box.y - top - 2, size.width + 4, size.height + 4);
    this.host.dataset.columns = String(plan.columns);
  }

  /**
   * Where a tile is on the scrolled plane.
   *
   * @param {number} place
   */
  box(place) {
    const group = this.plan.groups.find(({ to }) => place < to);
    if (!group) return null;
    const at = place - group.from,
      { columns, step, rise } = this.plan;
    return { x: EDGE + (at % columns) * step, y: group.y + HEAD + Math.floor(at / columns) * rise };
  }

  /** @param {MouseEvent} event @returns {number | null} */
  placeAt(event) {
    const { left, top } = this.host.getBoundingClientRect(),
      { groups, columns, step, rise } = this.plan;
    if (!groups.length) return null;
    const y = event.clientY - top + this.host.scrollTop,
      group = groups[groupAt(groups, y)],
      row = Math.floor((y - group.y - HEAD) / rise),
      column = Math.floor((event.clientX - left - EDGE) / step);
    const place = group.from + row * columns + column;
    return row >= 0 && column >= 0 && column < columns && place < group.to ? place : null;
  }

  /** @param {PointerEvent} event */
  point(event) {
    const place = event.pointerType === "touch" ? null : this.placeAt(event);
    this.tip.hidden = place === null;
    if (place === null) return;
    const axis = this.shown[place],
      { sign, words } = LOOKS[this.looks[axis]];
    this.tip.textContent = `${sign} ${this.paths[axis]}: ${words}`;
    const right = event.clientX + TIP_ROOM + this.tip.offsetWidth < innerWidth;
    this.tip.style.left = `${right ? event.clientX + TIP_ROOM : Math.max(0, event.clientX - TIP_ROOM - this.tip.offsetWidth)}px`;
    this.tip.style.top = `${Math.min(event.clientY + TIP_ROOM, innerHeight - this.tip.offsetHeight)}px`;
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.shown.length) return;
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      this.onOpen(this.shown[this.at]);
      return;
    }
    const next = moved(this.plan, this.at, event.key, Math.floor(this.host.clientHeight / this.plan.rise));
    if (next === null) return;
    event.preventDefault();
    this.at = next;
    this.tell();
  }

  // The tile with the cursor is visible, and a screen reader reads it.
  tell() {
    const box = this.box(this.at),
      { host } = this;
    this.soon();
    if (!box) return;
    if (box.y - HEAD < host.scrollTop) host.scrollTop = box.y - HEAD - 4;
    else if (box.y + this.size.height > host.scrollTop + host.clientHeight - 8)
      host.scrollTop = box.y + this.size.height - host.clientHeight + 8;
    this.named();
  }

  // What a screen reader reads as the chosen one of the list.
  named() {
    const axis = this.shown[this.at];
    if (axis === undefined) {
      this.option.textContent = tr("No axis matches.");
      return;
    }
    this.option.id = `tile-${axis}`;
    this.option.textContent = `${this.paths[axis]}: ${LOOKS[this.looks[axis]].words}`;
    this.option.setAttribute("aria-selected", "true");
    this.option.setAttribute("aria-setsize", String(this.shown.length));
    this.option.setAttribute("aria-posinset", String(this.at + 1));
    this.host.setAttribute("aria-activedescendant", this.option.id);
  }
}

/**
 * Number of axes, and of those that need attention by state.
 *
 * @param {ArrayLike<number>} shown
 * @param {Uint8Array} looks
 * @param {number} from
 * @param {number} to
 */
export function summary(shown, looks, from, to) {
  const counts = new Uint32Array(LOOKS.length);
  for (let at = from; at < to; at++) counts[looks[shown[at]]]++;
  const some = URGENT.filter((look) => look > 1 && counts[look]).map((look) => `${LOOKS[look].sign} ${counts[look]}`);
  return [tr("{count} axes", { count: thousands(to - from) }), ...some].join("   ");
}
