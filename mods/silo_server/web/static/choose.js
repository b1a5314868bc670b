// SPDX-License-Identifier: LGPL-2.1-or-later
// The boxes of a bulk decision: "choose all", how many are chosen, and those that a filter hides stay chosen.

import { _ } from "./words.js";

const all = document.getElementById("all");
const told = document.getElementById("count");
const form = document.getElementById("bulk");
const boxes = () => [...document.querySelectorAll('input[type="checkbox"][name="chosen"][form="bulk"]')];
const chosen = new Set();
// A value is "name mark": the line or the part number, and what was seen of it.
const named = (value) => value.slice(0, value.lastIndexOf(" "));

function recount() {
  const found = boxes();
  for (const box of found) box.checked ? chosen.add(box.value) : chosen.delete(box.value);
  const shown = new Set(found.map((box) => box.value));
  const hidden = [...chosen].filter((value) => !shown.has(value));
  const here = chosen.size - hidden.length;
  all.checked = here > 0 && here === found.length;
  all.indeterminate = chosen.size > 0 && !all.checked;
  const rest = hidden.length ? _("%(chosen)s chosen, %(hidden)s of them not shown", { chosen: chosen.size, hidden: hidden.length }) : "";
  told.textContent = rest || (here ? _("%(here)s of %(found)s chosen", { here, found: found.length }) : "");
  for (const input of form.querySelectorAll("input[type=hidden][name=chosen]")) input.remove();
  for (const value of hidden) {
    const input = document.createElement("input");
    Object.assign(input, { type: "hidden", name: "chosen", value });
    form.append(input);
  }
}

if (all) {
  document.getElementById("scriptless")?.remove();
  all.closest("label").hidden = false;
  all.addEventListener("change", () => {
    for (const box of boxes()) box.checked = all.checked;
    if (!all.checked) chosen.clear();
    recount();
  });
  document.addEventListener("change", (event) => event.target.name === "chosen" && recount());
  // Another view of the table has other boxes. What changed meanwhile has another mark, and has to be chosen anew.
  document.addEventListener("shown", () => {
    const now = new Map(boxes().map((box) => [named(box.value), box]));
    for (const value of [...chosen]) {
      const box = now.get(named(value));
      if (box?.value === value) box.checked = true;
      else if (box) chosen.delete(value);
    }
    recount();
  });
  recount();
}
