// What both pages have: panes side by side, seen through one camera, and the tools above them. Lengths in m,
// times in s.
'use strict';

const $ = (id) => document.getElementById(id);
const isPressed = (button) => button.getAttribute('aria-pressed') === 'true';

function message(text) {
  $('message').textContent = text;
  $('message').hidden = !text;
}

// A last short word, such as a unit, stays with the one before it.
function cell(tag, text, attributes = {}) {
  const made = document.createElement(tag);
  made.textContent = text.replace(/ (?=[^ ]{1,6}$)/, '\u00a0');
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

function row(...cells) {
  const made = document.createElement('tr');
  made.append(...cells);
  return made;
}

// What keeps a drape from being good, and its numbers; one card for each of these that has a verdict.
function showVerdicts(place, sources, heading) {
  const judged = sources.filter(({verdict}) => verdict);
  place.replaceChildren(...judged.map(({name, verdict}) => {
    const made = document.createElement('section');
    made.className = verdict.good ? 'good' : 'bad';
    const says = verdict.good ? '✓ Good drape' : '✕ Not a good drape';
    made.append(cell(heading ? 'h3' : 'h2', judged.length > 1 ? `${name}: ${says}` : says));
    if (heading) made.append(cell('small', heading));
    if (verdict.faults?.length > 0) {
      const faults = document.createElement('ul');
      faults.append(...verdict.faults.map(({message: why}) => cell('li', why)));
      made.append(faults);
    }
    const count = (number, what) => `${number} ${what}${number === 1 ? '' : 's'}`;
    const inside = Number(verdict.particles_inside ?? 0);
    const facts = [
      ['at rest', verdict.at_rest ? 'yes' : 'no'],
      ['cuts of cloth', Number(verdict.cloth_cut_count ?? 0) === 0 ? 'none' : `${verdict.cloth_cut_count}`],
      ['in the body', inside === 0 ? 'nothing' : `${count(inside, 'particle')}, up to ${inUnits(1000 * verdict.deepest_m, 'mm')}`],
      ['99 % of strain', `up to ${percent(verdict.strain_warp ?? 0)} warp, ${percent(verdict.strain_weft ?? 0)} weft`],
      ['pressure', `up to ${inUnits((verdict.largest_pressure_pa ?? 0) / 1000, 'kPa')}`],
      ...(verdict.slid_m ? [['slid', inUnits(1000 * verdict.slid_m, 'mm')]] : []),
    ];
    const list = document.createElement('dl');
    list.append(...facts.flatMap(([label, text]) => [cell('dt', label), cell('dd', text)]));
    made.append(list);
    return made;
  }));
}

const digits = (value) => (value !== 0 && Math.abs(value) < 1e-3 ? value.toExponential(2) : value.toPrecision(4));

function setPlaying(playing) {
  $('play').classList.toggle('playing', playing);
  $('play').setAttribute('aria-label', playing ? 'Pause' : 'Play');
}

class Stage {
  constructor() {
    const canvas = $('view');
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
    this.renderer.gammaOutput = true;
    this.renderer.gammaFactor = 2.2;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.renderer.setScissorTest(true);
    this.panes = [];
    this.time = 0;
    this.playing = false;  // between frames, too
    this.quantity = '';
    this.stale = true;
    this.fitted = true;  // nobody has turned the view yet
    this.ray = new THREE.Raycaster();
    this.place = undefined;  // that is marked: the pane, and where on its cloth
    new ResizeObserver(() => this.resize()).observe($('stage'));
  }

  // Called before each picture, and after each that was drawn.
  advance() {}
  drawn() {}

  // Shows these instead, see Pane.
  show(sources) {
    const gravity = vector(sources[0].gravity_m_per_s2);
    this.up = gravity.length() > 0 ? gravity.negate().normalize() : new THREE.Vector3(0, 1, 0);
    this.box = this.boxOf(sources);
    this.panes = sources.map((source) => new Pane(source, this.box, this.up));
    this.place = undefined;
    $('lines').checked = this.linesChosen ?? sources.some(({sheets}) => sheets.some(({mesh}) => mesh));
    this.listLayers();
    this.offerColours();
    this.namePanels();
    this.layOut();
    this.makeCamera();
  }

  // What can be hidden.
  listLayers() {
    const names = [...new Set(this.panes.flatMap(({source}) => source.sheets.map(({name}) => name)))];
    $('sheets').replaceChildren(...(names.length > 1 ? names : []).map((name) => {
      const box = Object.assign(document.createElement('input'), {type: 'checkbox', checked: true, name});
      const label = cell('label', '');
      label.append(box, ` ${name}`);
      return label;
    }));
    $('bodies').closest('label').hidden = this.panes.every(({bodies}) => bodies.length === 0);
    this.showLayers();
  }

  showLayers() {
    const hidden = new Set([...$('sheets').querySelectorAll('input:not(:checked)')].map(({name}) => name));
    for (const pane of this.panes) {
      pane.lines.visible = $('lines').checked;
      pane.hideSheets(hidden);
      for (const {mesh} of pane.bodies) mesh.visible = $('bodies').checked;
    }
    this.stale = true;
  }

  // Those of what is recorded, of all that is shown.
  offerColours() {
    for (const option of $('colour').options) {
      if (!kQuantities[option.value]?.recorded) continue;
      option.hidden = option.disabled = !this.panes.every(({source}) => source.has(option.value));
    }
  }

  clothBoxOf(sources) {
    const box = new THREE.Box3();
    for (const {low_m, high_m} of sources) {
      box.expandByPoint(new THREE.Vector3(...low_m)).expandByPoint(new THREE.Vector3(...high_m));
    }
    return box;
  }

  // Around the particles and the bodies, as far as these are not much larger.
  boxOf(sources) {
    const box = this.clothBoxOf(sources);
    const reach = box.getSize(new THREE.Vector3()).length();
    for (const {colliders} of sources) {
      for (const collider of colliders) {
        if (collider.plane) continue;
        const bounds = new THREE.Box3().setFromObject(colliderMesh(collider));
        if (bounds.getSize(new THREE.Vector3()).length() < 4 * reach) box.union(bounds);
      }
    }
    return box;
  }

  makeCamera() {
    this.controls?.dispose();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
    this.camera.up.copy(this.up);
    this.controls = new THREE.OrbitControls(this.camera, $('view'));
    this.controls.enableKeys = false;
    this.controls.screenSpacePanning = true;
    this.controls.addEventListener('change', () => { this.stale = true; });
    this.controls.addEventListener('start', () => { this.fitted = false; });
    this.fit();
  }

  // What is to be seen: of a garment that is put on, itself.
  focus() {
    const sources = this.panes.map(({source}) => source);
    return sources.some(({phases}) => phases.length > 0) ? this.clothBoxOf(sources) : this.box;
  }

  // From the front, a little from the right and above, as near as the box allows.
  fit() {
    const box = this.focus();
    const centre = box.getCenter(new THREE.Vector3());
    const radius = this.box.getSize(new THREE.Vector3()).length() / 2;
    const {front, right} = frontOf(this.up);
    const from = front.addScaledVector(right, 0.55).addScaledVector(this.up, 0.45).normalize();
    const x = this.up.clone().cross(from).normalize();
    const y = from.clone().cross(x);
    const {width, height} = this.split();
    const tangent = 0.9 * Math.tan(this.camera.fov / 2 * Math.PI / 180);
    let distance = 0;
    for (const corner of cornersOf(box)) {
      corner.sub(centre);
      const across = Math.max(Math.abs(corner.dot(y)), Math.abs(corner.dot(x)) * height / width);
      distance = Math.max(distance, corner.dot(from) + across / tangent);
    }
    this.camera.near = radius / 100;
    this.camera.far = 60 * radius;
    this.camera.position.copy(centre).addScaledVector(from, distance);
    this.controls.target.copy(centre);
    this.controls.maxDistance = 30 * radius;
    this.controls.minDistance = radius / 50;
    this.controls.update();
    this.fitted = true;
    this.stale = true;
  }

  resize() {
    if (this.fitted && this.panes.length > 0) this.fit();
    this.stale = true;
  }

  // Turns the view by angles, or brings the camera nearer.
  turn(around, over, nearer = 1) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const right = this.up.clone().cross(offset).normalize();
    offset.applyAxisAngle(this.up, around).applyAxisAngle(right, over).multiplyScalar(nearer);
    if (Math.abs(offset.clone().normalize().dot(this.up)) > 0.999) return;
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.fitted = false;
    this.stale = true;
  }

  // Where space is shown, and beside or below it the pattern of a single pane, in pixels from the upper left.
  regions() {
    const {clientWidth: width, clientHeight: height} = $('stage');
    const whole = {left: 0, top: 0, width, height};
    if (!isPressed($('pattern')) || this.panes.length !== 1) return {space: whole};
    if (width > height) {
      const left = Math.round(0.55 * width);
      return {space: {...whole, width: left}, flat: {...whole, left, width: width - left}};
    }
    const top = Math.round(0.55 * height);
    return {space: {...whole, height: top}, flat: {...whole, top, height: height - top}};
  }

  // The grid of panes whose shorter side is longest.
  split() {
    const {space} = this.regions();
    const count = Math.max(1, this.panes.length);
    let best;
    for (let columns = 1; columns <= count; ++columns) {
      const rows = Math.ceil(count / columns);
      const shape = {columns, rows, width: space.width / columns, height: space.height / rows};
      if (!best || Math.min(shape.width, shape.height) > Math.min(best.width, best.height)) best = shape;
    }
    return best;
  }

  layOut() {
    $('names').replaceChildren(...this.panes.map(({source}) => {
      const label = document.createElement('div');
      label.append(source.name, document.createElement('small'));
      return label;
    }));
  }

  tick(now) {
    this.advance(now);
    if (this.stale && this.panes.length > 0) this.draw();
    requestAnimationFrame((next) => this.tick(next));
  }

  draw() {
    this.stale = false;
    const {space, flat} = this.regions();
    if (flat) this.panes[0].pattern.fit(flat.width, flat.height);
    for (const pane of this.panes) pane.show(this.time, this.playing, this.quantity);
    this.colour();

    const {clientWidth, clientHeight} = $('stage');
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    const {columns, rows, width, height} = this.split();
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== clientWidth || size.y !== clientHeight) this.renderer.setSize(clientWidth, clientHeight, false);
    Object.assign($('names').style, {width: `${space.width}px`, height: `${space.height}px`});
    $('names').style.gridTemplate = `repeat(${rows}, 1fr) / repeat(${columns}, 1fr)`;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.markPlace();
    this.panes.forEach((pane, k) => {
      $('names').children[k].className = `${k % columns > 0 ? 'right' : ''} ${k >= columns ? 'below' : ''}`;
      const left = (k % columns) * width;
      const bottom = clientHeight - (Math.floor(k / columns) + 1) * height;
      this.renderer.setViewport(left, bottom, width, height);
      this.renderer.setScissor(left, bottom, width, height);
      this.renderer.render(pane.scene, this.camera);
    });
    this.drawPattern(flat);
    this.drawn();
  }

  drawPattern(region) {
    $('cut').hidden = !region;
    if (!region) return;
    const [{pattern}] = this.panes;
    const {left, top, width, height} = region;
    const bottom = $('stage').clientHeight - top - height;
    this.renderer.setViewport(left, bottom, width, height);
    this.renderer.setScissor(left, bottom, width, height);
    this.renderer.render(pattern.scene, pattern.camera);

    // names on the panels that have room for them
    Object.assign($('cut').style, {left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px`});
    $('cut').className = left > 0 ? 'right' : 'below';
    const shown = [pattern, left, top, width, height];
    if (shown.every((each, k) => each === this.named?.[k])) return;
    this.named = shown;
    const pixels = width / (pattern.camera.right - pattern.camera.left);
    $('cut').replaceChildren(...pattern.cloth.panels.map(({name}, k) => {
      const {box, size} = pattern.boxes[k];
      const label = document.createElement('div');
      label.append(cell('span', name));
      const at = new THREE.Vector3((box.min.x + box.max.x) / 2, (box.min.y + box.max.y) / 2, 0).project(pattern.camera);
      Object.assign(label.style, {left: `${50 * (1 + at.x)}%`, top: `${50 * (1 - at.y)}%`,
        width: `${Math.round(0.94 * pixels * size.x)}px`});
      return label;
    }));
    for (const label of $('cut').children) label.hidden = label.scrollWidth > label.clientWidth + 1;
  }

  // ---- what a pointer is over

  // The pane there, with the ray through it; of the pattern where it is over that.
  aim({clientX, clientY}) {
    const box = $('stage').getBoundingClientRect();
    const [x, y] = [clientX - box.left, clientY - box.top];
    const within = ({left, top, width, height}) => x >= left && x < left + width && y >= top && y < top + height;
    const through = (camera, {left, top, width, height}) => this.ray.setFromCamera(
      new THREE.Vector2(2 * (x - left) / width - 1, 1 - 2 * (y - top) / height), camera);
    const {flat} = this.regions();
    if (flat && within(flat)) {
      through(this.panes[0].pattern.camera, flat);
      return {pane: this.panes[0], onPattern: true};
    }
    const {columns, width, height} = this.split();
    for (const [k, pane] of this.panes.entries()) {
      const region = {left: (k % columns) * width, top: Math.floor(k / columns) * height, width, height};
      if (!within(region)) continue;
      through(this.camera, region);
      return {pane, onPattern: false};
    }
    return undefined;
  }

  // The pane, and the place on its cloth that is seen there.
  find(event) {
    const aimed = this.aim(event);
    if (!aimed) return undefined;
    const {pane, onPattern} = aimed;
    const bodies = pane.bodies.map(({mesh}) => mesh).filter(({visible}) => visible);
    const place = onPattern ? pane.placeAt(this.ray, [pane.pattern.mesh])
      : pane.placeAt(this.ray, pane.cloth.children.slice(0, 2), bodies);
    return place && {pane, place};
  }

  // Marks what the pointer is over, and says which panel that is.
  point(event) {
    if (event.buttons !== 0 || this.panes.length === 0) return;
    this.pointed = event;
    this.stale = true;
  }

  markPlace() {
    if (this.pointed) this.place = this.find(this.pointed);
    this.pointed = undefined;
    for (const pane of this.panes) pane.markPlace(this.place?.pane === pane ? this.place.place : undefined);
    $('probe').hidden = !this.place;
    if (!this.place) return;
    const {pane, place} = this.place;
    const known = kQuantities[this.quantity];
    $('probe').replaceChildren(cell('b', pane.source.cloth.panelOf(place.triangle).name),
      known ? ` ${known.text(pane.valueAt(place)).replace(/^-/, '−')}` : '');
  }

  // One scale for all panes, so that equal colours are equal values.
  colour() {
    const known = kQuantities[this.quantity];
    const textOf = (value) => known.text(value).replace(/^-/, '−');
    $('legend').hidden = !this.quantity;
    $('panels').hidden = !this.quantity || known;
    for (const id of ['scale', 'now-label']) $(id).hidden = !known;
    $('quantity').textContent = known?.title ?? 'Panels';
    let most = 0;
    if (known) {
      for (const {source, values} of this.panes) {
        const ofFrame = known.recorded ? roundMost : largestOf;
        most = Math.max(most, $('now').checked ? ofFrame(values) : source.largest(this.quantity, values));
      }
      $('ramp').style.background = `linear-gradient(90deg, ${rampOf(known).join(', ')})`;
      $('ramp').textContent = known.balanced ? '0' : '';
      $('least').textContent = known.balanced ? `−${textOf(most)}` : '0';
      $('most').textContent = `${textOf(most)}${known.recorded ? ' or more' : ''}`;
    }
    for (const pane of this.panes) pane.colourBy(this.quantity, most);
  }

  // Equal names have equal colours in all panes.
  namePanels() {
    const names = [...new Set(this.panes.flatMap(({source}) => source.cloth.panels.map(({name}) => name)))];
    const colours = new Map(names.map((name, k) => [name, kPanels[k % kPanels.length]]));
    for (const pane of this.panes) pane.paintPanels(colours);
    $('panels').replaceChildren(...names.map((name) => {
      const item = cell('li', name);
      item.style.setProperty('--swatch', colours.get(name));
      return item;
    }));
    const option = $('colour').querySelector('[value=panels]');
    option.hidden = option.disabled = names.length < 2;
    if (option.disabled && this.quantity === 'panels') {
      $('colour').value = 'cloth';
      this.quantity = '';
    }
  }

  colourChosen() {
    this.quantity = $('colour').value === 'cloth' ? '' : $('colour').value;
    this.stale = true;
  }

  paint() {
    for (const pane of this.panes) pane.paint();
    this.stale = true;
  }

  toggleLayer(id) {
    $(id).checked = !$(id).checked;
    $(id).dispatchEvent(new Event('change', {bubbles: true}));
  }

  togglePattern() {
    $('pattern').setAttribute('aria-pressed', !isPressed($('pattern')));
    this.resize();
  }

  toggleTheme() {
    const {dataset} = document.documentElement;
    dataset.theme = dataset.theme === 'dark' ? 'light' : 'dark';
    this.paint();
  }

  // The tools, and the keys: these of both pages and others.
  listen(others) {
    const colour = () => this.colourChosen();
    const nextColour = () => {
      const {options, selectedIndex} = $('colour');
      const order = [...options].slice(selectedIndex + 1).concat(...options);
      $('colour').selectedIndex = order.find(({disabled}) => !disabled).index;
      colour();
    };
    $('colour').addEventListener('change', colour);
    $('now').addEventListener('change', () => { this.stale = true; });
    $('layers').addEventListener('change', ({target}) => {
      if (target === $('lines')) this.linesChosen = target.checked;
      this.showLayers();
    });
    document.addEventListener('pointerdown', ({target}) => {
      if (!$('show').contains(target)) $('show').open = false;
    });
    $('pattern').addEventListener('click', () => this.togglePattern());
    // the pattern stands still
    const guard = (event) => { this.controls.enabled = !this.aim(event)?.onPattern; };
    for (const kind of ['pointerdown', 'wheel']) $('stage').addEventListener(kind, guard, {capture: true, passive: true});
    $('view').addEventListener('pointermove', (event) => this.point(event));
    $('view').addEventListener('pointerup', (event) => {
      if (event.pointerType === 'touch') this.point({clientX: event.clientX, clientY: event.clientY, buttons: 0});
    });
    $('view').addEventListener('pointerleave', ({pointerType}) => {
      if (pointerType === 'touch') return;
      this.place = this.pointed = undefined;
      this.stale = true;
    });
    $('fit').addEventListener('click', () => this.fit());
    $('theme').addEventListener('click', () => this.toggleTheme());

    const keys = {
      f: () => this.fit(), t: () => this.toggleTheme(), c: nextColour, u: () => this.togglePattern(),
      l: () => this.toggleLayer('lines'), b: () => this.toggleLayer('bodies'),
      Escape: () => { $('show').open = false; },
      w: () => this.turn(0, -0.1), s: () => this.turn(0, 0.1),
      a: () => this.turn(-0.1, 0), d: () => this.turn(0.1, 0),
      '+': () => this.turn(0, 0, 0.9), '=': () => this.turn(0, 0, 0.9), '-': () => this.turn(0, 0, 1.1),
      ...others,
    };
    document.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches('select, input.number')) return;
      if (event.key.startsWith('Arrow') && event.target.matches('input[type=range]:not(#scrub)')) return;
      if (event.key === ' ' && event.target.matches('button, input, summary')) return;
      const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
      if (!action || this.panes.length === 0) return;
      event.preventDefault();
      action(event.shiftKey ? 10 : 1);
    });
  }
}

// The stage of a page, in the colours of the person; none where the browser cannot draw.
function makeStage(Kind) {
  document.documentElement.dataset.theme = matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
  try {
    return new Kind();
  } catch {
    message('This browser shows no WebGL, which the page draws with.');
    return undefined;
  }
}
