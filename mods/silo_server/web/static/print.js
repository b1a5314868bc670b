// SPDX-License-Identifier: LGPL-2.1-or-later
// A button for the browser's own print dialog.

const button = document.getElementById("print");
button.hidden = false;
button.addEventListener("click", () => print());
