// SPDX-License-Identifier: LGPL-2.1-or-later
// The activity page, live: an event says that there is news, the server's own page brings it.

import { listen } from "./live.js";
import { root } from "./root.js";
import { _ } from "./words.js";

const MOST = 300;
const list = document.getElementById("entries");
const state = document.getElementById("state");
const names = list.dataset.names.split(" ");
let busy = false;
let again = false;

async function refresh() {
  again = busy;
  if (busy) return;
  busy = true;
  try {
    const query = new URLSearchParams(location.search);
    query.set("newer_than", parseInt(list.dataset.last, 10));
    const answer = await fetch(`${root}/activity?${query}`);
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const fresh = page.getElementById("entries");
    if (!fresh) return location.reload(); // logged out meanwhile
    list.dataset.last = fresh.dataset.last;
    for (const entry of fresh.children) entry.classList.add("new");
    list.prepend(...fresh.children);
    while (list.children.length > MOST) list.lastElementChild.remove();
    document.getElementById("empty")?.remove();
  } catch {
    state.textContent = _("The server cannot be reached.");
  } finally {
    busy = false;
    if (again) refresh();
  }
}

listen(`${root}/api/events`, list.dataset.last, names, refresh, (live) => {
  state.textContent = live ? _("Live: new entries appear by themselves.") : _("Not connected; trying again.");
  state.classList.toggle("on", live);
});
