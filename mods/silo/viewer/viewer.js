// SPDX-License-Identifier: LGPL-2.1-or-later
"use strict";
// The model in three dimensions: one viewer for the server's pages and for the report of masses. It needs three.js
// (three.min.js, the global THREE) and knows nothing of items: whoever uses it adds bodies, paints and lights them,
// and hears which of them somebody picked. It draws only if something changed. Lengths are metres, Z is up.

function _(text, values = {}) {
  return (Viewer.words[text] ?? text).replace(/%\((\w+)\)s/g, (_all, name) => values[name]);
}

class Viewer {
  static words = {}; // text → translation; whoever uses the viewer brings them
  static LIT = "#1a73e8";
  static GREY = "#9aa3ad";
  static SMALL = 4; // [px] smaller bodies are left out while the model turns
  static FINE = 1e6; // up to this cost a model at rest is drawn twice as fine
  static ALL = 1e7; // a budget that leaves nothing out
  static SETTLED = 180; // [ms] so long after the last turn it is drawn in full

  static make(tag, text, attributes) {
    const element = document.createElement(tag);
    if (text !== undefined) element.textContent = text;
    for (const [name, value] of Object.entries(attributes || {})) element.setAttribute(name, value);
    return element;
  }

  static length(metres) {
    return `${Number((metres * 1e3).toPrecision(4))} mm`;
  }

  #due = 0;
  #moving = false;
  #quick = false; // it turns in full
  #glance = false; // something was lit: a first picture in time, then all in full
  #settle = 0;
  #last = 0;
  #budget = 4e5; // vertices that are drawn in time while the model turns; it follows from the last frames
  #size = "";
  #cost = 0; // of all bodies
  #order = null; // the bodies, the largest first
  #materials = new Map();
  #over = []; // what is drawn over the bodies: lit ones behind others, outlines
  #points = []; // of a distance
  #pressed = null;
  #apart = 0;
  #step = -1;

