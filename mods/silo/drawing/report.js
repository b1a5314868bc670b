"use strict";
// The report's tables and its 3D view. Everything from a file goes in as text, never as markup.
const data = JSON.parse(document.getElementById("data").textContent);
const by = (id) => document.getElementById(id);

const { make } = Viewer;

// columns: [title, key, numeric, format]; a click on a title sorts, numbers as numbers, empty cells last.
function table(element, columns, rows, sortable) {
  const head = element.createTHead().insertRow();
  const body = element.createTBody();
  const trs = rows.map((row) => {
    const tr = body.insertRow();
    if (row.doubt) tr.className = "doubt";
    for (const [, key, numeric, format] of columns) {
      const value = row[key];
      const td = make("td", value === null || value === undefined ? "" : format ? format(value) : value);
      if (numeric) td.className = "n";
      tr.append(td);
    }
    return tr;
  });
  columns.forEach(([title, key, numeric], place) => {
    const th = make("th", undefined, { scope: "col" });
    if (numeric) th.className = "n";
    if (!sortable) th.textContent = title;
    else {
      const button = make("button", title, { type: "button" });
      button.addEventListener("click", () => sort(place, key, numeric));
      th.append(button);
    }
    head.append(th);
  });
  function sort(place, key, numeric) {
    const ths = [...head.cells];
    const down = ths[place].getAttribute("aria-sort") === "ascending";
    ths.forEach((th) => th.removeAttribute("aria-sort"));
    ths[place].setAttribute("aria-sort", down ? "descending" : "ascending");
    const empty = (v) => v === null || v === undefined || v === "";
    const order = rows.map((_, i) => i).sort((i, j) => {
      const a = rows[i][key], b = rows[j][key];
      if (empty(a) || empty(b)) return empty(a) - empty(b) || i - j;
      const by = numeric ? a - b : String(a).localeCompare(String(b), undefined, { numeric: true });
      return (down ? -by : by) || i - j;
    });
    body.append(...order.map((i) => trs[i]));
  }
  return trs;
}

const digits = (n) => (value) => Number(value.toPrecision(n)).toString();
const kilograms = (value) => (value > 0 && value < 1 ? digits(4)(value * 1e3) + " g" : digits(5)(value) + " kg");
const vector = (values) => values.map((v) => (v === null ? "not finite" : digits(5)(v))).join("  ");

document.title = by("title").textContent = "Mass properties of " + data.name;
by("sum").textContent = data.sum;
by("facts").textContent = data.facts.join(" · ");

// ---- tables
const whole = data.sources.reduce((sum, one) => sum + one.mass, 0);
for (const one of data.sources) {
  if (one.mass > 0) {
    const piece = make("span", "", { title: `${one.name}: ${kilograms(one.mass)}` });
    piece.style.cssText = `width:${(100 * one.mass) / whole}%;background:${one.colour}`;
    by("bar").append(piece);
  }
}
const sourceRows = table(by("sources"), [
  ["Source", "name"], ["Mass", "mass", true, kilograms],
  ["Share", "mass", true, (m) => (whole > 0 ? ((100 * m) / whole).toFixed(1) + " %" : "")], ["Pieces", "pieces", true],
], data.sources);
sourceRows.forEach((tr, i) => {
  const swatch = make("span", "", { class: "swatch" });
  swatch.style.cssText = `background:${data.sources[i].colour};display:inline-block;margin-right:.5rem`;
  tr.cells[0].prepend(swatch);
});

if (!data.warnings.length) by("warnings").append(make("p", "No warnings.", { class: "good" }));
data.warnings.forEach((group, i) => {
  const details = make("details");
  details.open = i === 0;
  const summary = make("summary");
  summary.append(make("span", group.title, { class: "code" }), make("span", ` × ${group.items.length}`));
  if (group.mass > 0) summary.append(make("span", `, about ${kilograms(group.mass)}`, { class: "far" }));
  const list = make("ul");
  for (const item of group.items) {
    const line = make("li");
    if (item.where) line.append(make("strong", item.where + ": "));
    line.append(item.message);
    list.append(line);
  }
  details.append(summary, list);
  by("warnings").append(details);
});

table(by("links"), [
  ["Link", "name"], ["Mass kg", "mass", true, digits(6)], ["Centre of mass m", "com", true, vector],
  ["Ixx Iyy Izz kg m²", "moments", true, vector], ["Ixy Ixz Iyz kg m²", "products", true, vector],
  ["Pieces", "pieces", true], ["Frame", "frame"], ["Problems", "problems"],
], data.links);

