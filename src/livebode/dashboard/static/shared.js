// @ts-check
// The axis and the moment in the address: by name and by time of day, so that a link means the same to everyone.
import { chosen, enter, link, remember } from "./address.js";
import { fromAddress, moment, toAddress } from "./clock.js";
import { tr } from "./language.js";
import { byId as $, element } from "./make.js";

/** @import { Beginning, Span } from "./messages.js" */

/**
 * Names of the axes in the address; of axes with one name the second is "name~2".
 *
 * @param {string[]} axes
 */
const addressed = (axes) =>
  axes.map((name, i) => {
    const before = axes.slice(0, i).filter((other) => other === name).length;
    return before ? `${name}~${before + 1}` : name;
  });

/**
 * The number of the axis in the address, once; without one, or with an unknown one, null.
 *
 * @param {Beginning} news
 * @param {(text: string) => void} complain
 */
export function axisInAddress({ axes, facts }, complain) {
  const name = chosen("axis", "");
  const at = name ? addressed(axes).indexOf(name) : facts.axis;
  if (at >= 0) return at === facts.axis ? null : at;
  remember("axis", "", "");
  complain(tr("No axis is named {name}; {shown} is shown.", { name, shown: facts.name }));
  return null;
}

/**
 * @param {string[]} axes
 * @param {number} axis
 */
export function rememberAxis(axes, axis) {
  enter();
  remember("axis", axis ? addressed(axes)[axis] : "", "");
}

/** @param {number | null} timeS null if the newest is shown */
export const rememberMoment = (timeS) => remember("at", timeS === null ? "" : toAddress(timeS), "");

/**
 * A time of the address within a span; NaN without one. A time outside is reported.
 *
 * @param {string} name
 * @param {Span} span
 * @param {(text: string) => void} complain
 */
export function timeInAddress(name, { first_s: first, last_s: last }, complain) {
  const text = /** @type {string} */ (chosen(name, ""));
  if (!text || first === null || last === null) return NaN;
  const timeS = fromAddress(text);
  const within = Math.min(last, Math.max(first, timeS));
  if (Number.isNaN(timeS)) {
    remember(name, "", "");
    complain(tr("{text} in the address is not a time of this run.", { text: text.slice(0, 40) }));
  } else if (Math.abs(within - timeS) > 0.01)
    complain(
      tr("{time} is not in the record, which covers {first} to {last}; the nearest time is shown.", {
        time: moment(timeS),
        first: moment(first),
        last: moment(last),
      }),
    );
  return within;
}

/** @param {(text: string) => void} complain */
export async function copyLink(complain) {
  try {
    await navigator.clipboard.writeText(link());
    complain(tr("The link to this view was copied."));
  } catch {
    // Without TLS browsers give no clipboard to pages of other computers.
    const dialog = $("link", HTMLDialogElement),
      field = element("input", { readonly: true, value: link(), "aria-label": tr("Link to this view") });
    $("link-text").replaceChildren(field);
    dialog.showModal();
    field.select();
  }
}
