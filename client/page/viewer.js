// The page of `weft view`: shows recordings side by side, at one simulated time, through one camera.
// Lengths in m, times in s.
'use strict';

const $ = (id) => document.getElementById(id);
const page = JSON.parse($('page').textContent);
const kSameTime = 1e-9;
const kRamp = ['#3288bd', '#66c2a5', '#abdda4', '#e6f598', '#fee08b', '#fdae61', '#f46d43', '#d53e4f',
  '#9e0142'];  // ColorBrewer's Spectral

// ---- recordings

async function inflate(id) {
  const text = atob($(id).textContent.trim());
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Positions as whole numbers of the quantum: x, y, z of particle 0, of particle 1 ... of every frame.
// client/page/packed_frames.h says how they are packed.
function unpack(bytes, frames, values) {
  const numbers = new Int32Array(frames * values);
  for (let frame = 0; frame < frames; ++frame) {
    const at = 4 * frame * values;
    const out = frame * values;
    for (let i = 0; i < values; ++i) {
      const zigzag = bytes[at + i] | (bytes[at + values + i] << 8) |
        (bytes[at + 2 * values + i] << 16) | (bytes[at + 3 * values + i] << 24);
      const before = frame > 0 ? numbers[out - values + i] : 0;
      numbers[out + i] = before + ((zigzag >>> 1) ^ -(zigzag & 1));
    }
  }
  return numbers;
}

// Index of the last time that is not after t; 0 where all are.
function indexAt(times, t) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t + kSameTime) low = middle; else high = middle - 1;
  }
  return low;
}

// What the page says of a recording, with its frames.
class Recording {
  constructor(facts, numbers) {
    Object.assign(this, facts);
    this.numbers = numbers;
    this.values = 3 * this.particles;
    this.most = {};  // largest value of a quantity over all frames
  }

  // Where between two frames t lies.
  place(t) {
    const frame = indexAt(this.time_s, t);
    const next = Math.min(frame + 1, this.time_s.length - 1);
    const step = this.time_s[next] - this.time_s[frame];
    return {frame, next, share: step > 0 ? Math.min(1, Math.max(0, (t - this.time_s[frame]) / step)) : 0};
  }

  // Positions relative to origin_m.
  write(positions, {frame, next, share}) {
    const a = frame * this.values;
    const b = next * this.values;
    for (let i = 0; i < this.values; ++i) {
      const from = this.numbers[a + i];
      positions[i] = (from + (this.numbers[b + i] - from) * share) * this.quantum_m;
    }
  }

  // Speed of every particle, m/s, on the way from the frame before.
  writeSpeeds(out, _, frame) {
    const before = Math.max(frame - 1, 0);
    const step = this.time_s[frame] - this.time_s[before];
    const scale = step > 0 ? this.quantum_m / step : 0;
    for (let i = 0, a = frame * this.values, b = before * this.values; i < this.particles; ++i, a += 3, b += 3) {
      out[i] = scale * Math.hypot(this.numbers[a] - this.numbers[b],
        this.numbers[a + 1] - this.numbers[b + 1], this.numbers[a + 2] - this.numbers[b + 2]);
    }
  }

  // Largest strain of a particle's stretch connections, (l - L) / L; 0 where none is stretched.
  writeStrains(out, p) {
    out.fill(0);
    for (const {first_particle, rows, columns, spacing_m} of this.sheets) {
      const stretch = (i, j) => {
        const length = Math.hypot(p[3 * i] - p[3 * j], p[3 * i + 1] - p[3 * j + 1], p[3 * i + 2] - p[3 * j + 2]);
        const strain = length / spacing_m - 1;
        if (strain > out[i]) out[i] = strain;
        if (strain > out[j]) out[j] = strain;
      };
      for (let row = 0; row < rows; ++row) {
        for (let column = 0; column < columns; ++column) {
          const i = first_particle + row * columns + column;
          if (column + 1 < columns) stretch(i, i + 1);
          if (row + 1 < rows) stretch(i, i + columns);
        }
      }
    }
  }

