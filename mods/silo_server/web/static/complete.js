// SPDX-License-Identifier: LGPL-2.1-or-later
// Offers the part numbers that fit what is typed, in the input's own list.

import { root } from "./root.js";
import { afterTyping } from "./typing.js";

export function complete(input) {
  const list = input.list;
  let request = null;
  afterTyping(input, async () => {
    if (request) request.abort();
    request = new AbortController();
    const query = encodeURIComponent(input.value.trim());
    if (!query) return;
    try {
      const answer = await fetch(`${root}/api/items/search?q=${query}&limit=12`, { signal: request.signal });
      if (!answer.ok) return;
      const items = await answer.json();
      list.replaceChildren(
        ...items.map((item) => {
          const option = document.createElement("option");
          option.value = item.part_number;
          option.textContent = item.name;
          return option;
        }),
      );
    } catch (error) {
      if (error.name !== "AbortError") list.replaceChildren();
    }
  });
}
