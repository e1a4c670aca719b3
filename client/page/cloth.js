// Sheets as triangles: who draws, colours or picks them knows nothing else. Lengths in m.
'use strict';

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

const particlesOf = ({rows, columns, particle_count}) => rows * columns || particle_count;

// What a sheet has: its triangles, their two sides from the first corner along warp and weft where the sheet is
// flat, the corners of each in the flat shape, and where these are; panels as runs of triangles, lines to be drawn as
// pairs of particles, and how far it reaches. Both kinds below have these.

// Two triangles of each cell; the lines are its rows and columns.
class Lattice {
  constructor(sheet) {
    this.sheet = sheet;
    const {name, first_particle, rows, columns, spacing_m: h} = sheet;
    this.triangles = [];
    this.sides = [];
    this.lines = [];
    for (let row = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column) {
        const i = first_particle + row * columns + column;
        const right = column + 1 < columns;
        const below = row + 1 < rows;
        if (right) this.lines.push(i, i + 1);
        if (below) this.lines.push(i, i + columns);
        if (!right || !below) continue;
        this.triangles.push(i, i + columns, i + 1, i + columns + 1, i + 1, i + columns);
        this.sides.push(0, h, h, 0, 0, -h, -h, 0);
      }
    }
    this.corners = this.triangles.map((i) => i - first_particle);
    this.flat = Float32Array.from({length: 2 * rows * columns}, (_, k) =>
      (k % 2 ? -h * Math.floor((k >> 1) / columns) : h * ((k >> 1) % columns)));
    this.panels = [{name, triangle_count: this.triangles.length / 3}];
    this.reach = h * Math.max(rows, columns);
  }

  // Energy for each area, J/m^2: of the curvatures along warp and weft and of the twist, by the rigidities of the
  // textile, whatever the bending law. Differences as in the isometric law; a particle's twist is the mean of its
  // cells.
  writeBending(out, p) {
    const {first_particle, rows, columns, spacing_m, textile: {measured, raw}} = this.sheet;
    const warp = measured ? measured.bend_rigidity_warp_n_m : 1.5 * raw.bend_n_m2 / spacing_m;
    const weft = measured ? measured.bend_rigidity_weft_n_m : warp;
    const squaredCurvature = (a, b, c, d) => {
      let sum = 0;
      for (let axis = 0; axis < 3; ++axis) {
        sum += (p[3 * a + axis] - p[3 * b + axis] - p[3 * c + axis] + p[3 * d + axis]) ** 2;
      }
      return sum / spacing_m ** 4;
    };
    const isInside = (i, count) => i > 0 && i + 1 < count;
    for (let row = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column) {
        const i = first_particle + row * columns + column;
        if (isInside(column, columns)) out[i] += warp / 2 * squaredCurvature(i - 1, i, i, i + 1);
        if (isInside(row, rows)) out[i] += weft / 2 * squaredCurvature(i - columns, i, i, i + columns);
        if (row + 1 === rows || column + 1 === columns) continue;
        const twist = (warp + weft) / 2 * squaredCurvature(i, i + 1, i + columns, i + columns + 1);
        for (const r of [row, row + 1]) {
          for (const c of [column, column + 1]) {
            const cells = (isInside(r, rows) ? 2 : 1) * (isInside(c, columns) ? 2 : 1);
            out[first_particle + r * columns + c] += twist / cells;
          }
        }
      }
    }
  }
}