  largest(quantity) {
    if (!(quantity in this.most)) {
      const positions = new Float32Array(this.values);
      const values = new Float32Array(this.particles);
      this.most[quantity] = 0;
      for (let frame = 0; frame < this.time_s.length; ++frame) {
        this.write(positions, {frame, next: frame, share: 0});
        kQuantities[quantity].write(this, values, positions, frame);
        for (const value of values) if (value > this.most[quantity]) this.most[quantity] = value;
      }
    }
    return this.most[quantity];
  }
}

const kQuantities = {
  strain: {
    title: 'Strain, largest at a particle',
    text: (value) => `${(100 * value).toPrecision(3)} %`,
    write: (recording, out, positions, frame) => recording.writeStrains(out, positions, frame),
  },
  speed: {
    title: 'Speed of a particle',
    text: (value) => `${value.toPrecision(3)} m/s`,
    write: (recording, out, positions, frame) => recording.writeSpeeds(out, positions, frame),
  },
};

// ---- drawing

const vector = (given) => new THREE.Vector3(given?.x ?? 0, given?.y ?? 0, given?.z ?? 0);
const linear = (colour) => new THREE.Color(colour).convertSRGBToLinear();
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function cornersOf({min, max}) {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
    new THREE.Vector3(k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z));
}

// The ramp in 256 steps, linear RGB.
const kRampSteps = Float32Array.from({length: 256 * 3}, (_, k) => {
  const place = Math.floor(k / 3) / 255 * (kRamp.length - 1);
  const from = Math.min(Math.floor(place), kRamp.length - 2);
  const colour = new THREE.Color(kRamp[from]).lerp(new THREE.Color(kRamp[from + 1]), place - from);
  return colour.convertSRGBToLinear().toArray()[k % 3];
});

function pathOffset(path, t) {
  if (!path?.length) return vector();
  const time = (k) => path[k].time_s ?? 0;
  if (t <= time(0)) return vector(path[0].offset_m);
  for (let k = 1; k < path.length; ++k) {
    if (t < time(k)) {
      const share = (t - time(k - 1)) / (time(k) - time(k - 1));
      return vector(path[k - 1].offset_m).lerp(vector(path[k].offset_m), share);
    }
  }
  return vector(path[path.length - 1].offset_m);
}

// The shape of a collider as a mesh where it starts; a plane is shown as far as `reach`.
function colliderMesh(collider, material, centre, reach) {
  const add = (group, geometry, at) => {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.position.copy(at);
    mesh.castShadow = mesh.receiveShadow = true;
    group.add(mesh);
    return mesh;
  };
  const group = new THREE.Group();
  if (collider.sphere) {
    add(group, new THREE.SphereBufferGeometry(collider.sphere.radius_m, 96, 64), vector(collider.sphere.center_m));
  } else if (collider.box) {
    const {center_m, half_size_m, rotation} = collider.box;
    const mesh = add(group, new THREE.BoxBufferGeometry(2 * half_size_m.x, 2 * half_size_m.y, 2 * half_size_m.z),
      vector(center_m));
    if (rotation) {
      mesh.quaternion.set(rotation.x ?? 0, rotation.y ?? 0, rotation.z ?? 0, rotation.w ?? 0).normalize();
    }
  } else if (collider.capsule) {
    const {radius_m, start_m, end_m} = collider.capsule;
    const start = vector(start_m);
    const end = vector(end_m);
    for (const at of [start, end]) add(group, new THREE.SphereBufferGeometry(radius_m, 64, 32), at);
    const axis = end.clone().sub(start);
    if (axis.length() > 0) {
      const side = add(group, new THREE.CylinderBufferGeometry(radius_m, radius_m, axis.length(), 64, 1, true),
        start.clone().lerp(end, 0.5));
      side.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), axis.normalize());
    }
  } else if (collider.plane) {
    const normal = collider.plane.normal ? vector(collider.plane.normal).normalize() : new THREE.Vector3(0, 1, 0);
    const point = vector(collider.plane.point_m);
    const under = centre.clone().addScaledVector(normal, point.sub(centre).dot(normal));
    const disc = add(group, new THREE.CircleBufferGeometry(reach, 96), under);
    disc.castShadow = false;
    disc.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
  }
  return group;
}

