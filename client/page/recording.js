// The recordings that the page holds. Lengths in m, times in s.
'use strict';

let page;  // what it says of itself and its recordings
const kSameTime = 1e-9;

// Positions as whole numbers of the quantum: x, y, z of particle 0, of particle 1 ... of every frame.
// client/page/packed_frames.h says how they are packed.
function unpack(bytes, frames, particles) {
  let at = 0;
  const take = (count) => {
    const taken = new Int32Array(count);
    for (let i = 0; i < count; ++i, ++at) {
      const zigzag = bytes[at] | (bytes[at + count] << 8) | (bytes[at + 2 * count] << 16) | (bytes[at + 3 * count] << 24);
      taken[i] = (zigzag >>> 1) ^ -(zigzag & 1);
    }
    at += 3 * count;
    return taken;
  };

  // of whom each particle's move is guessed, in the order in which they come
  const order = take(4 * particles);
  for (let k = 0, particle = 0; k < particles; ++k) {
    particle += order[k];
    order[k] = particle;
    for (const other of [1, 2, 3]) order[other * particles + k] = particle - order[other * particles + k];
  }
  const [each, a, b, c] = [0, 1, 2, 3].map((part) => order.subarray(part * particles, (part + 1) * particles));

  const numbers = new Int32Array(frames * 3 * particles);
  const moves = new Int32Array(particles + 1);  // the last is 0
  for (let frame = 0; frame < frames; ++frame) {
    const out = 3 * frame * particles;
    const before = out - 3 * particles;
    const beyond = take(3 * particles);
    for (let axis = 0, next = 0; axis < 3; ++axis) {
      for (let k = 0; k < particles; ++k, ++next) {
        const move = beyond[next] + moves[a[k]] + moves[b[k]] - moves[c[k]];
        const i = each[k];
        moves[i] = move;
        numbers[out + 3 * i + axis] = (frame > 0 ? numbers[before + 3 * i + axis] : 0) + move;
      }
    }
  }
  return numbers;
}

// Values that were recorded: of each quantity and frame a byte of every particle, the difference to the frame
// before. Level q of the most that there are stands for low + (high - low) (q / most)^2.
function unpackValues(bytes, kinds, frames, particles) {
  let at = 0;
  const values = {};
  for (const [name, kind] of Object.entries(kinds)) {
    const levels = bytes.subarray(at, at += frames * particles);
    for (let i = particles; i < levels.length; ++i) levels[i] += levels[i - particles];
    values[name] = {...kind, levels};
  }
  return values;
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
  constructor(facts, numbers, values) {
    Object.assign(this, facts);
    this.recorded = values;
    this.numbers = numbers;
    this.values = 3 * this.particles;
    this.cloth = new Cloth(this.sheets, this.particles);
    this.most = {};  // largest value of a quantity over all frames, of a garment once it is put on
  }

  // Where between two frames t lies.
  place(t) {
    const frame = indexAt(this.time_s, t);
    const next = Math.min(frame + 1, this.time_s.length - 1);
    const step = this.time_s[next] - this.time_s[frame];
    return {frame, next, share: step > 0 ? Math.min(1, Math.max(0, (t - this.time_s[frame]) / step)) : 0};
  }

  // Of a body with poses, s; those of actions go straight between frames.
  poseTime(body, t, {frame, next, share}) {
    const at = (k) => this.stats?.pose_times_s?.[k]?.[body] ?? this.time_s[k];
    if (!this.stats?.pose_times_s) return t;
    return at(frame) + share * (at(next) - at(frame));
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
  writeSpeeds(out, frame) {
    const before = Math.max(frame - 1, 0);
    const step = this.time_s[frame] - this.time_s[before];
    const scale = step > 0 ? this.quantum_m / step : 0;
    for (let i = 0, a = frame * this.values, b = before * this.values; i < this.particles; ++i, a += 3, b += 3) {
      out[i] = scale * Math.hypot(this.numbers[a] - this.numbers[b],
        this.numbers[a + 1] - this.numbers[b + 1], this.numbers[a + 2] - this.numbers[b + 2]);
    }
  }

  has(quantity) { return quantity in this.recorded; }

  // Of every particle, as far as the page has them.
  writeValues(quantity, out, frame) {
    const {levels, low, high, most} = this.recorded[quantity];
    for (let i = 0, k = frame * this.particles; i < this.particles; ++i, ++k) out[i] = low + (high - low) * (levels[k] / most) ** 2;
  }

  largest(quantity) {
    if (!(quantity in this.most) && this.has(quantity)) {
      this.most[quantity] = roundUp(this.recorded[quantity].scale);
    } else if (!(quantity in this.most)) {
      const positions = new Float32Array(this.values);
      const values = new Float32Array(this.particles);
      this.most[quantity] = 0;
      const dressed_s = Math.max(0, ...this.phases.map(({until_s = 0}) => until_s));
      const first = Math.min(this.time_s.length - 1, dressed_s > 0 ? indexAt(this.time_s, dressed_s) + 1 : 0);
      for (let frame = first; frame < this.time_s.length; ++frame) {
        this.write(positions, {frame, next: frame, share: 0});
        kQuantities[quantity].write(this, values, positions, frame);
        this.most[quantity] = largestOf(values, this.most[quantity]);
      }
    }
    return this.most[quantity];
  }
}
