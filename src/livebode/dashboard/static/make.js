// Elements with plain text, never HTML, whatever a machine sends.
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.map((child) => (child instanceof Node ? child : document.createTextNode(String(child)))));
  return made;
}

// Buttons of which one is chosen. `choices` are {value, text, title, why}; `why` is the reason that one is disabled.
export function segments(host, choices, chosen, onChoose) {
  const focused = host.contains(document.activeElement);
  host.replaceChildren();
  const buttons = choices.map(({ value, text, title, why }) =>
    element(
      "button",
      {
        type: "button",
        role: "radio",
        "aria-checked": String(value === chosen),
        "aria-disabled": why ? "true" : null,
        tabindex: value === chosen ? 0 : -1,
        title: why || title || "",
        "data-value": value,
        onclick: () => onChoose(value, why),
      },
      text,
    ),
  );
  host.append(...buttons);
  if (focused) buttons.find((button) => button.tabIndex === 0)?.focus();
  host.onkeydown = (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    const at = (buttons.indexOf(document.activeElement) + step + buttons.length) % buttons.length;
    buttons[at].focus();
    if (!choices[at].why) onChoose(choices[at].value, "");
  };
}

export function choose(host, value) {
  for (const button of host.children) {
    button.setAttribute("aria-checked", String(button.dataset.value === String(value)));
    button.tabIndex = button.dataset.value === String(value) ? 0 : -1;
  }
}