const partRows = table(by("parts"), [
  ["Link", "link"], ["Part", "name"], ["Part number", "number"], ["Qty", "quantity", true],
  ["Mass kg", "mass", true, digits(5)], ["Total kg", "total", true, digits(5)],
  ["Volume cm³", "volume", true, digits(5)], ["Density kg/m³", "density", true, digits(4)],
  ["Material", "material"], ["Source", "source"], ["Matched", "matched"], ["Warnings", "warnings", true],
], data.parts, true);
by("filter").addEventListener("input", filter);
function filter() {
  const words = by("filter").value.toLocaleLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  partRows.forEach((tr) => {
    const [link, ...cells] = tr.cells;
    const name = link.querySelector("select")?.selectedOptions[0]?.textContent ?? link.textContent;
    const text = [name, ...cells.map((cell) => cell.textContent)].join(" ").toLocaleLowerCase();
    tr.hidden = !words.every((word) => text.includes(word));
    shown += !tr.hidden;
  });
  by("shown").textContent = `${shown} of ${partRows.length} lines`;
}
filter();

// ---- the link map: which link has which part, by path
const drafts = data.views.map((view) => ({ name: view.name, colour: view.colour }));
const COLOURS = ["#4e79a7", "#f28e2b", "#59a14f", "#e15759", "#b07aa1", "#76b7b2", "#edc948", "#9c755f"];
const owners = new Map();
data.parts.forEach((part) => {
  let link = drafts.findIndex((draft) => (draft.name || "(no link)") === part.link);
  if (link < 0) link = drafts.push({ name: "", colour: "#888888" }) - 1;
  for (const path of part.paths) owners.set(path, { link, mass: part.mass });
});
let chosen = 0;
const selects = partRows.map((tr, row) => {
  const select = make("select", undefined, { "aria-label": "Link of " + data.parts[row].name });
  select.addEventListener("change", () => give(data.parts[row].paths, Number(select.value)));
  tr.cells[0].replaceChildren(select);
  return select;
});

const past = []; // what undo takes back: { moves: [path, link before][], draft, name before }
function give(paths, link, draft, name) {
  past.push({ moves: paths.map((path) => [path, owners.get(path).link]), draft, name });
  move(paths.map((path) => [path, link]));
}

// The marks of a link hold for the parts that it came with.
function move(moves) {
  for (const [path, link] of moves) {
    const owner = owners.get(path);
    if (owner.link !== link) drafts[owner.link].changed = drafts[link].changed = true;
    owner.link = link;
  }
  for (const body of viewer?.bodies ?? []) body.paint = drafts[owners.get(body.of.path).link].colour;
  refresh();
  if (viewer) show();
  viewer?.dress();
}

const pathsOf = (link) => [...owners].filter(([, owner]) => owner.link === link).map(([path]) => path);
const twin = (draft) => drafts.findIndex((other) => other !== draft && other.name === draft.name);

// A name that another link has makes the two one link.
function rename(draft, name) {
  const before = draft.name;
  draft.name = name;
  const other = twin(draft), i = drafts.indexOf(draft);
  if (other < 0) return refresh();
  if (chosen === i) chosen = other;
  give(pathsOf(i), other, draft, before);
}

// The line stays the same element: a click that ends the typing of a name elsewhere must still hit it.
function lineOf(draft, i) {
  const row = make("div", undefined, { class: "draft" });
  const box = make("input", undefined, { type: "checkbox", title: "Show or hide" });
  const pick = make("input", undefined, { type: "radio", name: "draft", title: "Clicks go here" });
  const swatch = make("span", "", { class: "swatch" });
  const name = make("input", undefined, { type: "text", placeholder: "in no link", "aria-label": "Name" });
  const mass = make("span", "", { class: "mass" });
  swatch.style.background = draft.colour;
  box.checked = true;
  box.addEventListener("change", () => {
    draft.off = !box.checked;
    if (!viewer) return;
    viewer.hide(viewer.bodies.filter((body) => owners.get(body.of.path).link === i), draft.off);
    show();
  });
  pick.addEventListener("change", () => { chosen = i; by("editing").checked = true; });
  name.addEventListener("change", () => rename(draft, name.value.trim()));
  row.append(box, pick, swatch, name, mass);
  by("drafts").append(row);
  return { row, box, pick, name, mass };
}

function refresh() {
  const weights = drafts.map(() => [0, 0]);
  for (const { link, mass } of owners.values()) {
    weights[link][0] += 1;
    weights[link][1] += mass || 0;
  }
  drafts.forEach((draft, i) => {
    const { row, box, pick, name, mass } = (draft.line ??= lineOf(draft, i));
    const called = draft.name || "in no link";
    const [count, kg] = weights[i];
    row.hidden = !count && i !== chosen && (draft.changed || twin(draft) >= 0); // undo brings an emptied link back
    box.setAttribute("aria-label", "Show " + called);
    pick.setAttribute("aria-label", "Clicks go to " + called);
    pick.checked = i === chosen && by("editing").checked;
    name.value = draft.name;
    mass.textContent = `${kg > 0 ? kilograms(kg) : "no mass"}, ${count} ${count === 1 ? "part" : "parts"}`;
  });
  selects.forEach((select, row) => {
    const listed = drafts.filter((draft) => !draft.line.row.hidden);
    select.replaceChildren(...listed.map((draft) => make("option", draft.name || "(no link)", { value: drafts.indexOf(draft) })));
    const links = new Set(data.parts[row].paths.map((path) => owners.get(path).link));
    select.value = links.size === 1 ? [...links][0] : "";
  });
  by("undo").disabled = !past.length;
  by("yaml").textContent = yaml();
}