// One recording in a scene of its own.
class Pane {
  constructor(recording, box, up) {
    this.recording = recording;
    this.scene = new THREE.Scene();
    const centre = box.getCenter(new THREE.Vector3());
    const radius = box.getSize(new THREE.Vector3()).length() / 2;
    this.addLights(centre, radius, up);
    this.addCloth();
    this.addBodies(centre, radius);
    this.addGrid(box, up);
    this.values = new Float32Array(recording.particles);
    this.paint();
  }

  addLights(centre, radius, up) {
    this.sky = new THREE.HemisphereLight(0xffffff, 0x9a938c, 0.62);
    this.sky.position.copy(up);
    this.sun = new THREE.DirectionalLight(0xffffff, 0.68);
    this.sun.position.copy(centre).addScaledVector(new THREE.Vector3(-0.9, 1.1, 1.2).addScaledVector(up, 1.6), radius);
    this.sun.target.position.copy(centre);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.bias = -0.0015;
    this.sun.shadow.radius = 3;
    Object.assign(this.sun.shadow.camera,
      {left: -radius, right: radius, top: radius, bottom: -radius, near: 0.1 * radius, far: 6 * radius});
    this.scene.add(this.sky, this.sun, this.sun.target);
  }

  addCloth() {
    const {particles, sheets, origin_m} = this.recording;
    const attribute = () =>
      new THREE.BufferAttribute(new Float32Array(3 * particles), 3).setUsage(THREE.DynamicDrawUsage);
    this.position = attribute();
    this.normal = attribute();
    this.colour = attribute();

    const cells = [];
    const threads = [];
    const pins = [];
    for (const {first_particle, rows, columns, pinned} of sheets) {
      for (const index of pinned) pins.push(first_particle + index);
      for (let row = 0; row < rows; ++row) {
        for (let column = 0; column < columns; ++column) {
          const i = first_particle + row * columns + column;
          const right = column + 1 < columns;
          const below = row + 1 < rows;
          if (right) threads.push(i, i + 1);
          if (below) threads.push(i, i + columns);
          if (right && below) cells.push(i, i + columns, i + columns + 1, i, i + columns + 1, i + 1);
        }
      }
    }
    const geometry = (index) => {
      const made = new THREE.BufferGeometry();
      made.setAttribute('position', this.position);
      made.setAttribute('normal', this.normal);
      made.setAttribute('color', this.colour);
      made.setIndex(index);
      return made;
    };
    const surface = geometry(cells);
    const options = {polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1};
    this.faces = [THREE.FrontSide, THREE.BackSide].map((side) => ({
      plain: new THREE.MeshLambertMaterial({...options, side, shadowSide: THREE.DoubleSide}),
      coloured: new THREE.MeshLambertMaterial(
        {...options, side, shadowSide: THREE.DoubleSide, vertexColors: THREE.VertexColors}),
    }));
    this.cloth = new THREE.Group();
    this.cloth.position.set(...origin_m);
    for (const {plain} of this.faces) {
      const mesh = new THREE.Mesh(surface, plain);
      mesh.castShadow = mesh.receiveShadow = true;
      this.cloth.add(mesh);
    }
    this.lattice = new THREE.LineSegments(geometry(threads),
      new THREE.LineBasicMaterial({transparent: true, opacity: 0.25}));
    this.lattice.visible = false;
    this.pins = new THREE.Points(geometry(pins), new THREE.PointsMaterial({size: 7, sizeAttenuation: false}));
    this.cloth.add(this.lattice, this.pins);
    for (const child of this.cloth.children) child.frustumCulled = false;  // its bounds change with every frame
    this.scene.add(this.cloth);
  }

  addBodies(centre, radius) {
    // drawn a little behind its place, so that cloth that lies on it hides it
    this.bodyMaterial = new THREE.MeshLambertMaterial({side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 4, polygonOffsetUnits: 4});
    this.bodies = this.recording.colliders.map((collider) => {
      const mesh = colliderMesh(collider, this.bodyMaterial, centre, 2.5 * radius);
      this.scene.add(mesh);
      return {mesh, path: collider.path};
    });
  }

