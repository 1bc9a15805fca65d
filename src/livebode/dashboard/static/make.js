// @ts-check
// Elements with plain text, never HTML, whatever a machine sends.

/**
 * The element of index.html with this id, of this kind.
 *
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @param {new () => T} [kind]
 * @returns {T}
 */
export function byId(id, kind = /** @type {new () => T} */ (/** @type {unknown} */ (HTMLElement))) {
  const found = document.getElementById(id);
  if (!(found instanceof kind)) throw new Error(`the page has no ${kind.name} #${id}`);
  return found;
}

/** @typedef {string | number | boolean | null | undefined | ((event: Event) => void)} Attribute */

/**
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, Attribute>} attributes `on…` are listeners
 * @param {(Node | string | number)[]} children
 */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, String(value));
  }
  made.append(...children.map((child) => (child instanceof Node ? child : document.createTextNode(String(child)))));
  return made;
}

/**
 * Buttons of which one is chosen.
 *
 * @template {string} V
 * @param {HTMLElement} host
 * @param {{value: V, text: string}[]} choices
 * @param {V | null} chosen
 * @param {(value: V) => void} onChoose
 */
export function segments(host, choices, chosen, onChoose) {
  const focused = host.contains(document.activeElement);
  host.replaceChildren();
  const buttons = choices.map(({ value, text }) =>
    element(
      "button",
      {
        type: "button",
        role: "radio",
        "aria-checked": String(value === chosen),
        tabindex: value === chosen ? 0 : -1,
        "data-value": value,
        onclick: () => onChoose(value),
      },
      text,
    ),
  );
  host.append(...buttons);
  if (focused) buttons.find((button) => button.tabIndex === 0)?.focus();
  host.onkeydown = (event) => {
    const step = STEPS[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    const at =
      (buttons.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement)) + step + buttons.length) %
      buttons.length;
    buttons[at].focus();
    onChoose(choices[at].value);
  };
}

/** @type {Record<string, number>} */
const STEPS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

/**
 * @param {HTMLElement} host
 * @param {string} value
 */
export function choose(host, value) {
  for (const button of host.querySelectorAll("button")) {
    button.setAttribute("aria-checked", String(button.dataset.value === value));
    button.tabIndex = button.dataset.value === value ? 0 : -1;
  }
}
