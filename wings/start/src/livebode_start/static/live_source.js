// @ts-check
// A live source: the field for its address, and what came from it.
import { tr, trn } from "./language.js";
import { post, reason } from "./link.js";
import { element } from "./make.js";
import { worded } from "./worded.js";
import { plain } from "./words.js";

/** @typedef {{name: string, unit: string, rate_hz: number | null, newest: number | null}} Heard a channel; see listening.py */
/** @typedef {{address: string, usable: boolean, trouble: import("./messages.js").Words, heard: Heard[]}} Answer */

/**
 * Ask the server to listen to an address.
 *
 * @param {string} address
 * @returns {Promise<Answer>}
 */
export const listen = (address) => post("/api/listen", { address });

/**
 * A form that listens to an address, and opens the page of what came.
 *
 * @param {(recording: string) => string} measuring address of that page
 */
export function addressForm(measuring) {
  const field = element("input", {
      id: "address",
      type: "text",
      inputmode: "url",
      autocomplete: "off",
      autocapitalize: "off",
      spellcheck: "false",
      required: true,
      maxlength: 2000,
      placeholder: "udp://0.0.0.0:5000",
      "aria-describedby": "address-hint",
    }),
    button = element("button", { class: "primary" }, tr("Listen")),
    status = element("p", { class: "heard-status", role: "status" }),
    channels = element("div", { class: "heard" });
  const form = element(
    "form",
    { class: "live" },
    element("label", { for: "address" }, tr("or the address of a live source")),
    element("div", { class: "address" }, field, button),
    element(
      "small",
      { id: "address-hint" },
      tr(
        "udp://, tcp://, mqtt:// or opc.tcp:// with host and port. No password here: for a source with one, set password_env or password_file in an axis.toml.",
      ),
    ),
    status,
    channels,
  );
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    button.disabled = true;
    channels.replaceChildren();
    status.className = "heard-status";
    status.textContent = tr("listening for 3 s …");
    try {
      const answer = await listen(field.value);
      if (answer.usable) {
        location.assign(measuring(answer.address));
        return;
      }
      status.textContent = worded(answer.trouble);
      if (answer.heard.length) channels.append(heardTable(answer.heard));
    } catch (error) {
      status.textContent = reason(error);
    }
    status.className = "heard-status wrong";
    button.disabled = false;
  });
  return form;
}

/**
 * Name, unit, rate and newest value of each channel.
 *
 * @param {Heard[]} heard
 */
export function heardTable(heard) {
  const heads = [tr("Channel"), tr("Unit"), tr("Values per second"), tr("Newest value")];
  return element(
    "table",
    {},
    element("caption", {}, trn("{n} channel", "{n} channels", heard.length)),
    element("thead", {}, element("tr", {}, ...heads.map((head) => element("th", { scope: "col" }, head)))),
    element(
      "tbody",
      {},
      ...heard.map(({ name, unit, rate_hz: rate, newest }) =>
        element(
          "tr",
          {},
          element("th", { scope: "row" }, name),
          element("td", {}, unit),
          element("td", {}, plain(rate, 4)),
          element("td", {}, plain(newest, 6)),
        ),
      ),
    ),
  );
}
