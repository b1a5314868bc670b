// SPDX-License-Identifier: LGPL-2.1-or-later
// The model on a page: shows the scene of an item in the viewer, and ties the rows of the page to it, both ways. With
// another state to compare with, colours are what differs, and a person can go through the differences or the questions.

import { partSegment } from "./part_address.js";
import { root } from "./root.js";
import { _, words as translations } from "./words.js";

const place = document.getElementById("model");
const { item, now, before, secret } = place.dataset;
const address = `${root}/api/items/${partSegment(item)}`;
const stage = place.querySelector(".stage");
const legend = place.querySelector(".legend");
const PLAIN = "#c3c9d0";
const PALE = "#f0d3a0"; // of a changed quantity: those that were there before
// Their names: _("added") _("removed") _("quantity changed") _("moved")
const KINDS = { added: "#1a9850", removed: "#d73027", "quantity changed": "#f5a623", moved: "#7b5cd6" };
const SERIES = ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#b07aa1", "#76b7b2", "#edc948", "#9c755f"];
const HEAVY = ["#fde0a0", "#fdae61", "#f46d43", "#d73027", "#7f0000"];
const LOADED_AT_ONCE = 6;
const PICTURES = 100; // of one look at a page
const PIXELS = 256;

let viewer = null;
let shown = []; // the occurrences, of both states
let lit = new Set();
const below = new Map(); // the part numbers of a row's branch, or "any" and a part → its occurrences

const key = (words) => words.join("\n");
const rows = (one) => one.lines.filter(Boolean); // what is no item has no row
const line = (one) => key([...rows(one), one.part_number ? "" : one.label]);
const title = (one) => `${one.part_number} ${one.label}`.trim();
const bodies = (list) => [...list].map((one) => one.body).filter(Boolean);
const grouped = (list, name) => {
  const groups = new Map();
  for (const one of list) groups.get(name(one))?.push(one) ?? groups.set(name(one), [one]);
  return groups;
};

async function json(url) {
  const answer = await fetch(url);
  return answer.ok ? answer.json() : null;
}

function script(name) {
  return new Promise((onload, onerror) => {
    document.head.append(Object.assign(document.createElement("script"), { src: `${root}/static/${name}`, onload, onerror }));
  });
}

// ---- what differs between two states
function paired(olds, news, name) {
  const waiting = grouped(news, name);
  const rest = [];
  for (const one of olds) {
    const match = waiting.get(name(one))?.shift();
    if (match) match.was = one;
    else rest.push(one);
  }
  return [rest, [...waiting.values()].flat()];
}

const placed = (one) => one.matrix.map((value) => Math.round(value * 1e6)).join();

function differing(old, fresh) {
  // The same object; the same line at the same place under another name; what is left of the same line was moved.
  let left = [old, fresh];
  for (const name of [(one) => key([...one.path, one.part_number]), (one) => line(one) + placed(one), line]) left = paired(...left, name);
  const [had, has] = [grouped(old, line), grouped(fresh, line)];
  const result = [...fresh];
  for (const one of fresh) {
    const before = had.get(line(one))?.length ?? 0;
    one.moved = one.was && placed(one) !== placed(one.was);
    one.extra = !one.was;
    one.kind = before && before !== has.get(line(one)).length ? "quantity changed" : one.extra ? "added" : one.moved ? "moved" : "";
    if (one.extra || one.moved) one.side = 1;
    if (one.moved) result.push(Object.assign(one.was, { kind: one.kind, side: -1, now: one }));
  }
  for (const one of left[0]) result.push(Object.assign(one, { kind: "removed", side: -1 }));
  for (const one of result) one.counts = [had, has].map((counts) => counts.get(line(one))?.length ?? 0);
  return result;
}

