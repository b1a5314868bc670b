// SPDX-License-Identifier: LGPL-2.1-or-later
// A table of inputs as in a spreadsheet: arrow keys lead from cell to cell, cells are pasted, a paste is undone.

const table = document.querySelector("[data-grid]");
const rows = () => [...table.tBodies[0].rows];
const cells = (row) => [...row.querySelectorAll("input")];
const count = document.querySelector("[data-rows]");
let before = null; // the texts before the last paste, until somebody types

function place(input) {
  const row = input.closest("tr");
  return [rows().indexOf(row), cells(row).indexOf(input)];
}

function add() {
  const row = rows().at(-1).cloneNode(true);
  const number = rows().length;
  for (const input of cells(row)) {
    input.name = input.name.replace(/\.\d+$/, `.${number}`);
    input.setAttribute("aria-label", input.getAttribute("aria-label").replace(/\d+$/, number + 1));
    input.value = input.defaultValue = "";
  }
  table.tBodies[0].append(row);
  count.value = number + 1;
}

// What a spreadsheet puts on the clipboard: tabs and lines; a cell with either of them stands in quotes.
function parsed(text) {
  const found = [[]];
  for (const [, quoted, plain, end] of text.matchAll(/(?:"((?:[^"]|"")*)"(?=[\t\r\n]|$)|([^\t\r\n]*))(\t|\r?\n|$)/g)) {
    if (end === "" && quoted === undefined && plain === "" && found.at(-1).length === 0) break;
    found.at(-1).push((quoted?.replaceAll('""', '"') ?? plain).replace(/\s*[\r\n]+\s*/g, "; ").trim());
    if (end === "") break;
    if (end !== "\t") found.push([]);
  }
  return found.filter((line) => line.length);
}

table.addEventListener("paste", (event) => {
  const text = event.clipboardData.getData("text/plain");
  if (event.target.readOnly || !/[\t\n]/.test(text.trimEnd())) return;
  event.preventDefault();
  const [top, left] = place(event.target);
  const lines = parsed(text).slice(0, Number(table.dataset.grid) - top);
  before = rows().map((row) => cells(row).map((input) => input.value));
  while (rows().length < top + lines.length) add();
  lines.forEach((line, down) => {
    const inputs = cells(rows()[top + down]);
    line.forEach((value, right) => inputs[left + right] && (inputs[left + right].value = value));
  });
});

table.addEventListener("input", () => (before = null));

table.addEventListener("keydown", (event) => {
  const { target, key } = event;
  if (key === "z" && (event.ctrlKey || event.metaKey) && before) {
    event.preventDefault();
    rows().forEach((row, down) => cells(row).forEach((input, right) => (input.value = before[down]?.[right] ?? "")));
    before = null;
    return;
  }
  if (event.ctrlKey || event.altKey || event.metaKey || event.shiftKey || target.tagName !== "INPUT") return;
  const { selectionStart, selectionEnd, value } = target;
  const whole = selectionStart === 0 && selectionEnd === value.length;
  const step = { ArrowUp: [-1, 0], ArrowDown: [1, 0], Enter: [1, 0] }[key];
  const side = { ArrowLeft: whole || !selectionEnd ? [0, -1] : null, ArrowRight: whole || selectionStart === value.length ? [0, 1] : null }[key];
  const [down, right] = step ?? side ?? [0, 0];
  if (!down && !right) return;
  event.preventDefault();
  const [row, column] = place(target);
  if (row + down === rows().length && rows().length < Number(table.dataset.grid) && !target.readOnly) add();
  const next = rows()[row + down] && cells(rows()[row + down])[column + right];
  next?.focus();
  next?.select();
});
