// Downloads: the picture from the canvases, the exact numbers from the server.
import { element } from "./make.js";
import { colour } from "./theme.js";

function save(name, blob) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// The displayed Bode plot with a title, as a PNG.
export async function picture(name, title, words, charts) {
  const ratio = devicePixelRatio,
    head = 54 * ratio;
  const canvases = charts.map((made) => made.ctx.canvas);
  const sheet = element("canvas");
  sheet.width = Math.max(...canvases.map((c) => c.width));
  sheet.height = head + canvases.reduce((sum, c) => sum + c.height, 0);
  const ctx = sheet.getContext("2d");
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
  save(name, await new Promise((done) => sheet.toBlob(done, "image/png")));
}

export async function numbers(query, name) {
  const answer = await fetch(`/api/export?${new URLSearchParams(query)}`);
  if (!answer.ok) throw new Error((await answer.json()).error);
  save(name, await answer.blob());
}

export class Menu {
  constructor(button, menu, items) {
    Object.assign(this, { button, menu });
    menu.replaceChildren(
      ...items.map(([text, act]) =>
        element(
          "button",
          {
            type: "button",
            role: "menuitem",
            onclick: () => {
              this.show(false);
              act();
            },
          },
          text,
        ),
      ),
    );
    button.addEventListener("click", () => this.show(menu.hidden));
    document.addEventListener("click", (event) => {
      if (!button.parentElement.contains(event.target)) this.show(false, false);
    });
    menu.addEventListener("keydown", (event) => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[event.key],
        all = [...menu.children];
      if (event.key === "Escape") this.show(false);
      if (!step) return;
      event.preventDefault();
      all[(all.indexOf(document.activeElement) + step + all.length) % all.length].focus();
    });
  }

  show(open, back = true) {
    if (this.menu.hidden === !open) return;
    this.menu.hidden = !open;
    this.button.setAttribute("aria-expanded", String(open));
    if (open) this.menu.firstChild.focus();
    else if (back) this.button.focus();
  }
}