  // Throws if the browser has no WebGL. picked(body, add): somebody clicked on a body, or on nothing.
  constructor(stage, picked) {
    const { make } = Viewer;
    // At rest a model of usual size is drawn twice as fine, which smooths edges; antialiasing would do so in each frame, and costs as much
    // as the bodies where software draws.
    this.renderer = new THREE.WebGLRenderer({ alpha: true });
    this.picked = picked;
    this.bodies = []; // { of, side, meshes, box, home, sphere, cost, paint, ghost, outline }
    this.lit = new Set();
    this.hidden = new Set();
    this.steps = [];
    this.beside = this.sheer = this.measuring = this.touched = false;
    this.plane = null;
    this.box = new THREE.Box3();
    this.canvas = this.renderer.domElement;
    this.scene = new THREE.Scene();
    this.scene.matrixWorldAutoUpdate = false; // bodies are placed once, not in each frame
    this.camera = new THREE.PerspectiveCamera(35, 1, 0.01, 100);
    this.camera.position.set(0.6, -1, 0.55);
    Viewer.#shine(this.scene, this.camera);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("start", () => (this.touched = true));
    this.controls.addEventListener("change", () => this.#turn());
    this.view = make("div", undefined, { class: "view" });
    this.said = make("p", "", { class: "said", role: "status" });
    this.tools = make("div", undefined, { class: "tools", role: "group", "aria-label": _("What to do with the model") });
    this.view.append(this.canvas);
    stage.replaceChildren(this.tools, this.view, this.said);
    this.#buttons();
    this.canvas.addEventListener("pointerdown", (event) => (this.#pressed = event));
    this.canvas.addEventListener("click", (event) => this.#click(event));
    new ResizeObserver(() => this.draw()).observe(this.view);
  }

  static #shine(scene, camera) {
    camera.up.set(0, 0, 1);
    const sun = new THREE.DirectionalLight(0xffffff, 1.9);
    sun.position.set(-0.5, 0.9, 0);
    sun.target.position.set(0, 0, -1);
    camera.add(sun, sun.target);
    scene.add(camera, new THREE.HemisphereLight(0xffffff, 0x878d96, 1.7));
  }

  // A PNG of bodies alone, in their own colours, from where a model is first seen; drawn twice as fine.
  picture(bodies, size) {
    const { renderer } = this;
    const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(35), box = new THREE.Box3();
    Viewer.#shine(scene, camera);
    for (const body of bodies) {
      box.union(body.box);
      for (const { geometry, userData } of body.meshes) {
        const mesh = new THREE.Mesh(geometry, this.#material(userData.hex, userData.opacity, false));
        mesh.matrixAutoUpdate = false;
        mesh.matrix.copy(userData.home);
        scene.add(mesh);
      }
    }
    const { center, radius } = box.getBoundingSphere(new THREE.Sphere());
    const distance = radius / Math.sin((camera.fov * Math.PI) / 360);
    camera.position.set(0.6, -1, 0.55).setLength(distance).add(center);
    camera.lookAt(center);
    Object.assign(camera, { near: distance - radius, far: distance + radius });
    camera.updateProjectionMatrix();
    renderer.setPixelRatio(2);
    renderer.setSize(size, size, false);
    renderer.setScissorTest(false);
    renderer.clippingPlanes = [];
    renderer.render(scene, camera);
    const made = Viewer.make("canvas", undefined, { width: size, height: size });
    made.getContext("2d").drawImage(this.canvas, 0, 0, size, size);
    this.#size = "";
    this.#render(performance.now()); // before the page shows the canvas
    return new Promise((done) => made.toBlob(done));
  }

  // pieces: { geometry, matrix, colour, opacity }; side -1: of the old state alone, 1: of the new one, 0: of both.
  add(of, pieces, side = 0) {
    const body = { of, side, meshes: [], box: new THREE.Box3(), sphere: new THREE.Sphere(), cost: 0, paint: null };
    for (const { geometry, matrix, colour, opacity } of pieces) {
      if (!geometry.boundingBox) geometry.computeBoundingBox();
      const mesh = new THREE.Mesh(geometry);
      mesh.matrixAutoUpdate = false;
      mesh.userData = { body, hex: colour.getHex(), opacity, home: matrix };
      mesh.matrixWorld.copy(matrix);
      body.box.union(geometry.boundingBox.clone().applyMatrix4(matrix));
      body.cost += geometry.attributes.position.count + 300; // a call costs as much as some vertices
      body.meshes.push(mesh);
      this.scene.add(mesh);
    }
    body.home = body.box.getCenter(new THREE.Vector3());
    body.box.getBoundingSphere(body.sphere);
    this.box.union(body.box);
    this.#cost += body.cost;
    this.bodies.push(body);
    this.#order = null;
    return body;
  }

  // After bodies were added, painted, hidden or lit.
  dress() {
    this.scene.remove(...this.#over);
    this.#over = [];
    const covered = this.bodies.some((body) => !this.lit.has(body) && !this.hidden.has(body));
    for (const body of this.bodies) {
      const lit = this.lit.has(body);
      const ghost = body.ghost && !this.beside && !lit;
      for (const mesh of body.meshes) {
        const { hex, opacity } = mesh.userData;
        const colour = body.paint ?? (lit ? Viewer.LIT : hex);
        const clear = lit ? Math.max(opacity, 0.8) : this.sheer ? 0.25 : ghost ? 0.35 : opacity;
        mesh.material = this.#material(colour, clear, this.lit.size > 0 && !lit);
        if (lit && covered) this.#overlay(body, mesh, new THREE.Mesh(mesh.geometry, this.#material(colour, 0.4, false, true)));
        if (body.outline) {
          const edges = (mesh.geometry.userData.edges ??= new THREE.EdgesGeometry(mesh.geometry, 30));
          this.#overlay(body, mesh, this.#line(edges, body.outline));
        }
      }
    }
    this.draw();
  }

  #overlay(body, mesh, over) {
    over.matrixAutoUpdate = false;
    over.matrixWorld.copy(mesh.matrixWorld);
    over.userData.body = body;
    over.renderOrder ||= 2;
    this.#over.push(over);
    this.scene.add(over);
  }

  #material(colour, opacity, dim, behind = false) {
    const key = `${colour} ${opacity} ${dim} ${behind}`;
    if (!this.#materials.has(key)) {
      const material = new THREE.MeshLambertMaterial({ color: colour, side: THREE.DoubleSide });
      if (dim) material.color.lerp(new THREE.Color(Viewer.GREY), 0.75);
      else material.emissive.copy(material.color).multiplyScalar(0.15);
      // Both sides in one pass: no order of two is right for all bodies anyway, and each pass costs as much as a body.
      if (opacity < 1) Object.assign(material, { transparent: true, opacity, depthWrite: false, forceSinglePass: true });
      if (behind) material.depthFunc = THREE.GreaterDepth; // drawn where something covers it
      this.#materials.set(key, material);
    }
    return this.#materials.get(key);
  }

  #line(points, colour) {
    const made = new THREE.LineSegments(points, new THREE.LineBasicMaterial({ color: colour, depthTest: false, transparent: true }));
    made.renderOrder = 3;
    return made;
  }

  light(bodies, look = false) {
    this.lit = new Set(bodies);
    if (look && this.lit.size) this.fit(this.lit);
    if (this.#budget <= Viewer.ALL) {
      this.#glance = true;
      this.#settled();
    }
    this.dress();
    if (this.lit.size === 2) {
      const [one, two] = this.lit;
      this.say(_("Between the middles of the two: %(length)s", { length: Viewer.length(one.home.distanceTo(two.home)) }));
    }
  }

  hide(bodies, on = true) {
    for (const body of bodies) on ? this.hidden.add(body) : this.hidden.delete(body);
    this.dress();
  }

  say(words) {
    this.said.textContent = words;
  }

  // Steps that a person goes through: { words, … }; show(step) lights one of them.
  follow(steps, show) {
    this.steps = steps;
    this.show = show;
    this.#step = -1;
    for (const button of this.steppers) button.hidden = !steps.length;
  }

  go(by) {
    const count = this.steps.length;
    if (!count) return;
    this.#step = this.#step < 0 ? (by > 0 ? 0 : count - 1) : (this.#step + by + count) % count;
    this.touched = true;
    this.show(this.steps[this.#step]);
    this.say(_("%(step)s of %(count)s: %(words)s", { step: this.#step + 1, count, words: this.steps[this.#step].words }));
  }

  // The camera keeps its direction and goes as near as the box allows.
  fit(bodies) {
    const box = new THREE.Box3();
    for (const body of bodies ?? this.bodies) if (bodies || !this.hidden.has(body)) box.union(body.box);
    if (box.isEmpty()) return;
    if (bodies) box.expandByScalar(this.box.getSize(new THREE.Vector3()).length() * 0.03); // with what is around
    const { camera, controls } = this;
    const centre = box.getCenter(new THREE.Vector3());
    const away = camera.position.clone().sub(controls.target).normalize();
    const right = new THREE.Vector3().crossVectors(camera.up, away).normalize();
    const up = new THREE.Vector3().crossVectors(away, right);
    const tall = Math.tan((camera.fov * Math.PI) / 360);
    const wide = (tall * this.view.clientWidth) / (this.beside ? 2 : 1) / Math.max(1, this.view.clientHeight);
    let distance = 0;
    for (let n = 0; n < 8; n++) {
      const { min, max } = box;
      const corner = new THREE.Vector3((n & 1 ? max : min).x, (n & 2 ? max : min).y, (n & 4 ? max : min).z).sub(centre);
      const needed = Math.max(Math.abs(corner.dot(right)) / wide, Math.abs(corner.dot(up)) / tall);
      distance = Math.max(distance, corner.dot(away) + needed);
    }
    controls.target.copy(centre);
    camera.position.copy(centre).addScaledVector(away, Math.max(1.06 * distance, 1e-6));
    controls.update();
    this.draw();
  }

  draw() {
    this.#due ||= requestAnimationFrame((now) => {
      this.#due = 0;
      this.#render(now);
    });
  }

  #turn() {
    if (!this.#moving) {
      this.#quick = this.#budget > Viewer.ALL;
      this.#last = -Infinity; // what came before was no frame of this turn
    }
    this.#moving = true;
    this.#settled();
    this.draw();
  }

  // After a while, in full.
  #settled() {
    clearTimeout(this.#settle);
    this.#settle = setTimeout(() => {
      this.#moving = this.#glance = false;
      this.draw();
    }, Viewer.SETTLED);
  }

  #render(now) {
    const { renderer, camera, scene } = this;
    const { clientWidth: width, clientHeight: height } = this.view;
    if (!width || !height) return;
    const fine = this.#cost < Viewer.FINE && !this.#glance ? 2 : devicePixelRatio;
    const ratio = this.#moving ? (this.#quick ? devicePixelRatio : 0.5) : fine;
    const size = `${width} ${height} ${ratio}`;
    if (size !== this.#size) {
      this.#size = size;
      renderer.setPixelRatio(ratio);
      renderer.setSize(width, height, false);
    }
    const sphere = this.box.getBoundingSphere(new THREE.Sphere());
    const reach = sphere.radius * (1 + 2 * this.#apart) || 1;
    const distance = camera.position.distanceTo(sphere.center);
    const sides = this.beside ? [-1, 1] : [0];
    camera.aspect = width / sides.length / height;
    camera.far = distance + reach;
    camera.near = Math.max(distance - reach, camera.far / 5000);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    renderer.clippingPlanes = this.plane ? [this.plane] : [];
    renderer.setScissorTest(this.beside);
    const drawn = this.#moving || this.#glance ? this.#large(now, height) : null;
    this.view.dataset.drawn = drawn ? "in part" : "in full";
    sides.forEach((side, n) => {
      const area = [(n * width) / sides.length, 0, width / sides.length, height];
      renderer.setViewport(...area);
      renderer.setScissor(...area);
      for (const object of scene.children) {
        const { body } = object.userData;
        if (body) object.visible = this.#shows(body, side) && (!drawn || drawn.has(body));
      }
      renderer.render(scene, camera);
    });
    if (this.#moving) this.draw(); // the time between two frames is then what one of them costs
  }

  #shows(body, side) {
    return !this.hidden.has(body) && (!side || !body.side || body.side === side);
  }

  // As many bodies as can be drawn in time, the lit and the large ones first.
  #large(now, height) {
    const { camera } = this;
    const took = now - this.#last;
    this.#last = now;
    if (this.#moving && took < 5000) this.#budget = Math.min(2 * Viewer.ALL, Math.max(5e4, this.#budget * (took > 40 ? 0.8 : took < 25 ? 1.15 : 1)));
    this.#order ??= [...this.bodies].sort((one, two) => two.sphere.radius - one.sphere.radius);
    const frustum = new THREE.Frustum().setFromProjectionMatrix(
      new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    const pixels = height / Math.tan((camera.fov * Math.PI) / 360);
    const drawn = new Set();
    let left = this.#budget;
    if (this.#glance) {
      for (const body of this.lit) {
        drawn.add(body);
        left -= 2 * body.cost; // it is drawn over what covers it, too
      }
    }
    for (const body of this.#order) {
      if (left < 0) break;
      const seen = (body.sphere.radius / camera.position.distanceTo(body.sphere.center)) * pixels;
      if (seen < Viewer.SMALL || this.hidden.has(body) || !frustum.intersectsSphere(body.sphere)) continue;
      drawn.add(body);
      left -= body.cost;
    }
    return drawn;
  }

  // What is under a place of the screen: { body, point, face, object, distance } or null.
  hit({ clientX, clientY }) {
    const area = this.canvas.getBoundingClientRect();
    let across = (clientX - area.left) / area.width;
    const side = this.beside ? (across < 0.5 ? -1 : 1) : 0;
    if (side) across = (across * 2) % 1;
    const ray = new THREE.Raycaster();
    ray.setFromCamera(new THREE.Vector2(2 * across - 1, 1 - (2 * (clientY - area.top)) / area.height), this.camera);
    const near = this.bodies
      .filter((body) => this.#shows(body, side) && ray.ray.intersectsSphere(body.sphere))
      .map((body) => ({ body, from: body.sphere.center.distanceTo(ray.ray.origin) - body.sphere.radius }))
      .sort((one, two) => one.from - two.from);
    let best = null;
    for (const { body, from } of near) {
      if (best && from > best.distance) break; // all others are behind it
      const kept = (hit) => !this.plane || this.plane.distanceToPoint(hit.point) >= 0;
      const hit = ray.intersectObjects(body.meshes, false).find(kept);
      if (hit && !(best?.distance < hit.distance)) best = { ...hit, body };
    }
    return best;
  }

  #click(event) {
    const { clientX, clientY } = this.#pressed ?? event;
    if (Math.hypot(event.clientX - clientX, event.clientY - clientY) > 4) return; // the model was turned
    const hit = this.hit(event);
    if (this.measuring) return hit && this.#measure(this.#corner(hit, event));
    this.picked(hit?.body ?? null, event.ctrlKey || event.shiftKey || event.metaKey);
  }

  // The corner of a triangle, if the click was near it: people measure from edges and corners.
  #corner({ object, face, point }, event) {
    const area = this.canvas.getBoundingClientRect();
    for (const place of [face.a, face.b, face.c]) {
      const corner = object.getVertexPosition(place, new THREE.Vector3()).applyMatrix4(object.matrixWorld);
      const seen = corner.clone().project(this.camera);
      const x = area.left + ((seen.x + 1) / 2) * area.width, y = area.top + ((1 - seen.y) / 2) * area.height;
      if (!this.beside && Math.hypot(event.clientX - x, event.clientY - y) < 10) return corner;
    }
    return point;
  }

  #measure(point) {
    if (point) this.#points = this.#points.length === 2 ? [point] : [...this.#points, point];
    if (this.ruler) this.scene.remove(this.ruler);
    const [from, to = from] = this.#points;
    if (!from) return this.draw();
    this.ruler = this.#line(new THREE.BufferGeometry().setFromPoints([from, to]), Viewer.LIT);
    this.scene.add(this.ruler);
    const by = to.clone().sub(from);
    const parts = ["x", "y", "z"].map((axis) => `${axis} ${Viewer.length(Math.abs(by[axis]))}`);
    this.say(to === from ? _("Click on the second point.") : _("Distance %(length)s (%(parts)s)", { length: Viewer.length(by.length()), parts: parts.join(", ") }));
    this.draw();
  }

  #explode(apart) {
    this.#apart = apart;
    const middle = this.box.getCenter(new THREE.Vector3());
    for (const body of this.bodies) {
      const by = body.home.clone().sub(middle).multiplyScalar(apart);
      body.sphere.center.copy(body.home).add(by);
      for (const mesh of body.meshes) mesh.matrixWorld.makeTranslation(by).multiply(mesh.userData.home);
    }
    this.dress(); // what is drawn over the bodies goes with them
  }