function differences() {
  const groups = grouped(shown.filter((one) => one.kind), (one) => `${one.kind} ${one.kind === "moved" ? one.path[0] : line(one)}`);
  return [...groups.values()].map(([first, ...others]) => {
    const { kind, counts } = first;
    const group = [first, ...others];
    const extra = group.filter((one) => one.extra);
    const words = kind === "quantity changed" ? `: ${_("%(old)s before, %(now)s now", { old: counts[0], now: counts[1] })}` : "";
    return { words: `${_(kind)}: ${title(first)}${words}`, list: kind === "quantity changed" && extra.length ? extra : group };
  });
}

// ---- rows of the page
function paths() {
  const found = [];
  let above = [...document.querySelectorAll("#shown tr.trail bdi")].map((part) => part.textContent);
  for (const row of document.querySelectorAll("[data-part]")) {
    const { part, level } = row.dataset;
    if (level) above = [...above.slice(0, level - 1), part];
    const list = below.get(level ? key(above) : `any ${part}`);
    if (list) found.push([row, list]);
  }
  return found;
}

function tie() {
  for (const [row, list] of paths()) {
    if (row.querySelector(".spot")) continue;
    const button = Viewer.make("button", "◉", { type: "button", class: "spot", "aria-pressed": "false", "aria-label": _("Show %(part)s in the model", { part: row.dataset.part }) });
    button.addEventListener("click", (event) => {
      const on = button.getAttribute("aria-pressed") === "true";
      choose(on ? [] : list, event.ctrlKey || event.shiftKey, row.dataset.question !== undefined);
      const [first] = list;
      const count = _("%(count)s in the model", { count: list.length });
      viewer.say(on ? "" : `${level(row, first)}: ${row.dataset.question ? `${row.dataset.question}; ${count}` : count}`);
    });
    (row.querySelector("th") ?? row.querySelector("span")).append(button);
  }
  mark();
}

const level = (row, one) => (rows(one).at(-1) === row.dataset.part ? title(one) : row.dataset.part);

function mark() {
  for (const [row, list] of paths()) {
    const on = lit.size > 0 && list.every((one) => lit.has(one));
    row.classList.toggle("lit", on);
    row.querySelector(".spot")?.setAttribute("aria-pressed", on);
  }
}

function choose(list, add, look = false) {
  lit = new Set(add ? [...lit, ...list] : list);
  viewer.light(bodies(lit), look);
  mark();
}

function picked(body, add) {
  choose(body ? [body.of] : [], add);
  if (!body) return viewer.say("");
  viewer.say([title(body.of), body.of.kind && _(body.of.kind), body.of.path.join(" › ")].filter(Boolean).join(" · "));
  // The row itself, or the closed branch that it is in.
  const among = paths().filter(([, list]) => list.includes(body.of)).sort(([, one], [, two]) => one.length - two.length);
  const [row] = among[0] ?? [];
  row?.classList.add("lit");
  row?.querySelector(".spot").setAttribute("aria-pressed", true);
  row?.scrollIntoView({ block: "nearest" });
}

// ---- colours
function entry(words, colour, list) {
  const button = Viewer.make("button", undefined, { type: "button" });
  const swatch = Viewer.make("span", undefined, { class: "swatch" });
  swatch.style.background = colour;
  button.append(swatch, `${words} (${list.filter((one) => !one.now).length})`);
  button.addEventListener("click", () => choose(list, false));
  return button;
}

function paint(groups) {
  for (const { colour, list } of groups) for (const one of list) one.paint ??= colour;
  for (const one of shown) if (one.body) one.body.paint = one.paint ?? null;
  legend.replaceChildren(...legend.querySelectorAll("label"), ...groups.map(({ words, colour, list }) => entry(words, colour, list)));
  viewer.dress();
}

// What the BOM says of each occurrence: its own line, and whether something on the way to it is open or incomplete.
async function facts() {
  const { lines } = await json(`${address}/bom/export.json?view=indented`);
  const known = new Map();
  let above = [];
  for (const row of lines) {
    above = [...above.slice(0, row.level - 1), row.part_number];
    known.set(key(above), row);
  }
  for (const one of shown) {
    const way = rows(one).map((_, n, all) => known.get(key(all.slice(0, n + 1)))).filter(Boolean);
    one.facts = { ...(way.length === rows(one).length ? way.at(-1) : {}) };
    one.facts.open = way.some((row) => row.open || row.unreferenced_since);
    one.facts.incomplete = way.some((row) => row.incomplete);
  }
}

