// SPDX-License-Identifier: LGPL-2.1-or-later
// Search as you type: the server's own page for the words, of which only the results are shown.

import { root } from "./root.js";
import { afterTyping } from "./typing.js";

const form = document.getElementById("search");
let request = null;

async function search() {
  if (request) request.abort();
  request = new AbortController();
  const query = new URLSearchParams(new FormData(form));
  const url = `${root}/items?${query}`;
  try {
    const answer = await fetch(url, { signal: request.signal });
    const found = new DOMParser().parseFromString(await answer.text(), "text/html");
    const results = found.getElementById("results");
    if (!results) return location.assign(url); // logged out meanwhile, or the server says why not
    document.getElementById("results").replaceChildren(...results.childNodes);
    document.getElementById("found").textContent = found.getElementById("found").textContent;
    history.replaceState(null, "", url);
  } catch (error) {
    // Without the server the form's button still says what is wrong.
    if (error.name !== "AbortError") document.getElementById("found").textContent = "The server cannot be reached.";
  }
}

afterTyping(form.elements.q, search);
form.elements.type.addEventListener("change", search);
