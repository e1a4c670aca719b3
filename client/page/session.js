// Sessions of a running server, through the server of this page: client/serve/live_server.h says how. Lengths in
// m, times in s.
'use strict';

const pause = (seconds) => new Promise((done) => { setTimeout(done, 1000 * seconds); });
const shortName = (name) => name.slice(name.indexOf('/') + 1);

// One sentence of what {error} says, the field first where one is to blame.
function sentenceOf({message: text, violations}) {
  return violations.length === 1 ? `${violations[0].field}: ${violations[0].description}` : text;
}

// Calls a method, "weft.v1.SessionService/RunSession", and returns its answer.
async function call(method, request = {}) {
  let response;
  try {
    response = await fetch(`/${method}`, {method: 'POST', body: JSON.stringify(request)});
  } catch {
    throw new Error('weft serve does not answer; is it running?');
  }
  if (response.status === 200) return response.json();
  const said = await response.text();
  throw new Error(said.startsWith('{') ? sentenceOf(JSON.parse(said).error) : said.trim());
}
const session = (method, request) => call(`weft.v1.SessionService/${method}`, request);

// A stream of the server: each message is answered with one.
class Conversation {
  constructor(method) {
    this.socket = new WebSocket(`ws://${location.host}/${method}`);
    this.socket.binaryType = 'arraybuffer';
    this.opened = new Promise((done, fail) => {
      this.socket.onopen = done;
      this.fail = fail;
    });
    this.opened.catch(() => {});  // who asks will hear
    this.socket.onmessage = ({data}) => this.take(data);
    this.socket.onclose = () => this.fail(new Error('weft serve does not answer; is it running?'));
  }

  // Sends a request, or nothing, and waits for the next message.
  async ask(request) {
    await this.opened;
    return new Promise((done, fail) => {
      this.done = done;
      this.fail = fail;
      this.socket.send(request ? JSON.stringify(request) : '');
    });
  }

  take(data) {
    if (typeof data !== 'string') {
      const length = new Uint32Array(data, 0, 1)[0];
      const said = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
      this.done({...said, arrays: new Float32Array(data, 4 + length)});
      return;
    }
    const said = data ? JSON.parse(data) : {error: {message: 'The server ended the stream.', violations: []}};
    if (said.error) this.fail(new Error(sentenceOf(said.error))); else this.done(said);
  }

  close() { this.socket.close(); }
}

// A session as it is seen: the newest frame, and the one before.
class Sight {
  constructor(session, {sheets, uid, format}) {
    const {scene, name} = session;
    this.session = session;
    this.name = shortName(name);
    this.uid = uid;
    this.format = format;
    this.sheets = sheets.map((layout, k) => ({
      ...layout,
      spacing_m: scene.sheets[k].grid?.spacing_m,
      pinned: scene.sheets[k].pins.flatMap(({particles}) => particles),
      get textile() { return scene.sheets[k].textile; },  // as it is now
    }));
    this.particles = this.sheets.reduce((sum, sheet) => sum + particlesOf(sheet), 0);
    this.colliders = scene.colliders;
    this.gravity_m_per_s2 = scene.environment.gravity_m_per_s2;
    this.phases = session.phases;
    this.origin_m = [0, 0, 0];
    this.most = {};  // largest value of a quantity so far, of a garment since it is put on
  }

  // What a frame may have beside positions.
  has() { return this.colliders.length > 0; }

  // What goes on in the frame.
  get phase() {
    const {name} = this.phases.find(({until_s}) => until_s === undefined || this.frame.time_s < until_s) ?? {};
    return name && this.isDressed && this.frame.stats.at_rest ? 'at rest' : name;
  }
  get isDressed() { return this.phases.every(({until_s = 0}) => this.frame.time_s >= until_s); }

  // The triangles of a sheet, which come before the frames where it is no grid.
  layOut({sheet, mesh}) { this.sheets[sheet].mesh = mesh; }

  get cloth() { return this.made ??= new Cloth(this.sheets, this.particles); }

  // arrays: positions, then what else was asked for, one number of each particle.
  take({frame, arrays}) {
    this.before = this.frame;
    const end = 3 * this.particles;
    this.frame = {...frame, positions: arrays.subarray(0, end), values: arrays.subarray(end)};
  }

  // Of a body with poses, s.
  poseTime(body, t) { return this.frame.stats.pose_times_s?.[body] ?? t; }

