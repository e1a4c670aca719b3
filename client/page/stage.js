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
    for (const pane of this.panes) pane.lines.visible = isPressed($('lines'));
    this.namePanels();
    this.layOut();
    this.makeCamera();
  }

  // Around the particles and the bodies, as far as these are not much larger.
  boxOf(sources) {
    const box = new THREE.Box3();
    for (const {low_m, high_m} of sources) {
      box.expandByPoint(new THREE.Vector3(...low_m)).expandByPoint(new THREE.Vector3(...high_m));
    }
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

  // From the front, a little from the right and above, as near as the box allows.
  fit() {
    const centre = this.box.getCenter(new THREE.Vector3());
    const radius = this.box.getSize(new THREE.Vector3()).length() / 2;
    const {front, right} = frontOf(this.up);
    const from = front.addScaledVector(right, 0.55).addScaledVector(this.up, 0.45).normalize();
    const x = this.up.clone().cross(from).normalize();
    const y = from.clone().cross(x);
    const {width, height} = this.split();
    const tangent = 0.9 * Math.tan(this.camera.fov / 2 * Math.PI / 180);
    let distance = 0;
    for (const corner of cornersOf(this.box)) {
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

  // The grid of panes whose shorter side is longest.
  split() {
    const {clientWidth, clientHeight} = $('stage');
    const count = Math.max(1, this.panes.length);
    let best;
    for (let columns = 1; columns <= count; ++columns) {
      const rows = Math.ceil(count / columns);
      const shape = {columns, rows, width: clientWidth / columns, height: clientHeight / rows};
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
    for (const pane of this.panes) pane.show(this.time, this.playing, this.quantity);
    this.colour();

    const {clientWidth, clientHeight} = $('stage');
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    const {columns, rows, width, height} = this.split();
    const size = this.renderer.getSize(new THREE.Vector2());
    if (size.x !== clientWidth || size.y !== clientHeight) this.renderer.setSize(clientWidth, clientHeight, false);
    $('names').style.gridTemplate = `repeat(${rows}, 1fr) / repeat(${columns}, 1fr)`;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.panes.forEach((pane, k) => {
      $('names').children[k].className = `${k % columns > 0 ? 'right' : ''} ${k >= columns ? 'below' : ''}`;
      const left = (k % columns) * width;
      const bottom = clientHeight - (Math.floor(k / columns) + 1) * height;
      this.renderer.setViewport(left, bottom, width, height);
      this.renderer.setScissor(left, bottom, width, height);
      this.renderer.render(pane.scene, this.camera);
    });
    this.drawn();
  }

  // One scale for all panes, so that equal colours are equal values.
  colour() {
    const known = kQuantities[this.quantity];
    $('legend').hidden = !this.quantity;
    $('panels').hidden = !this.quantity || known;
    for (const id of ['scale', 'now-label']) $(id).hidden = !known;
    $('quantity').textContent = known?.title ?? 'Panels';
    let most = 0;
    if (known) {
      for (const {source, values} of this.panes) {
        most = Math.max(most, $('now').checked ? largestOf(values) : source.largest(this.quantity, values));
      }
      $('ramp').style.background = `linear-gradient(90deg, ${(known.balanced ? kBalance : kRamp).join(', ')})`;
      $('least').textContent = known.balanced ? `−${known.text(most)}` : '0';
      $('most').textContent = known.text(most);
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

  paint() {
    for (const pane of this.panes) pane.paint();
    this.stale = true;
  }

  toggleLines() {
    const shown = !isPressed($('lines'));
    $('lines').setAttribute('aria-pressed', shown);
    for (const pane of this.panes) pane.lines.visible = shown;
    this.stale = true;
  }

  toggleTheme() {
    const {dataset} = document.documentElement;
    dataset.theme = dataset.theme === 'dark' ? 'light' : 'dark';
    this.paint();
  }

  // The tools, and the keys: these of both pages and others.
  listen(others) {
    const colour = () => {
      this.quantity = $('colour').value === 'cloth' ? '' : $('colour').value;
      this.stale = true;
    };
    const nextColour = () => {
      const {options, selectedIndex} = $('colour');
      const order = [...options].slice(selectedIndex + 1).concat(...options);
      $('colour').selectedIndex = order.find(({disabled}) => !disabled).index;
      colour();
    };
    $('colour').addEventListener('change', colour);
    $('now').addEventListener('change', () => { this.stale = true; });
    $('lines').addEventListener('click', () => this.toggleLines());
    $('fit').addEventListener('click', () => this.fit());
    $('theme').addEventListener('click', () => this.toggleTheme());

    const keys = {
      f: () => this.fit(), l: () => this.toggleLines(), t: () => this.toggleTheme(), c: nextColour,
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
