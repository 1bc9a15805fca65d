// @ts-check
// A list with one tab stop: arrows move from row to row, Enter and letters act on the row that has the focus.

/** @type {Record<string, (at: number, last: number) => number>} */
const MOVES = {
  ArrowDown: (at, last) => Math.min(last, at + 1),
  ArrowUp: (at) => Math.max(0, at - 1),
  PageDown: (at, last) => Math.min(last, at + 10),
  PageUp: (at) => Math.max(0, at - 10),
  Home: () => 0,
  End: (_at, last) => last,
};

/**
 * @param {HTMLElement} host
 * @param {(row: HTMLElement, event: KeyboardEvent) => boolean} act whether a key was used
 */
export function roving(host, act) {
  const rows = () => /** @type {HTMLElement[]} */ ([...host.children]);
  /** @param {HTMLElement | undefined} row */
  const stop = (row) => {
    for (const other of host.querySelectorAll('[tabindex="0"]')) other.setAttribute("tabindex", "-1");
    row?.setAttribute("tabindex", "0");
  };
  host.addEventListener("focusin", ({ target }) => {
    if (target instanceof Element) stop(rows().find((row) => row.contains(target)));
  });
  host.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const all = rows(),
      at = all.findIndex((row) => row.contains(document.activeElement));
    if (at < 0) return;
    const move = MOVES[event.key];
    if (move) all[move(at, all.length - 1)].focus();
    else if (!act(all[at], event)) return;
    event.preventDefault();
    event.stopPropagation();
  });
  return {
    focus: () => (rows().find((row) => row.tabIndex === 0) ?? rows()[0])?.focus(),
  };
}