// The message MeshData in protobuf JSON; the lines are its borders and seams, and folds what it is pressed along.
class Mesh {
  constructor(sheet) {
    this.sheet = sheet;
    const {name, first_particle, mesh} = sheet;
    const own = new Uint32Array(bytesOf(mesh.triangles).buffer);
    const corners = mesh.flat_triangles ? new Uint32Array(bytesOf(mesh.flat_triangles).buffer) : own;
    const flat = new Float32Array(bytesOf(mesh.flat_m).buffer);
    const [u, v] = [flat.subarray(0, flat.length / 2), flat.subarray(flat.length / 2)];
    this.triangles = own.map((i) => first_particle + i);
    this.corners = corners;
    this.flat = Float32Array.from(flat, (_, k) => (k % 2 ? v : u)[k >> 1]);
    this.panels = mesh.panels?.length ? mesh.panels : [{name, triangle_count: own.length / 3}];
    this.sides = new Float32Array(4 / 3 * own.length);
    this.reach = 0;
    const open = new Map();  // edges without the triangle beyond, in the flat shape
    let t = 0;
    this.panels.forEach(({triangle_count, grain_rad = 0}, panel) => {
      const [sine, cosine] = [Math.sin(grain_rad), Math.cos(grain_rad)];
      const box = new THREE.Box2();
      for (const end = t + triangle_count; t < end; ++t) {
        const [a, b, c] = corners.subarray(3 * t, 3 * t + 3);
        [b, c].forEach((corner, k) => {
          const [du, dv] = [u[corner] - u[a], v[corner] - v[a]];
          this.sides[4 * t + 2 * k] = cosine * dv - sine * du;
          this.sides[4 * t + 2 * k + 1] = -cosine * du - sine * dv;
        });
        for (let k = 0; k < 3; ++k) {
          box.expandByPoint(new THREE.Vector2(u[corners[3 * t + k]], v[corners[3 * t + k]]));
          const [i, j] = [3 * t + k, 3 * t + (k + 1) % 3].sort((m, n) => own[m] - own[n]);
          const edge = `${own[i]},${own[j]}`;
          const place = `${corners[i]},${corners[j]},${panel}`;
          if (open.get(edge) === place) open.delete(edge); else open.set(edge, place);
        }
      }
      this.reach = Math.max(this.reach, ...box.getSize(new THREE.Vector2()).toArray());
    });
    this.folds = (mesh.folds ?? []).flatMap(({particles}) =>
      particles.slice(1).flatMap((i, k) => [first_particle + particles[k], first_particle + i]));
    const lines = [...open.keys()].map((edge) => edge.split(',').map((i) => first_particle + Number(i)));
    const folded = new Set(pairsOf(this.folds).map(keyOf));
    this.lines = lines.filter((edge) => !folded.has(keyOf(edge))).flat();
  }
}

// All sheets of a source as one.
class Cloth {
  constructor(sheets, particles) {
    this.parts = sheets.map((sheet) => (sheet.mesh ? new Mesh(sheet) : new Lattice(sheet)));
    this.threads = this.parts.flatMap((part) => (part instanceof Lattice ? part.lines : []));
    this.edges = this.parts.flatMap((part) => (part instanceof Mesh ? part.lines : []));
    this.folds = this.parts.flatMap(({folds = []}) => folds);
    this.pins = sheets.flatMap(({first_particle, pinned}) => pinned.map((i) => first_particle + i));
    const count = this.parts.reduce((sum, {triangles}) => sum + triangles.length / 3, 0);
    this.triangles = new Uint32Array(3 * count);
    this.corners = new Uint32Array(3 * count);
    this.flat = [];
    this.inverse = new Float32Array(4 * count);  // of the sides
    this.area = new Float32Array(count);
    this.areas = new Float32Array(particles);  // of the triangles around each
    this.panels = [];
    let t = 0;
    for (const {sheet, triangles, corners, flat, sides, panels} of this.parts) {
      let first = t;
      for (const panel of panels) {
        const name = sheets.length > 1 && panel.name !== sheet.name ? `${sheet.name} ${panel.name}` : panel.name;
        this.panels.push({...panel, name, sheet, first});
        first += panel.triangle_count;
      }
      this.triangles.set(triangles, 3 * t);
      this.corners.set(corners.map((corner) => this.flat.length / 2 + corner), 3 * t);
      for (const place of flat) this.flat.push(place);
      for (let k = 0; k < sides.length; k += 4, ++t) {
        const [a, b, c, d] = sides.slice(k, k + 4);
        const twice = a * d - b * c;
        this.inverse.set([d / twice, -b / twice, -c / twice, a / twice], 4 * t);
        this.area[t] = Math.abs(twice) / 2;
        for (let corner = 3 * t; corner < 3 * t + 3; ++corner) this.areas[this.triangles[corner]] += this.area[t];
      }
    }
  }

  panelOf(triangle) {
    return this.panels.find(({first, triangle_count}) => triangle < first + triangle_count);
  }

