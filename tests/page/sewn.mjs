// A cloth of two panels, sewn along their middle, on a ball; the right one lies askew to its warp.
const kPoints = 26;  // along a side
const kSpacing = 0.02;  // m
const kAskew = Math.PI / 4;

const base64 = (array) => Buffer.from(array.buffer).toString('base64');

// pressed: along the seam.
export function sewn(pressed = false) {
  const middle = (kPoints - 1) / 2 - 0.5;  // column of the seam
  const random = ((state) => () => (state = (state * 16807) % 2147483647) / 2147483647)(7);
  const inside = (k) => k > 0 && k < kPoints - 1;
  const at = [];  // x and z, irregular
  for (let row = 0; row < kPoints; ++row) {
    for (let column = 0; column < kPoints; ++column) {
      const free = inside(row) && inside(column) && column !== middle;
      const jitter = () => (free ? 0.4 * kSpacing * (random() - 0.5) : 0);
      at.push([column * kSpacing + jitter(), row * kSpacing + jitter()]);
    }
  }
  // corners of the flat shape: the left panel's, then the right one's, apart from it and turned
  const left = at.map(([x, z]) => [z, x]);
  const right = at.map(([x, z]) => {
    const [sine, cosine] = [Math.sin(kAskew), Math.cos(kAskew)];
    return [cosine * z - sine * x + 1, sine * z + cosine * x];
  });
  const corners = [...left, ...right];
  const used = [[], []];
  for (let row = 0; row + 1 < kPoints; ++row) {
    for (let column = 0; column + 1 < kPoints; ++column) {
      const i = row * kPoints + column;
      const [a, b, c, d] = [i, i + kPoints, i + kPoints + 1, i + 1];
      used[column < middle ? 0 : 1].push(...((row + column) % 2 ? [a, b, d, c, d, b] : [a, b, c, a, c, d]));
    }
  }
  const triangles = Uint32Array.from(used.flat());
  const flat = Uint32Array.from([...used[0], ...used[1].map((i) => i + at.length)]);
  const kept = [...new Set(flat)].sort((m, n) => m - n);  // every corner is one of a triangle
  const place = new Map(kept.map((corner, k) => [corner, k]));
  const half = -kSpacing * (kPoints - 1) / 2;
  return {
    sheets: [{
      name: 'cloth',
      triangles: {data: {
        positions_m: base64(Float32Array.from([...at.map(([x]) => x), ...at.map(() => 0), ...at.map(([, z]) => z)])),
        triangles: base64(triangles),
        flat_m: base64(Float32Array.from([0, 1].flatMap((axis) => kept.map((corner) => corners[corner][axis])))),
        flat_triangles: base64(flat.map((corner) => place.get(corner))),
        panels: [{name: 'left', triangle_count: used[0].length / 3},
          {name: 'right', triangle_count: used[1].length / 3, grain_rad: kAskew / 2}],
        ...(pressed && {folds: [{particles: Array.from({length: kPoints}, (_, row) => row * kPoints + middle), angle_rad: 1.5}]}),
      }},
      textile: {preset: 'wool_tropical'},
      placement: {origin_m: {x: half, y: 0.16, z: half}},
      pins: [{particles: [0]}],
    }],
    colliders: [{name: 'ball', sphere: {radius_m: 0.15}, friction_coefficient: 0.4}],
  };
}
