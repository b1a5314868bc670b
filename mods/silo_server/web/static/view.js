// SPDX-License-Identifier: LGPL-2.1-or-later
// A table whose view is in the address: sorting, opening, paging and filtering fetch the same page and replace
// only the table (#shown). Without this script the links and the form do the same.

import { afterTyping } from "./typing.js";
import { _ } from "./words.js";

const form = document.getElementById("view");
const here = () => location.pathname + location.search;
let address = here();
let request = null;

// A form that somebody may have typed into is not replaced; the link or the button then loads the page.
const typing = () => document.querySelector("#shown form[method=post]") !== null;

async function show(url, push) {
  if (request) request.abort();
  request = new AbortController();
  const shown = document.getElementById("shown");
  shown.setAttribute("aria-busy", "true");
  const focus = document.activeElement?.id;
  try {
    const answer = await fetch(url, { signal: request.signal });
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const fresh = page.getElementById("shown");
    if (!fresh) return location.assign(url); // logged out meanwhile, or the server says why not
    const other = document.activeElement?.id;
    shown.replaceWith(fresh);
    const found = page.getElementById("found");
    if (found) document.getElementById("found").replaceChildren(...found.childNodes);
    // The link that was used is another element now.
    if (other === focus && focus) document.getElementById(focus)?.focus({ preventScroll: true });
    if (new URL(url, location).searchParams.get("beside") && !new URL(address, location).searchParams.get("beside")) document.getElementById("beside")?.focus();
    if (push) history[push]({ view: true }, "", url);
    address = here();
    document.dispatchEvent(new CustomEvent("shown"));
  } catch (error) {
    shown.removeAttribute("aria-busy");
    // Without the server the form's button still says what is wrong.
    if (error.name !== "AbortError") document.getElementById("found").textContent = _("The server cannot be reached.");
  }
}

function asked() {
  const query = new URLSearchParams();
  for (const [name, value] of new FormData(form)) if (value) query.append(name, value);
  const words = query.toString();
  return form.getAttribute("action") + (words ? `?${words}` : "");
}

document.addEventListener("click", (event) => {
  const link = event.target.closest("a[data-view]");
  if (!link || typing() || event.button || event.ctrlKey || event.metaKey || event.shiftKey || event.altKey) return;
  event.preventDefault();
  const paging = link.rel === "prev" || link.rel === "next";
  show(link.href, "pushState").then(() => paging && document.getElementById("shown").scrollIntoView());
});

addEventListener("keydown", (event) => event.key === "Escape" && document.querySelector("a[data-close]")?.click());

if (form) {
  for (const input of form.querySelectorAll('input[type="search"], input[inputmode]')) {
    afterTyping(input, () => !typing() && input.checkValidity() && show(asked(), "replaceState"));
  }
  for (const choice of form.querySelectorAll("select, input[type=checkbox]")) {
    choice.addEventListener("change", () => !typing() && show(asked(), "replaceState"));
  }
  form.addEventListener("submit", (event) => {
    if (typing()) return;
    event.preventDefault();
    show(asked(), "replaceState");
  });
}

// Back and forward: the whole page, with its form as it was then. A link to a place on this page comes here as
// well; it must not throw away what somebody is typing.
addEventListener("popstate", () => here() !== address && location.reload());