  // How three values of each particle change over triangle t, along the warp and then along the weft, 1/m.
  slopes(t, values, out) {
    const [a, b, c] = [3 * this.triangles[3 * t], 3 * this.triangles[3 * t + 1], 3 * this.triangles[3 * t + 2]];
    for (let axis = 0; axis < 3; ++axis) {
      const first = values[b + axis] - values[a + axis];
      const second = values[c + axis] - values[a + axis];
      out[axis] = first * this.inverse[4 * t] + second * this.inverse[4 * t + 1];
      out[3 + axis] = first * this.inverse[4 * t + 2] + second * this.inverse[4 * t + 3];
    }
    return out;
  }

  // Unit normals of the particles, the mean of the triangles around them by area.
  writeNormals(out, p) {
    out.fill(0);
    for (let t = 0; t < this.triangles.length; t += 3) {
      const [a, b, c] = [3 * this.triangles[t], 3 * this.triangles[t + 1], 3 * this.triangles[t + 2]];
      const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      for (const i of [a, b, c]) {
        out[i] += x;
        out[i + 1] += y;
        out[i + 2] += z;
      }
    }
    for (let i = 0; i < out.length; i += 3) {
      const length = Math.hypot(out[i], out[i + 1], out[i + 2]) || 1;
      for (let axis = 0; axis < 3; ++axis) out[i + axis] /= length;
    }
  }

  // A value of triangle t as its share in the means around its particles.
  addShare(out, t, value) {
    for (let corner = 3 * t; corner < 3 * t + 3; ++corner) {
      const i = this.triangles[corner];
      out[i] += value * this.area[t] / this.areas[i];
    }
  }

  // Of each particle the mean around it, by area, of what `strain` makes of how a warp and a weft thread lead.
  writeStrain(strain, out, p) {
    out.fill(0);
    const slopes = [];
    for (let t = 0; t < this.area.length; ++t) this.addShare(out, t, strain(this.slopes(t, p, slopes)));
  }

  // Along warp or weft, the largest around a particle; 0 where nothing is stretched.
  writeLargestStrain(out, p) {
    out.fill(0);
    const slopes = [];
    for (let t = 0; t < this.area.length; ++t) {
      this.slopes(t, p, slopes);
      const strain = Math.max(kStrains.warp(slopes), kStrains.weft(slopes));
      for (let corner = 3 * t; corner < 3 * t + 3; ++corner) {
        const i = this.triangles[corner];
        if (strain > out[i]) out[i] = strain;
      }
    }
  }

  // Energy for each area, J/m^2: of the curvatures along warp and weft and of the twist, by the rigidities of the
  // textile. A mesh has them from how the normals turn over its triangles (Rusinkiewicz 2004).
  writeBending(out, p) {
    out.fill(0);
    for (const part of this.parts) part.writeBending?.(out, p);
    if (this.parts.every((part) => part.writeBending)) return;
    const normals = this.normals ??= new Float32Array(p.length);
    this.writeNormals(normals, p);
    const [threads, turns] = [[], []];
    for (const {sheet, textile = sheet.textile, first, triangle_count} of this.panels) {
      if (!sheet.mesh) continue;
      const {bend_rigidity_warp_n_m: warp, bend_rigidity_weft_n_m: weft} = textile.measured;
      for (let t = first; t < first + triangle_count; ++t) {
        this.slopes(t, p, threads);
        this.slopes(t, normals, turns);
        const along = dot(threads, 0, turns, 0);
        const across = dot(threads, 3, turns, 3);
        const twist = (dot(threads, 0, turns, 3) + dot(threads, 3, turns, 0)) / 2;
        this.addShare(out, t, (warp * along ** 2 + weft * across ** 2 + (warp + weft) * twist ** 2) / 2);
      }
    }
  }
}

const dot = (a, i, b, j) => a[i] * b[j] + a[i + 1] * b[j + 1] + a[i + 2] * b[j + 2];
const size = (a, i) => Math.hypot(a[i], a[i + 1], a[i + 2]);

// Of the slopes of positions: lengths against those of the flat shape, and the sine of the angle of shear.
const kStrains = {
  warp: (threads) => size(threads, 0) - 1,
  weft: (threads) => size(threads, 3) - 1,
  shear: (threads) => dot(threads, 0, threads, 3) / (size(threads, 0) * size(threads, 3) || 1),
};
