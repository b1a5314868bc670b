// SPDX-License-Identifier: LGPL-2.1-or-later
// A part number as one segment of an address, as silo/bom/items/part_address.py writes it.

const words = new Set(["by-uuid", "search", "export.csv", "import", "new"]);

export function partSegment(number) {
  if (/^\.+$/.test(number)) return "~2E".repeat(number.length);
  const escaped = encodeURIComponent(number.replaceAll("~", "~7E").replaceAll("/", "~2F"));
  return words.has(number.toLowerCase()) ? `~_${escaped}` : escaped;
}
