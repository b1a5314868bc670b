// SPDX-License-Identifier: LGPL-2.1-or-later
// Opens or closes the whole tree at once.

for (const button of document.querySelectorAll("[data-open]")) {
  button.hidden = false;
  button.addEventListener("click", () => {
    for (const branch of document.querySelectorAll(".tree details")) branch.open = button.dataset.open === "yes";
  });
}
