"use strict";
// The report's tables and its 3D view. Everything from a file goes in as text, never as markup.
const data = JSON.parse(document.getElementById("data").textContent);
const by = (id) => document.getElementById(id);

function make(tag, text, attributes) {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  for (const [name, value] of Object.entries(attributes || {})) element.setAttribute(name, value);
  return element;
}

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

function give(paths, link) {
  for (const path of paths) if (owners.has(path)) owners.get(path).link = link;
  for (const body of objects.bodies) {
    if (!paths.includes(body.userData.path)) continue;
    body.material = body.material.clone();
    body.material.color.set(drafts[link].colour);
  }
  refresh();
  draw();
}

function refresh() {
  const weights = drafts.map(() => [0, 0]);
  for (const { link, mass } of owners.values()) {
    weights[link][0] += 1;
    weights[link][1] += mass || 0;
  }
  by("drafts").replaceChildren(...drafts.map((draft, i) => {
    const line = make("div", undefined, { class: "draft" });
    const pick = make("input", undefined, { type: "radio", name: "draft", "aria-label": "Clicks go to " + (draft.name || "no link") });
    pick.checked = i === chosen;
    pick.addEventListener("change", () => { chosen = i; by("editing").checked = true; });
    const swatch = make("span", "", { class: "swatch" });
    swatch.style.background = draft.colour;
    const name = make("input", undefined, { type: "text", placeholder: "in no link", "aria-label": "Name" });
    name.value = draft.name;
    name.addEventListener("change", () => { draft.name = name.value.trim(); refresh(); });
    const [count, mass] = weights[i];
    line.append(pick, swatch, name, make("span", `${count} parts, ${kilograms(mass)}`, { class: "mass" }));
    return line;
  }));
  selects.forEach((select, row) => {
    select.replaceChildren(...drafts.map((draft, i) => make("option", draft.name || "(no link)", { value: i })));
    const links = new Set(data.parts[row].paths.map((path) => owners.get(path).link));
    select.value = links.size === 1 ? [...links][0] : "";
  });
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
  chosen = drafts.push({ name: `link_${drafts.length + 1}`, colour: COLOURS[drafts.length % COLOURS.length] }) - 1;
  by("editing").checked = true;
  refresh();
});
by("save").addEventListener("click", () => {
  const file = URL.createObjectURL(new Blob([yaml()], { type: "application/yaml" }));
  const link = make("a", "", { href: file, download: "map.yaml" });
  link.click();
  setTimeout(() => URL.revokeObjectURL(file), 1000);
});

// ---- links beside the view, and the view
const objects = { links: [], ellipsoids: [], centres: [], bodies: [] };
let draw = () => {};
refresh();

function choice(text, mass, colour, checked, change) {
  const label = make("label");
  const box = make("input", undefined, { type: "checkbox" });
  box.checked = checked;
  box.addEventListener("change", () => { change(box.checked); draw(); });
  label.append(box);
  if (colour) {
    const swatch = make("span", "", { class: "swatch" });
    swatch.style.background = colour;
    label.append(swatch);
  }
  label.append(make("span", text, { class: "name" }));
  if (mass !== undefined) label.append(make("span", mass, { class: "mass" }));
  by("side").append(label);
  return box;
}

data.views.forEach((view, i) => {
  const mass = view.mass === null ? "no mass" : kilograms(view.mass);
  choice(view.name || "in no link", mass, view.colour, true, (on) => { if (objects.links[i]) objects.links[i].visible = on; });
});
by("side").append(make("hr"));
const show = (list) => (on) => list.forEach((object) => { object.visible = on; });
choice("inertia ellipsoids", undefined, null, true, show(objects.ellipsoids));
choice("centres of mass", undefined, null, true, show(objects.centres));
choice("see through bodies", undefined, null, false, (on) => {
  for (const material of new Set(objects.bodies.map((body) => body.material))) {
    material.transparent = on;
    material.opacity = on ? 0.25 : 1;
    material.depthWrite = !on;
    material.needsUpdate = true;
  }
});