// Each line is as high up as everything below belongs to one link.
function yaml() {
  const above = new Map();
  const levels = (path) => path.split("/").map((_, n, all) => all.slice(0, n + 1).join("/"));
  for (const [path, { link }] of owners) {
    for (const level of levels(path)) above.set(level, (above.get(level) || new Set()).add(drafts[link].name));
  }
  const lines = new Map();
  for (const [path, { link }] of owners) {
    const { name } = drafts[link];
    if (!name) continue;
    if (!lines.has(name)) lines.set(name, new Set());
    lines.get(name).add("path:" + levels(path).find((level) => above.get(level).size === 1));
  }
  const text = ["links:"];
  for (const [name, paths] of lines) {
    text.push(`  ${JSON.stringify(name)}:`, ...[...paths].map((path) => "    - " + JSON.stringify(path)));
  }
  return text.join("\n") + "\n";
}

by("new").addEventListener("click", () => {
  const n = drafts.length; // the links that are there have the colours before it
  const colour = COLOURS[n] ?? `hsl(${Math.round(n * 222.5) % 360}, 50%, ${n % 2 ? 60 : 45}%)`;
  chosen = drafts.push({ name: `link_${n + 1}`, colour }) - 1;
  by("editing").checked = true;
  refresh();
});
by("undo").addEventListener("click", () => {
  const { moves, draft, name } = past.pop();
  if (draft) draft.name = name;
  move(moves);
});
by("editing").addEventListener("change", refresh);
by("save").addEventListener("click", () => {
  const file = URL.createObjectURL(new Blob([yaml()], { type: "application/yaml" }));
  const link = make("a", "", { href: file, download: "map.yaml" });
  link.click();
  setTimeout(() => URL.revokeObjectURL(file), 1000);
});

// ---- the view, and what of it is seen
let viewer = null;
const marks = { ellipsoids: [], centres: [] };
refresh();

function choice(text) {
  const label = make("label");
  const box = make("input", undefined, { type: "checkbox" });
  box.checked = true;
  box.addEventListener("change", () => viewer && show());
  label.append(box, text);
  by("marks").append(label);
  return box;
}

// A mark is seen if its kind is chosen, and its link.
const kinds = { ellipsoids: choice("inertia ellipsoids"), centres: choice("centres of mass") };

function show() {
  for (const [kind, box] of Object.entries(kinds)) {
    for (const { mesh, link } of marks[kind]) mesh.visible = box.checked && !drafts[link].off && !drafts[link].changed;
  }
  viewer.draw();
}

// With Shift or Ctrl a click gives all parts of the link. Colours say who has what, so nothing is lit.
function picked(body, all) {
  const editing = by("editing").checked;
  viewer.light(body && !editing ? [body] : []);
  if (!body) return viewer.say("");
  const { path } = body.of;
  const paths = editing && all ? pathsOf(owners.get(path).link) : [path];
  if (editing) give(paths, chosen);
  const link = drafts[owners.get(path).link].name || "in no link";
  viewer.say(`${link}: ${paths.length === 1 ? path : `${paths.length} parts, with ${path}`}`);
}

async function start() {
  const bytes = Uint8Array.from(atob(by("glb").textContent), (c) => c.charCodeAt(0));
  const file = await new THREE.GLTFLoader().parseAsync(bytes.buffer, "");
  const [whole] = file.scene.children;
  whole.quaternion.identity(); // glTF has Y up
  whole.updateMatrixWorld(true);
  whole.children.forEach((link, i) => link.traverse((mesh) => {
    if (!mesh.isMesh) return;
    const { geometry, material, matrixWorld: matrix } = mesh;
    const centre = material.name.endsWith(" centre of mass");
    if (!centre && !material.transparent) {
      viewer.add({ path: mesh.userData.name || mesh.name }, [{ geometry, matrix, colour: material.color, opacity: 1 }]);
      return;
    }
    material.depthTest = !centre;
    material.depthWrite = false;
    const mark = new THREE.Mesh(geometry, material);
    mark.matrixAutoUpdate = false;
    mark.matrixWorld.copy(matrix);
    mark.renderOrder = centre ? 3 : 2;
    marks[centre ? "centres" : "ellipsoids"].push({ mesh: mark, link: i });
    viewer.scene.add(mark);
  }));
  viewer.dress();
  viewer.fit();
  document.body.dataset.ready = String(viewer.bodies.length);
}

if (data.shapes) {
  try {
    viewer = new Viewer(by("view"), picked);
    start().catch((error) => { document.body.dataset.ready = "error"; viewer.say(String(error)); });
  } catch {
    by("view").textContent = "This browser shows no 3D (WebGL); the tables below hold everything else.";
  }
} else {
  by("view").textContent = "There are no shapes to show: the geometry was read without meshes.";
}