const COLOURS = {
  [_("as in CAD")]: () => [],
  [_("by state")]: () => {
    const states = [[_("question open"), "#d73027"], [_("incomplete"), "#f5a623"], [_("mass unknown"), "#b07aa1"], [_("bought"), "#4e79a7"], [_("made"), "#59a14f"]];
    const of = ({ facts }) => (facts.open ? 0 : facts.incomplete ? 1 : facts.unit_mass_kg == null ? 2 : facts.bought ? 3 : 4);
    const groups = grouped(shown, of);
    return states.map(([words, colour], n) => ({ words, colour, list: groups.get(n) ?? [] })).filter(({ list }) => list.length);
  },
  [_("by supplier")]: () => {
    const groups = [...grouped(shown, (one) => one.facts.supplier || "").entries()].sort(([a, one], [b, two]) => !a - !b || two.length - one.length);
    return groups.map(([words, list], n) => ({ words: words || _("no supplier"), colour: words ? SERIES[n % SERIES.length] : PLAIN, list }));
  },
  [_("by mass")]: () => {
    const heavy = (one) => (one.facts.unit_mass_kg == null ? -1 : Math.min(4, Math.max(0, Math.floor(Math.log10(one.facts.unit_mass_kg) + 3))));
    const groups = grouped(shown, heavy);
    const words = [_("up to 10 g"), _("10 to 100 g"), _("100 g to 1 kg"), _("1 to 10 kg"), _("over 10 kg")];
    return [-1, 0, 1, 2, 3, 4].filter((n) => groups.has(n)).map((n) => ({ words: words[n] ?? _("mass unknown"), colour: HEAVY[n] ?? PLAIN, list: groups.get(n) }));
  },
};

function colours() {
  const label = Viewer.make("label", `${_("Colours")} `);
  const select = Viewer.make("select");
  select.append(...Object.keys(COLOURS).map((words) => Viewer.make("option", words)));
  label.append(select);
  legend.append(label);
  select.addEventListener("change", async () => {
    if (!shown[0].facts) await facts();
    for (const one of shown) one.paint = null;
    paint(COLOURS[select.value]());
  });
}

// ---- the scene and its files
async function load({ id, url }) {
  const answer = await fetch(root + url);
  const { scene } = await new THREE.GLTFLoader().parseAsync(await answer.arrayBuffer(), "");
  scene.updateMatrixWorld(true);
  const products = new Map();
  for (const node of scene.children) {
    const pieces = [];
    node.traverse(({ isMesh, geometry, material, matrixWorld }) => {
      if (isMesh) pieces.push({ geometry, matrix: matrixWorld, colour: material.color, opacity: material.opacity });
    });
    products.set(node.userData.key, pieces);
  }
  for (const one of shown) {
    if (one.file !== id) continue;
    const placing = new THREE.Matrix4().fromArray(one.matrix);
    const [r, g, b, a] = one.color ?? [];
    const own = one.color ? { colour: new THREE.Color().setRGB(r, g, b, "srgb"), opacity: a } : {};
    const pieces = (products.get(one.key) ?? []).map((piece) => ({ ...piece, matrix: placing.clone().multiply(piece.matrix), ...own }));
    if (!pieces.length) continue;
    one.body = viewer.add(one, pieces, one.side);
    one.body.paint = one.paint ?? null;
    one.body.ghost = one.side === -1;
    if (one.moved) one.body.outline = KINDS.moved;
  }
  viewer.light(bodies(lit));
  if (!viewer.touched) viewer.fit();
}

