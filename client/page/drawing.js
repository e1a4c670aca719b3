// What is simulated as a scene of three.js. Lengths in m, times in s.
'use strict';

const kRamp = ['#fcf7b9', '#fec98d', '#fe9d6c', '#f7705c', '#de4968', '#b73779', '#8c2981', '#641a80',
  '#51127c'];  // matplotlib's magma, its pale end for little
const kBalance = ['#3b4cc0', '#6f92f3', '#aac7fd', '#dddddd', '#f7b89c', '#e7745b', '#b40426'];  // Moreland's cool to warm
const kPanels = ['#66c2a5', '#fc8d62', '#8da0cb', '#e78ac3', '#a6d854', '#ffd92f', '#e5c494', '#b3b3b3'];  // ColorBrewer's Set2

const vector = (given) => new THREE.Vector3(given?.x ?? 0, given?.y ?? 0, given?.z ?? 0);
const linear = (colour) => new THREE.Color(colour).convertSRGBToLinear();
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function cornersOf({min, max}) {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
    new THREE.Vector3(k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z));
}

// A ramp in 256 steps, linear RGB.
const stepsOf = (ramp) => Float32Array.from({length: 256 * 3}, (_, k) => {
  const place = Math.floor(k / 3) / 255 * (ramp.length - 1);
  const from = Math.min(Math.floor(place), ramp.length - 2);
  const colour = new THREE.Color(ramp[from]).lerp(new THREE.Color(ramp[from + 1]), place - from);
  return colour.convertSRGBToLinear().toArray()[k % 3];
});
const kRampSteps = stepsOf(kRamp);
const kBalanceSteps = stepsOf(kBalance);

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

// Direction of a plane, and the point on it that is nearest to another one.
function surfaceOf(plane, place) {
  const normal = plane.normal ? vector(plane.normal).normalize() : new THREE.Vector3(0, 1, 0);
  const height = vector(plane.point_m).sub(place).dot(normal);
  return {normal, point: place.clone().addScaledVector(normal, height)};
}

// Where the view and the light come from: seen from the front, and to its right.
function frontOf(up) {
  const front = Math.abs(up.z) > 0.9 ? new THREE.Vector3(0, -1, 0) : new THREE.Vector3(0, 0, 1);
  return {front, right: up.clone().cross(front)};
}

// Round points, of so many pixels.
function dots(size) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 32;
  const drawing = canvas.getContext('2d');
  drawing.fillStyle = '#ffffff';
  drawing.arc(16, 16, 15, 0, 2 * Math.PI);
  drawing.fill();
  return new THREE.PointsMaterial(
    {size, sizeAttenuation: false, map: new THREE.CanvasTexture(canvas), alphaTest: 0.5});
}

// A body of triangles; each has its own corners, so that edges stay sharp where its neighbours turn away.
class Solid {
  constructor({positions_m, triangles, poses}) {
    this.triangles = new Uint32Array(bytesOf(triangles).buffer);
    this.times = poses?.times_s ?? [];
    this.positions = new Float32Array(bytesOf(poses?.positions_m ?? positions_m).buffer);
    this.count = this.positions.length / (3 * Math.max(1, this.times.length));
    this.geometry = new THREE.BufferGeometry();
    this.corners = new THREE.BufferAttribute(new Float32Array(3 * this.triangles.length), 3);
    this.geometry.setAttribute('position', this.corners);
    this.show(0);
  }

  // As it is at time t: between two poses, or in the first or the last.
  show(t) {
    const next = this.times.findIndex((time) => t < time);
    const from = Math.max(0, (next < 0 ? this.times.length : next) - 1);
    const to = next < 0 ? from : next;
    const share = to > from ? (t - this.times[from]) / (this.times[to] - this.times[from]) : 0;
    if (this.shown === from + share) return;
    this.shown = from + share;
    const {positions, count, corners: {array}} = this;
    this.triangles.forEach((vertex, i) => {
      for (let axis = 0; axis < 3; ++axis) {
        const start = positions[(3 * from + axis) * count + vertex];
        array[3 * i + axis] = start + share * (positions[(3 * to + axis) * count + vertex] - start);
      }
    });
    this.corners.needsUpdate = true;
    this.geometry.computeVertexNormals();
    this.geometry.computeBoundingSphere();
  }
}

// Those that move through poses; frames say where they are among these in this order.
const posedOf = (colliders) => colliders.filter(({mesh}) => mesh?.data?.poses?.times_s);

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
  } else if (collider.mesh?.data) {
    group.solid = new Solid(collider.mesh.data);
    add(group, group.solid.geometry, new THREE.Vector3());
  } else if (collider.plane) {
    const {normal, point} = surfaceOf(collider.plane, centre);
    const disc = add(group, new THREE.CircleBufferGeometry(reach, 96), point);
    disc.castShadow = false;
    disc.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), normal);
  }
  return group;
}