  #section(axis, share) {
    this.plane = null;
    if (axis) {
      const normal = new THREE.Vector3();
      normal[axis] = -1; // what is below stays
      const { min, max } = this.box;
      this.plane = new THREE.Plane(normal, min[axis] + share * (max[axis] - min[axis]));
    }
    this.draw();
  }

  #buttons() {
    const { make } = Viewer;
    const keys = {
      ArrowLeft: () => this.#orbit(-0.2, 0), ArrowRight: () => this.#orbit(0.2, 0), ArrowUp: () => this.#orbit(0, -0.2),
      ArrowDown: () => this.#orbit(0, 0.2), "+": () => this.#near(0.8), "-": () => this.#near(1.25),
      Escape: () => this.picked(null, false),
    };
    const button = (words, title, key, act) => {
      const made = make("button", words, { type: "button", title: key ? _("%(title)s (key %(key)s)", { title, key: key.toUpperCase() }) : title });
      made.addEventListener("click", act);
      this.tools.append(made);
      if (key) keys[key] = act;
      return made;
    };
    const toggle = (words, title, name, act) => {
      const made = button(words, title, "", () => {
        this[name] = !this[name];
        made.setAttribute("aria-pressed", this[name]);
        act();
      });
      made.setAttribute("aria-pressed", "false");
      return made;
    };
    const slide = (words, value, act) => {
      const label = make("label", words);
      const input = make("input", undefined, { type: "range", min: 0, max: 1, step: 0.01, value });
      input.addEventListener("input", () => act(Number(input.value)));
      label.append(input);
      this.tools.append(label);
      return label;
    };
    this.steppers = [button(_("‹ Previous"), _("The one before"), "p", () => this.go(-1)), button(_("Next ›"), _("The next one"), "n", () => this.go(1))];
    this.sides = toggle(_("Old beside new"), _("Both states, seen from the same place"), "beside", () => {
      this.view.classList.toggle("halves", this.beside);
      this.fit();
      this.dress();
    });
    for (const made of [...this.steppers, this.sides]) made.hidden = true;
    button(_("Fit"), _("Show the whole model, or the highlighted bodies"), "f", () => this.fit(this.lit.size ? this.lit : undefined));
    button(_("Hide"), _("Hide the highlighted bodies"), "h", () => {
      this.hide(this.lit);
      this.picked(null, false);
    });
    button(_("Isolate"), _("Show only the highlighted bodies"), "i", () => {
      if (!this.lit.size) return;
      this.hidden = new Set(this.bodies.filter((body) => !this.lit.has(body)));
      this.fit(this.lit);
    });
    button(_("Show all"), _("Show the hidden bodies"), "a", () => this.hide(this.bodies, false));
    toggle(_("See through"), _("Make the bodies transparent"), "sheer", () => this.dress());
    toggle(_("Distance"), _("Click on two points"), "measuring", () => {
      this.#points = [];
      this.#measure();
      this.say(this.measuring ? _("Click on the first point.") : "");
    });
    slide(_("Explode"), 0, (value) => this.#explode(1.5 * value));
    const axes = make("select");
    for (const axis of ["", "x", "y", "z"]) axes.append(make("option", axis.toUpperCase() || _("none"), { value: axis }));
    const label = make("label", _("Section"));
    label.append(axes);
    this.tools.append(label);
    const place = slide(_("at"), 0.5, (value) => this.#section(axes.value, value));
    place.hidden = true;
    axes.addEventListener("change", () => {
      place.hidden = !axes.value;
      this.#section(axes.value, Number(place.lastChild.value));
    });
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", _("Model: arrow keys turn it, plus and minus change the distance, Escape ends the highlighting"));
    this.canvas.addEventListener("keydown", (event) => {
      const act = keys[event.key];
      if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      this.touched = true;
      act();
    });
  }

  #orbit(across, up) {
    const away = this.camera.position.clone().sub(this.controls.target);
    const tilt = away.angleTo(this.camera.up); // never over the top
    const right = new THREE.Vector3().crossVectors(this.camera.up, away).normalize();
    away.applyAxisAngle(right, Math.min(Math.max(up, 0.05 - tilt), Math.PI - 0.05 - tilt));
    this.camera.position.copy(this.controls.target).add(away.applyAxisAngle(this.camera.up, across));
    this.controls.update();
  }

  #near(by) {
    this.camera.position.sub(this.controls.target).multiplyScalar(by).add(this.controls.target);
    this.controls.update();
  }
}
