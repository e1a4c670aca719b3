// The recordings that the page holds. Lengths in m, times in s.
'use strict';

const page = JSON.parse($('page').textContent);
const kSameTime = 1e-9;

async function inflate(id) {
  const stream = new Blob([bytesOf($(id).textContent.trim())]).stream().pipeThrough(new DecompressionStream('deflate'));
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
    this.cloth = new Cloth(this.sheets, this.particles);
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
  writeSpeeds(out, frame) {
    const before = Math.max(frame - 1, 0);
    const step = this.time_s[frame] - this.time_s[before];
    const scale = step > 0 ? this.quantum_m / step : 0;
    for (let i = 0, a = frame * this.values, b = before * this.values; i < this.particles; ++i, a += 3, b += 3) {
      out[i] = scale * Math.hypot(this.numbers[a] - this.numbers[b],
        this.numbers[a + 1] - this.numbers[b + 1], this.numbers[a + 2] - this.numbers[b + 2]);
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
        this.most[quantity] = largestOf(values, this.most[quantity]);
      }
    }
    return this.most[quantity];
  }
}
