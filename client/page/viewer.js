// The page of `weft view`: shows recordings side by side, at one simulated time, through one camera.
// Lengths in m, times in s.
'use strict';

class Viewer {
  constructor() {
    const canvas = $('view');
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
    this.renderer.gammaOutput = true;
    this.renderer.gammaFactor = 2.2;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.renderer.setScissorTest(true);
    this.panes = [];
    this.ticks = [0];
    this.time = 0;
    this.playing = false;
    this.quantity = '';
    this.stale = true;
    this.fitted = true;  // nobody has turned the view yet
    new ResizeObserver(() => this.resize()).observe($('stage'));
  }

  async open(figure) {
    this.pause();
    this.panes = [];
    message('Unpacking the frames …');
    const recordings = [];
    for (const index of figure.recordings) recordings.push(await recordingAt(index));
    message('');

    const box = new THREE.Box3();
    for (const {low_m, high_m} of recordings) {
      box.expandByPoint(new THREE.Vector3(...low_m)).expandByPoint(new THREE.Vector3(...high_m));
    }
    const reach = box.getSize(new THREE.Vector3()).length();
    for (const {colliders} of recordings) {
      for (const collider of colliders) {
        if (collider.plane) continue;
        const bounds = new THREE.Box3().setFromObject(colliderMesh(collider));
        if (bounds.getSize(new THREE.Vector3()).length() < 4 * reach) box.union(bounds);
      }
    }
    const gravity = vector(recordings[0].gravity_m_per_s2);
    this.up = gravity.length() > 0 ? gravity.negate().normalize() : new THREE.Vector3(0, 1, 0);
    this.box = box;
    this.panes = recordings.map((recording) => new Pane(recording, box, this.up));
    for (const pane of this.panes) pane.lattice.visible = $('lattice').getAttribute('aria-pressed') === 'true';

    const times = recordings.flatMap(({time_s}) => time_s).sort((a, b) => a - b);
    this.ticks = times.filter((t, k) => k === 0 || t - times[k - 1] > kSameTime);
    $('scrub').max = this.ticks.length - 1;
    this.layOut(recordings);
    showFacts(figure, recordings, this.panes[0].gridCell);
    this.makeCamera();
    this.goTo(this.ticks[0]);
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

  layOut(recordings) {
    $('names').replaceChildren(...recordings.map(({name}) => {
      const label = document.createElement('div');
      label.append(name, document.createElement('small'));
      return label;
    }));
  }

  goTo(t) {
    const last = this.ticks[this.ticks.length - 1];
    this.time = Math.min(Math.max(t, this.ticks[0]), last);
    this.stale = true;
  }

  step(by) {
    this.pause();
    const index = indexAt(this.ticks, this.time) + by;
    this.goTo(this.ticks[Math.min(Math.max(index, 0), this.ticks.length - 1)]);
  }

  play() {
    if (this.time >= this.ticks[this.ticks.length - 1]) this.goTo(this.ticks[0]);
    this.playing = true;
    this.last = undefined;
    showPlaying(true);
  }

  // Ends at a frame, not between two.
  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.goTo(this.ticks[indexAt(this.ticks, this.time)]);
    showPlaying(false);
  }

  tick(now) {
    if (this.playing) {
      this.goTo(this.time + (this.last === undefined ? 0 : (now - this.last) / 1000 * Number($('speed').value)));
      this.last = now;
      if (this.time >= this.ticks[this.ticks.length - 1]) {
        if ($('repeat').checked) this.goTo(this.ticks[0]); else this.pause();
      }
    }
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
    showTime(this);
  }

  // One scale for all panes, so that equal colours are equal values.
  colour() {
    $('legend').hidden = !this.quantity;
    let most = 0;
    if (this.quantity) {
      for (const {recording, values} of this.panes) {
        const largest = $('now').checked ? values.reduce((a, b) => Math.max(a, b), 0)
          : recording.largest(this.quantity);
        most = Math.max(most, largest);
      }
      $('quantity').textContent = kQuantities[this.quantity].title;
      $('most').textContent = kQuantities[this.quantity].text(most);
    }
    for (const pane of this.panes) pane.colourBy(this.quantity, most);
  }