  // For scale, below everything.
  addGrid(box, up) {
    const size = box.getSize(new THREE.Vector3()).length();
    const cell = 10 ** Math.floor(Math.log10(size / 4));
    this.gridCell = cell;
    const cells = 2 * Math.ceil(0.75 * size / cell);
    this.grid = new THREE.GridHelper(cells * cell, cells, 0xffffff, 0xffffff);
    Object.assign(this.grid.material, {vertexColors: THREE.NoColors, transparent: true, opacity: 0.55});
    this.grid.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), up);
    const centre = box.getCenter(new THREE.Vector3());
    const lowest = Math.min(...cornersOf(box).map((corner) => corner.sub(centre).dot(up)));
    const floor = centre.clone().addScaledVector(up, lowest);
    this.grid.position.copy(floor);
    this.shade = new THREE.Mesh(new THREE.CircleBufferGeometry(0.75 * size, 64),
      new THREE.ShadowMaterial({opacity: 0.22}));
    this.shade.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), up);
    this.shade.position.copy(floor).addScaledVector(up, -1e-3 * size);
    this.shade.receiveShadow = true;
    const hasGround = this.recording.colliders.some(({plane}) => plane);
    if (!hasGround) this.scene.add(this.grid, this.shade);
  }

  // In the colours of the theme.
  paint() {
    this.faces[0].plain.color.copy(linear(style('--cloth')));
    this.faces[1].plain.color.copy(linear(style('--cloth-back')));
    this.bodyMaterial.color.copy(linear(style('--body')));
    this.grid.material.color.copy(linear(style('--grid')));
    this.lattice.material.color.copy(linear(style('--lattice')));
    this.pins.material.color.copy(linear(style('--accent')));
  }

  // Goes to time t; between frames where `between`, else at the frame before.
  show(t, between, quantity) {
    const place = this.recording.place(t);
    if (!between) place.share = 0;
    this.frame = place.frame;
    this.recording.write(this.position.array, place);
    this.writeNormals();
    if (quantity) kQuantities[quantity].write(this.recording, this.values, this.position.array, place.frame);
    this.position.needsUpdate = this.normal.needsUpdate = true;
    for (const {mesh, path} of this.bodies) mesh.position.copy(pathOffset(path, t));
  }

  // Across the two diagonals of a particle's neighbours.
  writeNormals() {
    const p = this.position.array;
    const n = this.normal.array;
    for (const {first_particle, rows, columns} of this.recording.sheets) {
      for (let row = 0; row < rows; ++row) {
        for (let column = 0; column < columns; ++column) {
          const i = 3 * (first_particle + row * columns + column);
          const left = column > 0 ? i - 3 : i;
          const right = column + 1 < columns ? i + 3 : i;
          const above = row > 0 ? i - 3 * columns : i;
          const below = row + 1 < rows ? i + 3 * columns : i;
          const ux = p[right] - p[left], uy = p[right + 1] - p[left + 1], uz = p[right + 2] - p[left + 2];
          const vx = p[below] - p[above], vy = p[below + 1] - p[above + 1], vz = p[below + 2] - p[above + 2];
          const x = vy * uz - vz * uy, y = vz * ux - vx * uz, z = vx * uy - vy * ux;
          const length = Math.hypot(x, y, z) || 1;
          n[i] = x / length;
          n[i + 1] = y / length;
          n[i + 2] = z / length;
        }
      }
    }
  }

  colourBy(quantity, most) {
    this.faces.forEach(({plain, coloured}, k) => {
      this.cloth.children[k].material = quantity ? coloured : plain;
    });
    if (!quantity) return;
    const out = this.colour.array;
    for (let i = 0; i < this.values.length; ++i) {
      const step = 3 * Math.min(255, most > 0 ? Math.round(255 * this.values[i] / most) : 0);
      out[3 * i] = kRampSteps[step];
      out[3 * i + 1] = kRampSteps[step + 1];
      out[3 * i + 2] = kRampSteps[step + 2];
    }
    this.colour.needsUpdate = true;
  }
}

// ---- the page

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
    const front = Math.abs(this.up.z) > 0.9 ? new THREE.Vector3(0, -1, 0) : new THREE.Vector3(0, 0, 1);
    const right = this.up.clone().cross(front);
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
