// SPDX-License-Identifier: LGPL-2.1-or-later
// Waits for a short pause in somebody's typing.

const PAUSE = 150;

export function afterTyping(input, act) {
  let timer = 0;
  input.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(act, PAUSE);
  });
}