// What colours say of a particle. Around 0 where `balanced`, else from 0 on, the other way round where `reversed`.
// Where it is `recorded` the source may not have it, and the scale ends at a round number that few go beyond.
const percent = (value) => `${(100 * value).toPrecision(3)} %`;
const inUnits = (value, unit) => `${Number(value.toPrecision(3))} ${unit}`;
const kQuantities = {
  strain: {
    title: 'Strain, largest at a particle',
    text: percent,
    write: ({cloth}, out, positions) => cloth.writeLargestStrain(out, positions),
  },
  ...Object.fromEntries([['warp', 'Strain along the warp'], ['weft', 'Strain along the weft'],
    ['shear', 'Shear, sine of its angle']].map(([name, title]) => [name, {
    title,
    balanced: true,
    text: percent,
    write: ({cloth}, out, positions) => cloth.writeStrain(kStrains[name], out, positions),
  }])),
  speed: {
    title: 'Speed of a particle',
    text: (value) => `${value.toPrecision(3)} m/s`,
    write: (source, out, positions, frame) => source.writeSpeeds(out, frame),
  },
  pressure: {
    title: 'Pressure of bodies',
    text: (value) => `${Number((value / 1000).toFixed(3))} kPa`,
    recorded: true,
    write: (source, out, positions, frame) => source.writeValues('pressure', out, frame),
  },
  clearance: {
    title: 'Clearance from bodies',
    text: (value) => `${Number((value * 1000).toFixed(1))} mm`,
    recorded: true,
    reversed: true,
    write: (source, out, positions, frame) => source.writeValues('clearance', out, frame),
  },
  bending: {
    title: 'Bending energy for each area',
    text: (value) => `${digits(value)} J/m²`,
    write: ({cloth}, out, positions) => cloth.writeBending(out, positions),
  },
};
const rampOf = ({balanced, reversed}) => (balanced ? kBalance : reversed ? [...kRamp].reverse() : kRamp);

