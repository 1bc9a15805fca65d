// @ts-check
// The choice of the clock: the browser's zone, UTC, or the time since the start of the run.
import { choice, choose, known, onClock, SHOWN } from "./clock.js";
import { tr } from "./language.js";
import { element } from "./make.js";

const OWN = Intl.DateTimeFormat().resolvedOptions().timeZone;
const WORDS = {
  zone: OWN,
  utc: "UTC",
  run: tr("time of the run"),
};

const CHOICES = OWN === "UTC" ? SHOWN.filter((value) => value !== "utc") : SHOWN;

/** The next of the choices. */
export const nextClock = () => choose(CHOICES[(CHOICES.indexOf(choice()) + 1) % CHOICES.length]);

/**
 * Fill the list; the returned function shows whether the run has a clock.
 *
 * @param {HTMLSelectElement} list
 */
export function zoneChoice(list) {
  list.append(...CHOICES.map((value) => element("option", { value }, WORDS[value])));
  const show = () => {
    list.value = choice();
    list.disabled = !known();
    list.title = known()
      ? tr("Clock of all times (Z)")
      : tr("This run has no time of day: its recording has no date, or it is simulated.");
  };
  list.addEventListener("change", () => choose(CHOICES[list.selectedIndex]));
  onClock(show);
  show();
  return show;
}