function start() {
  const text = atob(by("glb").textContent);
  const bytes = Uint8Array.from(text, (c) => c.charCodeAt(0));
  const holder = by("view");
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  holder.prepend(renderer.domElement);
  const scene = new THREE.Scene();
  scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f98, 2.2));
  const sun = new THREE.DirectionalLight(0xffffff, 2.0);
  const camera = new THREE.PerspectiveCamera(35, 1, 0.01, 100);
  camera.add(sun);
  sun.position.set(-1, 2, 1);
  scene.add(camera);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  draw = () => renderer.render(scene, camera);
  controls.addEventListener("change", draw);
  new THREE.GLTFLoader().parse(bytes.buffer, "", (file) => {
    scene.add(file.scene);
    const links = file.scene.children[0].children;
    links.forEach((link, i) => {
      objects.links[i] = link;
      link.traverse((object) => {
        if (!object.isMesh) return;
        const name = object.userData.name || object.name;
        object.userData.link = i;
        if (object.material.name.endsWith(" centre of mass")) {
          object.material.depthTest = false;
          object.renderOrder = 3;
          objects.centres.push(object);
        } else if (object.material.transparent) {
          object.material.depthWrite = false;
          object.renderOrder = 2;
          objects.ellipsoids.push(object);
        } else {
          object.userData.path = name;
          objects.bodies.push(object);
        }
      });
    });
    const box = new THREE.Box3().setFromObject(file.scene);
    const centre = box.getCenter(new THREE.Vector3());
    const radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1e-6);
    const away = radius / Math.sin((camera.fov * Math.PI) / 360);
    camera.near = away / 100;
    camera.far = away * 10;
    camera.position.copy(centre).add(new THREE.Vector3(0.62, 0.55, 1).setLength(away));
    controls.target.copy(centre);
    controls.update();
    resize();
    nearer(box, centre);
    document.body.dataset.ready = String(objects.bodies.length);
  }, (error) => { document.body.dataset.ready = "error"; by("picked").textContent = String(error); });
  // The sphere around a long arm is mostly empty: go as near as its box allows.
  function nearer(box, centre) {
    camera.updateMatrixWorld();
    let most = 0;
    for (let n = 0; n < 8; n++) {
      const corner = new THREE.Vector3(
        (n & 1 ? box.max : box.min).x, (n & 2 ? box.max : box.min).y, (n & 4 ? box.max : box.min).z).project(camera);
      most = Math.max(most, Math.abs(corner.x), Math.abs(corner.y));
    }
    camera.position.sub(centre).multiplyScalar(Math.min(1, 1.15 * most)).add(centre);
    controls.update();
    draw();
  }
  function resize() {
    const { clientWidth: width, clientHeight: height } = holder;
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    draw();
  }
  new ResizeObserver(resize).observe(holder);
  // A click names what is under it.
  const ray = new THREE.Raycaster();
  renderer.domElement.addEventListener("click", (event) => {
    const area = renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2(
      ((event.clientX - area.left) / area.width) * 2 - 1, 1 - ((event.clientY - area.top) / area.height) * 2);
    ray.setFromCamera(at, camera);
    const seen = objects.bodies.filter((body) => objects.links[body.userData.link].visible);
    const hit = ray.intersectObjects(seen, false)[0];
    if (hit && by("editing").checked) give([hit.object.userData.path], chosen);
    const view = hit && drafts[owners.get(hit.object.userData.path)?.link ?? hit.object.userData.link];
    by("picked").textContent = hit ? `${view.name || "in no link"}: ${hit.object.userData.path}` : "";
  });
}

if (data.shapes) {
  try { start(); } catch (error) {
    by("view").querySelector("canvas")?.remove();
    draw = () => {};
    by("picked").textContent = "This browser shows no 3D (WebGL); the tables below hold everything else.";
  }
} else {
  by("picked").textContent = "There are no shapes to show: the geometry was read without meshes.";
}