function missing(list) {
  const gone = place.querySelector(".gone");
  gone.hidden = !list.length;
  gone.firstElementChild.textContent = _("%(count)s not in this picture", { count: list.length });
  gone.lastElementChild.append(...list.map((one) => Viewer.make("li", `${title(one)}: ${one.why}`)));
}

// Items without a picture get what is drawn of them here, if whoever looks may change them.
async function portray({ without_picture: numbers, missing }) {
  for (const number of numbers.slice(0, PICTURES)) {
    const each = shown.filter((one) => number === item || one.lines.includes(number));
    const first = each.find((one) => !one.color) ?? each[0];
    const branch = ({ path }) => key(path.slice(0, first.lines.indexOf(number) + 1)); // of the product itself: nothing
    const list = each.filter((one) => branch(one) === branch(first));
    if ((first.part_number !== number && missing.length) || list.some((one) => !one.body)) continue;
    const body = await viewer.picture(bodies(list), PIXELS);
    const headers = { "Content-Type": "image/png", "X-CSRF-Token": secret };
    const answer = await fetch(`${root}/api/items/${partSegment(number)}/thumbnail`, { method: "PUT", headers, body });
    if (!answer.ok && answer.status !== 409) return; // 409: somebody else was quicker
  }
}

async function start() {
  const scenes = await Promise.all([before, now].map((revision) => (revision === undefined ? null : json(`${address}/scene${revision && `?revision=${revision}`}`))));
  const [old, fresh] = scenes.map((scene) => {
    for (const one of scene?.occurrences ?? []) one.file = scene.geometries[one.geometry]?.id;
    return scene?.occurrences ?? [];
  });
  if (!fresh.length && !old.length) return;
  place.hidden = false;
  try {
    await script("three.min.js");
    await script("viewer.js");
    Viewer.words = translations;
    viewer = new Viewer(stage, picked);
  } catch {
    stage.append(_("This browser shows no 3D (WebGL). The tables have everything else."));
    return;
  }
  shown = old.length ? differing(old, fresh) : fresh;
  for (const one of shown) {
    const numbers = rows(one);
    const names = numbers.map((_, n) => key(numbers.slice(0, n + 1)));
    for (const name of new Set([...names, ...numbers.map((number) => `any ${number}`)])) below.get(name)?.push(one) ?? below.set(name, [one]);
  }
  if (old.length) {
    viewer.sides.hidden = false;
    for (const one of shown) if (!one.kind || (one.kind === "quantity changed" && !one.extra)) one.paint = one.kind ? PALE : PLAIN;
    paint(Object.entries(KINDS).map(([kind, colour]) => ({ words: _(kind), colour, list: shown.filter((one) => one.kind === kind) })).filter(({ list }) => list.length));
  } else colours();
  tie();
  document.addEventListener("shown", tie);
  const questions = paths().filter(([row]) => row.dataset.question !== undefined).map(([row, list]) => ({ list, words: `${level(row, list[0])}: ${row.dataset.question}` }));
  const steps = questions.length ? questions : old.length ? differences() : [];
  viewer.follow(steps, (step) => choose(step.list, false, true));
  const files = new Map(scenes.flatMap((scene) => scene?.geometries ?? []).map((file) => [file.id, file]));
  const queue = [...files.values()].sort((one, two) => one.bytes - two.bytes);
  const work = async () => {
    for (let file = queue.shift(); file; file = queue.shift()) await load(file).catch((error) => console.warn(file.url, error));
  };
  await Promise.all(Array.from({ length: LOADED_AT_ONCE }, work));
  const undrawn = grouped(shown.filter((one) => !one.body), title);
  const known = new Set(scenes[1]?.missing.map(title));
  missing([...(scenes[1]?.missing ?? []), ...[...undrawn].filter(([name]) => !known.has(name)).map(([, [one]]) => ({ ...one, why: _("its file has no geometry yet") }))]);
  if (location.hash === "#model") {
    place.scrollIntoView();
    viewer.go(1);
  }
  place.dataset.ready = viewer.bodies.length;
  if (secret) await portray(scenes[1]);
}

start();
