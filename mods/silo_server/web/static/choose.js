// SPDX-License-Identifier: LGPL-2.1-or-later
// "Choose all" for the boxes of a bulk decision, and how many are chosen.

const all = document.getElementById("all");
const told = document.getElementById("count");
const boxes = () => [...document.querySelectorAll('input[name="chosen"][form="bulk"]')];

function recount() {
  const found = boxes();
  const chosen = found.filter((box) => box.checked).length;
  all.checked = chosen > 0 && chosen === found.length;
  all.indeterminate = chosen > 0 && chosen < found.length;
  told.textContent = chosen ? `${chosen} of ${found.length} chosen` : "";
}

if (all) {
  all.closest("label").hidden = false;
  all.addEventListener("change", () => {
    for (const box of boxes()) box.checked = all.checked;
    recount();
  });
  document.addEventListener("change", (event) => event.target.name === "chosen" && recount());
  document.addEventListener("shown", recount); // another view of the table has other boxes
  recount();
}
