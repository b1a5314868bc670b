// SPDX-License-Identifier: LGPL-2.1-or-later
// The merge page: says when the BOM changed meanwhile, completes part numbers.

import { complete } from "./complete.js";
import { listen } from "./live.js";
import { _ } from "./words.js";

const place = document.getElementById("live");
let count = 0;

// The lines stay where they are: a table that jumps under the pointer makes people press the wrong button.
function announce(name, data) {
  const told = name === "reset" ? {} : JSON.parse(data);
  if (name === "server.state") {
    show(told.mode === "normal" ? _("The server takes changes again.") : _("The server takes no changes now."));
    return;
  }
  count += 1;
  const what = name === "bom_merge" ? _("A new merge arrived") : _("The BOM changed");
  const detail = told.summary ? `: ${told.summary}` : "";
  const who = told.user ? ` (${told.user})` : "";
  show(`${what}${detail}${who}.${count > 1 ? ` ${_("%(count)s changes since you opened this page.", { count })}` : ""}`);
}

function show(sentence) {
  const words = document.createElement("span");
  words.textContent = sentence;
  const link = document.createElement("a");
  link.href = location.pathname + location.search.replace(/([?&])edit=[^&]*&?/, "$1");
  link.className = "button small";
  link.textContent = _("Show it");
  place.replaceChildren(words, " ", link);
  place.classList.add("news");
}

listen(place.dataset.events, place.dataset.last, ["bom_merge", "bom.updated", "server.state"], announce);

for (const input of document.querySelectorAll("[data-complete]")) complete(input);