  paint() {
    for (const pane of this.panes) pane.paint();
    this.stale = true;
  }
}

const unpacked = [];
async function recordingAt(index) {
  if (!unpacked[index]) {
    const facts = page.recordings[index];
    const bytes = await inflate(`frames-${index}`);
    unpacked[index] = new Recording(facts, unpack(bytes, facts.time_s.length, 3 * facts.particles));
  }
  return unpacked[index];
}

function message(text) {
  $('message').textContent = text;
  $('message').hidden = !text;
}

function showPlaying(playing) {
  $('play').classList.toggle('playing', playing);
  $('play').setAttribute('aria-label', playing ? 'Pause' : 'Play');
}

// ---- facts

const digits = (value) => (value !== 0 && Math.abs(value) < 1e-3 ? value.toExponential(2) : value.toPrecision(4));

// Rows of the panel that follow the time: label, and text of a recording's frame.
const kCurrent = [
  ['frame', (r, k) => `${r.first_frame + k} of ${r.first_frame + r.time_s.length - 1}`],
  ['time', (r, k) => `${r.time_s[k].toFixed(3)} s`],
  ['largest strain', (r, k) => r.stats && `${(100 * r.stats.largest_strain[k]).toPrecision(3)} %`],
  ['kinetic energy', (r, k) => r.stats && `${digits(r.stats.kinetic_energy_j[k])} J`],
  ['potential energy', (r, k) => r.stats && `${digits(r.stats.potential_energy_j[k])} J`],
  ['substeps', (r, k) => r.stats && `${r.stats.substep_count[k]}`],
];
let currentCells = [];

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

function showFacts(figure, recordings, gridCell) {
  $('caption').textContent = figure.caption;
  $('caption').hidden = !figure.caption;
  const head = document.createElement('thead');
  head.append(row(cell('td', ''), ...recordings.map(({name}) => cell('th', name, {scope: 'col'}))));
  const body = document.createElement('tbody');
  const group = (name) => body.append(row(cell('th', name, {scope: 'rowgroup', colspan: recordings.length + 1})));

  group('Frame shown');
  currentCells = kCurrent.map(([label]) => {
    const cells = recordings.map(() => cell('td', ''));
    body.append(row(cell('th', label, {scope: 'row'}), ...cells));
    return cells;
  });

  // rows in the order in which they first appear
  const groups = new Map();
  for (const {facts} of recordings) {
    for (const {group: name, rows} of facts) {
      if (!groups.has(name)) groups.set(name, new Set());
      for (const [label] of rows) groups.get(name).add(label);
    }
  }
  const find = ({facts}, name, label) => facts.filter(({group: known}) => known === name)
    .flatMap(({rows}) => rows).find(([known]) => known === label)?.[1] ?? '';
  for (const [name, labels] of groups) {
    group(name);
    for (const label of labels) {
      const texts = recordings.map((recording) => find(recording, name, label));
      const differs = new Set(texts).size > 1;
      const cells = differs ? texts.map((text) => cell('td', text)) : [cell('td', texts[0], {colspan: texts.length})];
      const made = row(cell('th', label, {scope: 'row'}), ...cells);
      made.className = differs ? 'differs' : '';
      body.append(made);
    }
  }
  $('facts').replaceChildren(head, body);

  const error = Math.max(...recordings.map(({quantum_m}) => quantum_m / 2));
  const grid = gridCell >= 1 ? `${gridCell} m` : `${Number((1000 * gridCell).toPrecision(2))} mm`;
  $('precision').textContent = `Positions on this page are within ${(1e6 * error).toPrecision(2)} µm of the ` +
    `recording along each axis; strain and speed are computed from them. While it plays, positions between ` +
    `two frames are interpolated. The grid has cells of ${grid}.`;
}

function showTime(viewer) {
  const index = indexAt(viewer.ticks, viewer.time);
  $('scrub').value = index;
  const last = viewer.ticks[viewer.ticks.length - 1];
  const clock = `${viewer.time.toFixed(3)} / ${last.toFixed(3)} s`;
  $('clock').textContent = clock;
  $('scrub').setAttribute('aria-valuetext', clock);
  viewer.panes.forEach(({recording, frame}, pane) => {
    kCurrent.forEach(([, text], k) => {
      currentCells[k][pane].textContent = (text(recording, frame) ?? 'not recorded').replaceAll(' ', '\u00a0');
    });
    const strain = recording.stats && (100 * recording.stats.largest_strain[frame]).toPrecision(3);
    $('names').children[pane].lastChild.textContent = `frame ${recording.first_frame + frame}` +
      (strain ? `, strain up to ${strain}\u00a0%` : '');
  });
}

