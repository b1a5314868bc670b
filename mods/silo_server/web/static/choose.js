// SPDX-License-Identifier: LGPL-2.1-or-later
// The boxes of a bulk decision: "choose all", how many are chosen, and those that a filter or another page hides
// stay chosen, with what is typed in their rows.

import { _ } from "./words.js";

const all = document.getElementById("all");
const told = document.getElementById("count");
const form = document.getElementById("bulk");
const boxes = () => [...document.querySelectorAll('input[type="checkbox"][name="chosen"][form="bulk"]')];
const chosen = new Map(); // value → the other fields of its row: name → text
const fields = (box) => [...box.closest("tr").querySelectorAll('input[form="bulk"]:not([name="chosen"])')];
// A value is "name mark": the line or the part number, and what was seen of it.
const named = (value) => value.slice(0, value.lastIndexOf(" "));

function recount() {
  const found = boxes();
  for (const box of found) {
    if (box.checked) chosen.set(box.value, new Map(fields(box).map(({ name, value }) => [name, value])));
    else chosen.delete(box.value);
  }
  const shown = new Set(found.map((box) => box.value));
  const hidden = [...chosen.keys()].filter((value) => !shown.has(value));
  const here = chosen.size - hidden.length;
  all.checked = here > 0 && here === found.length;
  all.indeterminate = chosen.size > 0 && !all.checked;
  const rest = hidden.length ? _("%(chosen)s chosen, %(hidden)s of them not shown", { chosen: chosen.size, hidden: hidden.length }) : "";
  told.textContent = rest || (here ? _("%(here)s of %(found)s chosen", { here, found: found.length }) : "");
  for (const input of form.querySelectorAll("[data-hidden]")) input.remove();
  for (const [name, value] of hidden.flatMap((value) => [["chosen", value], ...chosen.get(value)])) {
    const input = document.createElement("input");
    Object.assign(input, { type: "hidden", name, value });
    input.dataset.hidden = "";
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
  document.addEventListener("change", (event) => event.target.form === form && event.target !== all && recount());
  // Another view of the table has other boxes. What changed meanwhile has another mark, and has to be chosen anew.
  document.addEventListener("shown", () => {
    const now = new Map(boxes().map((box) => [named(box.value), box]));
    for (const [value, texts] of [...chosen]) {
      const box = now.get(named(value));
      if (box?.value === value) {
        box.checked = true;
        for (const input of fields(box)) input.value = texts.get(input.name) ?? input.value;
      } else if (box) chosen.delete(value);
    }
    recount();
  });
  recount();
}
