// The panels of a cloth as they were cut, side by side. Lengths in m.
'use strict';

class Pattern {
  constructor(cloth) {
    this.cloth = cloth;
    const places = [];  // as they are given
    const outlines = [];
    const folds = [];
    const folded = new Set(pairsOf(cloth.folds).map(keyOf));
    const isFolded = (edge) => folded.size > 0 && folded.has(keyOf(edge.map((i) => this.particles[i])));
    this.particles = [];  // of each vertex
    this.index = new Uint32Array(cloth.triangles.length);
    this.boxes = [];
    for (const {first, triangle_count} of cloth.panels) {
      const vertices = new Map();  // by corner of the flat shape
      const open = new Map();  // edges that no other triangle of the panel has
      const box = new THREE.Box2();
      for (let i = 3 * first; i < 3 * (first + triangle_count); ++i) {
        const corner = cloth.corners[i];
        if (!vertices.has(corner)) {
          vertices.set(corner, this.particles.length);
          this.particles.push(cloth.triangles[i]);
          const place = new THREE.Vector2(cloth.flat[2 * corner], cloth.flat[2 * corner + 1]);
          places.push(place.x, place.y, 0);
          box.expandByPoint(place);
        }
        this.index[i] = vertices.get(corner);
      }
      for (let t = 3 * first; t < 3 * (first + triangle_count); t += 3) {
        for (let k = 0; k < 3; ++k) {
          const edge = [this.index[t + k], this.index[t + (k + 1) % 3]].sort((a, b) => a - b);
          if (!open.delete(edge.join())) open.set(edge.join(), edge);
          if (isFolded(edge)) folds.push(...edge);
        }
      }
      outlines.push(...[...open.values()].filter((edge) => !isFolded(edge)).flat());
      this.boxes.push({box, size: box.getSize(new THREE.Vector2()), vertices: [...vertices.values()]});
    }
    const touching = ({box: a}, {box: b}) => a.min.x < b.max.x && b.min.x < a.max.x && a.min.y < b.max.y && b.min.y < a.max.y;
    this.apart = this.boxes.every((one, k) => this.boxes.slice(k + 1).every((other) => !touching(one, other)));
    this.build(places, outlines, folds);
  }

  // As they lie where none is over another; else in rows, the highest first, to be seen as large as may be in a picture
  // so many times as wide as high.
  layOut(aspect) {
    if (!this.apart) {
      const ordered = [...this.boxes].sort((a, b) => b.size.y - a.size.y);
      const gap = 0.12 * Math.max(...ordered.map(({size: {x, y}}) => Math.min(x, y)));
      let widest = 0;
      const choices = ordered.map(({size}) => rowsOf(ordered, gap, widest += size.x + gap));
      const span = ({width, height}) => Math.max(height, width / aspect);
      const {corners} = choices.reduce((best, each) => (span(each) < span(best) ? each : best));
      ordered.forEach((panel, k) => this.move(panel, corners[k]));
    }
    this.box = this.boxes.reduce((all, {box}) => all.union(box), new THREE.Box2());
  }

  // Its upper left corner.
  move({box, vertices}, [x, y]) {
    const [dx, dy] = [x - box.min.x, y - box.max.y];
    const {array} = this.position;
    for (const vertex of vertices) {
      array[3 * vertex] += dx;
      array[3 * vertex + 1] += dy;
    }
    this.position.needsUpdate = true;
    box.translate(new THREE.Vector2(dx, dy));
  }

  build(places, outlines, folds) {
    const position = this.position = new THREE.Float32BufferAttribute(places, 3);
    this.colour = new THREE.Float32BufferAttribute(new Float32Array(places.length), 3);
    this.surface = new THREE.BufferGeometry();
    this.surface.setAttribute('position', position);
    this.surface.setAttribute('color', this.colour);
    this.surface.setIndex(new THREE.BufferAttribute(this.index, 1));
    this.cloth.panels.forEach(({first, triangle_count}, k) => this.surface.addGroup(3 * first, 3 * triangle_count, k));
    const material = (more) => new THREE.MeshBasicMaterial({side: THREE.DoubleSide, ...more});
    this.plain = material();
    this.coloured = material({vertexColors: THREE.VertexColors});
    this.panels = this.cloth.panels.map(() => material());
    this.mesh = new THREE.Mesh(this.surface, this.plain);
    [this.lines, this.folds] = [outlines, folds].map((index) => {
      const lines = new THREE.BufferGeometry();
      lines.setAttribute('position', position);
      lines.setIndex(index);
      return new THREE.LineSegments(lines, new THREE.LineBasicMaterial({transparent: true, opacity: 0.7}));
    });
    this.mark = markOf();
    this.scene = new THREE.Scene();
    this.scene.add(this.mesh, this.lines, this.folds, this.mark);
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -1, 1);
  }

  // So that all of it is seen in a picture of so many pixels.
  fit(width, height) {
    if (!(Math.abs(Math.log(width / height / this.aspect)) < 0.2)) this.layOut(this.aspect = width / height);
    const size = this.box.getSize(new THREE.Vector2());
    const [middle, {camera}] = [this.box.getCenter(new THREE.Vector2()), this];
    const half = 0.56 * Math.max(size.y, size.x * height / width);
    Object.assign(camera, {left: -half * width / height, right: half * width / height, top: half, bottom: -half});
    camera.position.set(middle.x, middle.y, 0);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  // Of the particles, linear RGB.
  take(colours) {
    const out = this.colour.array;
    this.particles.forEach((particle, vertex) => {
      for (let k = 0; k < 3; ++k) out[3 * vertex + k] = colours[3 * particle + k];
    });
    this.colour.needsUpdate = true;
  }
}

const keyOf = (edge) => edge.sort((a, b) => a - b).join();
// Both ends of each line.
const pairsOf = (lines) => Array.from({length: lines.length / 2}, (_, k) => [lines[2 * k], lines[2 * k + 1]]);

// Upper left corners of panels in rows that are as wide at most, and how large all of it is.
function rowsOf(panels, gap, most) {
  const next = {x: 0, y: 0, height: 0};
  let width = 0;
  const corners = panels.map(({size}) => {
    if (next.x > 0 && next.x + size.x > most) Object.assign(next, {x: 0, y: next.y - next.height - gap, height: 0});
    const corner = [next.x, next.y];
    next.x += size.x + gap;
    next.height = Math.max(next.height, size.y);
    width = Math.max(width, next.x - gap);
    return corner;
  });
  return {corners, width, height: next.height - next.y};
}

// A point that is seen through everything.
function markOf() {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute([0, 0, 0], 3));
  const mark = new THREE.Points(geometry, dots(13));
  mark.material.depthTest = false;
  mark.renderOrder = 1;
  mark.visible = false;
  mark.frustumCulled = false;
  return mark;
}

// Moves a mark to a place on a triangle, by weights of its corners.
function moveMark(mark, positions, corners, weights) {
  const {array} = mark.geometry.getAttribute('position');
  for (let axis = 0; axis < 3; ++axis) {
    array[axis] = corners.reduce((sum, corner, k) => sum + weights[k] * positions[3 * corner + axis], 0);
  }
  mark.geometry.getAttribute('position').needsUpdate = true;
  mark.visible = true;
}