  sheetOf(particle) {
    return this.sheets.find((sheet) => particle < sheet.first_particle + particlesOf(sheet));
  }

  // The nearest particle that is simulated.
  simulated(particle) {
    const {first_particle, columns, simulated_every: every = 1} = this.sheetOf(particle);
    if (every <= 1) return particle;
    const own = particle - first_particle;
    const nearest = (place) => every * Math.round(place / every);
    return first_particle + nearest(Math.floor(own / columns)) * columns + nearest(own % columns);
  }

  place() { return {frame: this.frame.number}; }

  // From x of all particles, then y, then z.
  write(out) {
    const {positions} = this.frame;
    for (let i = 0; i < this.particles; ++i) {
      for (let axis = 0; axis < 3; ++axis) out[3 * i + axis] = positions[axis * this.particles + i];
    }
  }

  // Speed of every particle, m/s, on the way from the frame that was seen before.
  writeSpeeds(out) {
    out.fill(0);
    const step = this.before ? this.frame.time_s - this.before.time_s : 0;
    if (!(step > 0)) return;
    const n = this.particles;
    const [a, b] = [this.frame.positions, this.before.positions];
    for (let i = 0; i < n; ++i) {
      out[i] = Math.hypot(a[i] - b[i], a[n + i] - b[n + i], a[2 * n + i] - b[2 * n + i]) / step;
    }
  }

  // What was asked for beside positions; nothing before it comes.
  writeValues(quantity, out) {
    if (this.format[quantity]) out.set(this.frame.values); else out.fill(0);
  }

  largest(quantity, values) {
    const {recorded} = kQuantities[quantity];
    const now = recorded ? roundMost(values) : largestOf(values);
    if (!this.isDressed) return now;
    this.most[quantity] = Math.max(now, this.most[quantity] ?? 0);
    return this.most[quantity];
  }

  // Where the sheets are, and where those that hang from pins will come to.
  get bounds() {
    const {positions} = this.frame;
    const box = new THREE.Box3();
    const at = (i) => new THREE.Vector3(
      positions[i], positions[this.particles + i], positions[2 * this.particles + i]);
    for (let i = 0; i < this.particles; ++i) box.expandByPoint(at(i));
    const down = vector(this.gravity_m_per_s2).normalize();
    for (const {sheet: {first_particle, pinned}, reach} of this.cloth.parts) {
      for (const i of pinned) box.expandByPoint(at(first_particle + i).addScaledVector(down, reach));
    }
    return box;
  }
  get low_m() { return this.bounds.min.toArray(); }
  get high_m() { return this.bounds.max.toArray(); }
}

// Leads a body through its poses to the newest time of these it was given.
class Lead {
  constructor(name, collider, applied) {
    Object.assign(this, {name, collider, applied});
  }

  async to(pose_time_s) {
    this.next = pose_time_s;
    if (this.sends) return;
    this.sends = true;
    try {
      while (this.next !== undefined) {
        const pose = {collider: this.collider, pose_time_s: this.next};
        this.next = undefined;
        const {applied_frame} = await session('ApplyActions', {name: this.name, actions: [{pose_collider: pose}]});
        this.applied(applied_frame);
      }
    } finally {
      this.sends = false;
    }
  }
}

// A hand that holds a particle and leads it to the newest place it was given. When it goes, it lets go.
class Hand {
  constructor(name, sheet, particle, applied) {
    this.of = {sheet, particle};
    this.name = name;
    this.sequence = 0;
    this.stream = new Conversation('weft.v1.SessionService/Interact');
    this.end = this.work(applied);
  }

  async act(action) {
    const {applied_frame} = await this.stream.ask({session: this.name, sequence: ++this.sequence, action});
    return applied_frame;
  }

  lead(target) {
    this.target_m = {x: target.x, y: target.y, z: target.z};
    this.wake?.();
  }

  release() {
    this.released = true;
    this.wake?.();
  }

  // Tells from which frame each place shows.
  async work(applied) {
    try {
      applied(await this.act({grab: this.of}));
      while (this.target_m || !this.released) {
        if (this.target_m) {
          const {target_m} = this;
          this.target_m = undefined;
          applied(await this.act({drag: {...this.of, target_m}}));
        } else {
          await new Promise((wake) => { this.wake = wake; });
        }
      }
      applied(await this.act({release: this.of}));
    } finally {
      this.stream.close();
    }
  }
}
