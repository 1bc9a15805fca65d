// @ts-check
// The token is sent once, in the body of a POST; the answer is a cookie that scripts cannot read.
import { tr } from "./language.js";
import { refusal } from "./link.js";
import { byId } from "./make.js";
import { applyTheme } from "./theme.js";

applyTheme();
const token = byId("token", HTMLInputElement);
byId("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const answer = await fetch("/login", {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({ token: token.value }),
  }).catch(() => null);
  token.value = "";
  if (answer?.ok) location.replace("/");
  else byId("wrong").textContent = answer ? (await refusal(answer)).message : tr("The server does not answer.");
});
// Before this script runs, the browser would send the form to this page itself, and nobody sees whether it is right.
byId("log-in", HTMLButtonElement).disabled = false;
