// SPDX-License-Identifier: LGPL-2.1-or-later
// The texts of scripts in the language of the page, which brings them along; what it does not bring is English.

export const words = JSON.parse(document.getElementById("words")?.textContent ?? "{}");

export function _(text, values = {}) {
  return (words[text] ?? text).replace(/%\((\w+)\)s/g, (_all, name) => values[name]);
}