// ---- control

function makeFigures(viewer) {
  $('figures').hidden = page.figures.length < 2;
  const buttons = page.figures.map((figure) => {
    const button = cell('button', figure.title);
    button.addEventListener('click', () => choose(button, figure));
    return button;
  });
  const choose = async (button, figure) => {
    for (const other of buttons) other.setAttribute('aria-current', other === button);
    await viewer.open(figure);
    if (!matchMedia('(prefers-reduced-motion: reduce)').matches) viewer.play();
  };
  $('figures').append(...buttons);
  return choose(buttons[0], page.figures[0]);
}

function toggleLattice(viewer) {
  const shown = $('lattice').getAttribute('aria-pressed') !== 'true';
  $('lattice').setAttribute('aria-pressed', shown);
  for (const pane of viewer.panes) pane.lattice.visible = shown;
  viewer.stale = true;
}

function setTheme(viewer, theme) {
  document.documentElement.dataset.theme = theme;
  viewer.paint();
}

function listen(viewer) {
  const toggle = () => (viewer.playing ? viewer.pause() : viewer.play());
  const end = () => viewer.step(Infinity);
  const start = () => viewer.step(-Infinity);
  const theme = () => setTheme(viewer, document.documentElement.dataset.theme === 'dark' ? 'light' : 'dark');
  const colour = () => {
    viewer.quantity = $('colour').value === 'cloth' ? '' : $('colour').value;
    viewer.stale = true;
  };
  const nextColour = () => {
    $('colour').selectedIndex = ($('colour').selectedIndex + 1) % $('colour').length;
    colour();
  };
  $('play').addEventListener('click', toggle);
  $('first').addEventListener('click', start);
  $('back').addEventListener('click', () => viewer.step(-1));
  $('forward').addEventListener('click', () => viewer.step(1));
  $('scrub').addEventListener('input', () => {
    viewer.pause();
    viewer.goTo(viewer.ticks[Number($('scrub').value)]);
  });
  $('colour').addEventListener('change', colour);
  $('now').addEventListener('change', () => { viewer.stale = true; });
  $('lattice').addEventListener('click', () => toggleLattice(viewer));
  $('fit').addEventListener('click', () => viewer.fit());
  $('theme').addEventListener('click', theme);

  const keys = {
    ' ': toggle, Home: start, End: end,
    ArrowLeft: (frames) => viewer.step(-frames), ArrowRight: (frames) => viewer.step(frames),
    f: () => viewer.fit(), l: () => toggleLattice(viewer), t: theme, c: nextColour,
    w: () => viewer.turn(0, -0.1), s: () => viewer.turn(0, 0.1),
    a: () => viewer.turn(-0.1, 0), d: () => viewer.turn(0.1, 0),
    '+': () => viewer.turn(0, 0, 0.9), '=': () => viewer.turn(0, 0, 0.9), '-': () => viewer.turn(0, 0, 1.1),
  };
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches('select')) return;
    if (event.key === ' ' && event.target.matches('button, input, summary')) return;
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action(event.shiftKey ? 10 : 1);
  });
}

async function main() {
  document.title = page.title;
  $('title').textContent = page.title;
  $('ramp').style.background = `linear-gradient(90deg, ${kRamp.join(', ')})`;
  document.documentElement.dataset.theme = matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light';
  if (typeof DecompressionStream === 'undefined') {
    message('This browser is too old for the page: it lacks DecompressionStream (2023).');
    return;
  }
  let viewer;
  try {
    viewer = new Viewer();
  } catch {
    message('This browser shows no WebGL, which the page draws with.');
    return;
  }
  listen(viewer);
  await makeFigures(viewer);
  document.body.dataset.state = 'ready';
  requestAnimationFrame((now) => viewer.tick(now));
}

main().catch((error) => message(`The page is damaged: ${error.message}`));