function roundUp(value) {
  if (!(value > 0)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((digit) => digit * power >= 0.999 * value);
}

// The round number that a hundredth of the positive values go beyond.
function roundMost(values) {
  const sorted = values.filter((value) => value > 0).sort();
  return roundUp(sorted[Math.floor(0.99 * (sorted.length - 1))]);
}
const largestOf = (values, atLeast = 0) => values.reduce((most, value) => Math.max(most, Math.abs(value)), atLeast);

// A recording, or a session, in a scene of its own. It says what there is ({name, particles, cloth, colliders,
// origin_m, gravity_m_per_s2, low_m, high_m}) and where the particles are (place, write, writeSpeeds, largest).
class Pane {
  constructor(source, box, up) {
    this.source = source;
    this.scene = new THREE.Scene();
    const centre = box.getCenter(new THREE.Vector3());
    const radius = box.getSize(new THREE.Vector3()).length() / 2;
    this.addLights(centre, radius, up);
    this.addCloth();
    this.addBodies(centre, radius);
    this.addGrid(box, up);
    this.values = new Float32Array(source.particles);
    this.hidden = new Set();  // names of sheets
    this.paint();
  }

  addLights(centre, radius, up) {
    this.sky = new THREE.HemisphereLight(0xffffff, 0x9a938c, 0.62);
    this.sky.position.copy(up);
    this.sun = new THREE.DirectionalLight(0xffffff, 0.68);
    const {front, right} = frontOf(up);
    this.sun.position.copy(centre).addScaledVector(up, 2.7 * radius)
      .addScaledVector(front, 1.2 * radius).addScaledVector(right, -0.9 * radius);
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
    const {particles, cloth, origin_m} = this.source;
    const attribute = () =>
      new THREE.BufferAttribute(new Float32Array(3 * particles), 3).setUsage(THREE.DynamicDrawUsage);
    this.position = attribute();
    this.normal = attribute();
    this.colour = attribute();

    const geometry = (index) => {
      const made = new THREE.BufferGeometry();
      made.setAttribute('position', this.position);
      made.setAttribute('normal', this.normal);
      made.setAttribute('color', this.colour);
      made.setIndex(new THREE.BufferAttribute(Uint32Array.from(index), 1));
      return made;
    };
    const surface = this.surface = geometry(cloth.triangles);
    cloth.panels.forEach(({first, triangle_count}, k) => surface.addGroup(3 * first, 3 * triangle_count, k));
    const options = {polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1};
    const material = (side, more) =>
      new THREE.MeshLambertMaterial({...options, side, shadowSide: THREE.DoubleSide, ...more});
    this.faces = [THREE.FrontSide, THREE.BackSide].map((side) => ({
      plain: material(side),
      coloured: material(side, {vertexColors: THREE.VertexColors}),
      panels: cloth.panels.map(() => material(side)),
    }));
    this.cloth = new THREE.Group();
    this.cloth.position.set(...origin_m);
    for (const {plain} of this.faces) {
      const mesh = new THREE.Mesh(surface, plain);
      mesh.castShadow = mesh.receiveShadow = true;
      this.cloth.add(mesh);
    }
    this.lines = new THREE.Group();
    for (const [lines, opacity] of [[cloth.threads, 0.25], [cloth.edges, 0.7], [cloth.folds, 0.9]]) {
      this.lines.add(new THREE.LineSegments(geometry(lines), new THREE.LineBasicMaterial({transparent: true, opacity})));
    }
    this.lines.visible = false;
    this.pins = new THREE.Points(geometry(cloth.pins), dots(8));
    this.held = new THREE.Points(geometry([0]), dots(16));
    this.held.material.depthTest = false;  // seen through folds
    this.held.visible = false;
    this.mark = markOf();
    this.cloth.add(this.lines, this.pins, this.held, this.mark);
    this.cloth.traverse((child) => { child.frustumCulled = false; });  // its bounds change with every frame
    this.scene.add(this.cloth);
  }

  // Without the sheets of these names.
  hideSheets(hidden) {
    this.hidden = hidden;
    const {cloth} = this.source;
    const parts = cloth.parts.filter(({sheet}) => !hidden.has(sheet.name));
    const panels = cloth.panels.filter(({sheet}) => !hidden.has(sheet.name));
    this.shown = panels.flatMap(({first, triangle_count}) => Array.from({length: triangle_count}, (_, k) => first + k));
    for (const [geometry, index] of [[this.surface, cloth.triangles], [this.flat?.surface, this.flat?.index]]) {
      if (!geometry) continue;
      geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(
        {length: 3 * this.shown.length}, (_, i) => index[3 * this.shown[Math.floor(i / 3)] + i % 3]), 1));
      geometry.clearGroups();
      let start = 0;
      for (const panel of panels) {
        geometry.addGroup(start, 3 * panel.triangle_count, cloth.panels.indexOf(panel));
        start += 3 * panel.triangle_count;
      }
    }
    const lines = (kind) => parts.flatMap((part) => (part instanceof kind ? part.lines : []));
    [lines(Lattice), lines(Mesh), parts.flatMap(({folds = []}) => folds)].forEach((index, k) =>
      this.lines.children[k].geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(index), 1)));
    this.pins.visible = hidden.size === 0;
  }

  get pattern() {
    if (!this.flat) {
      this.flat = new Pattern(this.source.cloth);
      this.paint();
      this.hideSheets(this.hidden);
    }
    return this.flat;
  }

  // The place on the cloth where a ray meets one of these meshes first: the triangle, and weights of its corners.
  placeAt(ray, meshes, others = []) {
    meshes[0].geometry.computeBoundingSphere();
    const [hit] = ray.intersectObjects([...meshes, ...others], true);
    if (!meshes.includes(hit?.object)) return undefined;
    const {a, b, c} = hit.face;
    const positions = meshes[0].geometry.getAttribute('position');
    const at = (i) => new THREE.Vector3().fromBufferAttribute(positions, i);
    const point = hit.object.worldToLocal(hit.point.clone());
    const weights = new THREE.Triangle(at(a), at(b), at(c)).getBarycoord(point, new THREE.Vector3()).toArray();
    return {triangle: this.shown?.[hit.faceIndex] ?? hit.faceIndex, weights};
  }

  // Marks a place in space and on the pattern; none where it is not given.
  markPlace(place) {
    this.mark.visible = false;
    if (this.flat) this.flat.mark.visible = false;
    if (!place || this.hidden.has(this.source.cloth.panelOf(place.triangle).sheet.name)) return;
    const corners = [0, 1, 2].map((k) => 3 * place.triangle + k);
    moveMark(this.mark, this.position.array, corners.map((i) => this.source.cloth.triangles[i]), place.weights);
    if (this.flat) {
      moveMark(this.flat.mark, this.flat.surface.getAttribute('position').array,
        corners.map((i) => this.flat.index[i]), place.weights);
    }
  }

  // What the colours say there.
  valueAt({triangle, weights}) {
    return weights.reduce((sum, weight, k) => sum + weight * this.values[this.source.cloth.triangles[3 * triangle + k]], 0);
  }

  // Marks the particle that a hand holds, if any.
  hold(particle) {
    this.held.visible = particle !== undefined;
    if (this.held.visible) this.held.geometry.setIndex([particle]);
  }

  addBodies(centre, radius) {
    // drawn a little behind its place, so that cloth that lies on it hides it
    this.bodyMaterial = new THREE.MeshLambertMaterial(
      {polygonOffset: true, polygonOffsetFactor: 4, polygonOffsetUnits: 4});
    const posed = posedOf(this.source.colliders);
    this.bodies = this.source.colliders.map((collider) => {
      const mesh = colliderMesh(collider, this.bodyMaterial, centre, 2.5 * radius);
      this.scene.add(mesh);
      return {mesh, path: collider.path, posed: posed.indexOf(collider)};
    });
  }

  // For scale: on the first plane, or else below everything.
  addGrid(box, up) {
    const size = box.getSize(new THREE.Vector3()).length();
    this.gridCell = 10 ** Math.floor(Math.log10(size / 4));
    const cells = 2 * Math.ceil(0.75 * size / this.gridCell);
    this.grid = new THREE.GridHelper(cells * this.gridCell, cells, 0xffffff, 0xffffff);
    Object.assign(this.grid.material, {vertexColors: THREE.NoColors, transparent: true, opacity: 0.55});
    this.scene.add(this.grid);

    const centre = box.getCenter(new THREE.Vector3());
    const ground = this.source.colliders.find(({plane}) => plane);
    if (ground) {
      const {normal, point} = surfaceOf(ground.plane, centre);
      this.grid.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), normal);
      this.grid.position.copy(point);
      return;
    }
    const lowest = Math.min(...cornersOf(box).map((corner) => corner.sub(centre).dot(up)));
    this.grid.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), up);
    this.grid.position.copy(centre).addScaledVector(up, lowest);
    const shade = new THREE.Mesh(new THREE.CircleBufferGeometry(0.75 * size, 64),
      new THREE.ShadowMaterial({opacity: 0.22}));
    shade.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), up);
    shade.position.copy(this.grid.position).addScaledVector(up, -1e-3 * size);
    shade.receiveShadow = true;
    this.scene.add(shade);
  }

  // In the colours of the theme.
  paint() {
    this.faces[0].plain.color.copy(linear(style('--cloth')));
    this.faces[1].plain.color.copy(linear(style('--cloth-back')));
    this.bodyMaterial.color.copy(linear(style('--body')));
    this.grid.material.color.copy(linear(style('--grid')));
    const [threads, edges, folds] = this.lines.children;
    for (const each of [threads, edges, this.flat?.lines]) each?.material.color.copy(linear(style('--lines')));
    for (const each of [folds, this.flat?.folds]) each?.material.color.copy(linear(style('--folds')));
    const points = [this.pins, this.held, this.mark, this.flat?.mark];
    for (const each of points) each?.material.color.copy(linear(style('--accent')));
  }

  // Goes to time t; between frames where `between`, else at the frame before.
  show(t, between, quantity) {
    const place = this.source.place(t);
    if (!between) place.share = 0;
    this.frame = place.frame;
    this.source.write(this.position.array, place);
    this.source.cloth.writeNormals(this.normal.array, this.position.array);
    kQuantities[quantity]?.write(this.source, this.values, this.position.array, place.frame);
    this.position.needsUpdate = this.normal.needsUpdate = true;
    for (const {mesh, path, posed} of this.bodies) {
      mesh.position.copy(pathOffset(path, t));
      mesh.solid?.show(this.source.poseTime(posed, t, place));
    }
  }

  // The colours of panels, by their names.
  paintPanels(colours) {
    this.source.cloth.panels.forEach(({name}, k) => {
      const colour = linear(colours.get(name));
      this.faces[0].panels[k].color.copy(colour);
      this.faces[1].panels[k].color.copy(colour).lerp(linear('#808080'), 0.45);
    });
  }

  colourBy(quantity, most) {
    const known = kQuantities[quantity];
    const materialOf = ({plain, coloured, panels}) => (known ? coloured : quantity ? panels : plain);
    this.faces.forEach((face, k) => { this.cloth.children[k].material = materialOf(face); });
    if (this.flat) {
      this.flat.mesh.material = materialOf(this.flat);
      this.flat.plain.color.copy(this.faces[0].plain.color);
      this.flat.panels.forEach(({color}, k) => color.copy(this.faces[0].panels[k].color));
    }
    if (!known) return;
    const out = this.colour.array;
    const [steps, middle] = known.balanced ? [kBalanceSteps, 127.5] : [kRampSteps, 0];
    for (let i = 0; i < this.values.length; ++i) {
      const share = most > 0 ? this.values[i] / most : 0;
      const place = Math.round(middle + (255 - middle) * (known.reversed ? 1 - share : share));
      const step = 3 * Math.min(255, Math.max(0, place));
      out[3 * i] = steps[step];
      out[3 * i + 1] = steps[step + 1];
      out[3 * i + 2] = steps[step + 2];
    }
    this.colour.needsUpdate = true;
    this.flat?.take(out);
  }
}
