// The page of `weft serve`: shows a session of a running server, and drives it. Lengths in m, times in s.
'use strict';

// What went wrong, by what was tried; the first is shown.
const troubles = new Map();
function trouble(of, text) {
  if (text) troubles.set(of, text); else troubles.delete(of);
  const [first] = troubles.values();
  $('trouble').textContent = first ?? '';
  $('trouble').hidden = !first;
}

// Why something that a person asked for was not done; shown for a while.
function refuse(error) {
  trouble('request', error.message);
  clearTimeout(refuse.timer);
  refuse.timer = setTimeout(() => trouble('request', ''), 10000);
}

// Something a person asked for: the answer, or none.
async function attempt(work) {
  try {
    const answer = await work();
    trouble('request', '');
    return answer;
  } catch (error) {
    refuse(error);
    return undefined;
  }
}

const doing = (text) => { $('doing').textContent = text; };
const stateOf = ({state}) => state.replace('SESSION_STATE_', '').toLowerCase();

// Rows of the panel: label, and text of a frame.
const kCurrent = [
  ['frame', ({number}) => `${number}`],
  ['time', ({time_s}) => `${time_s.toFixed(3)} s`],
  ['largest strain', ({stats}) => `${(100 * stats.largest_strain).toPrecision(3)} %`],
  ['kinetic energy', ({stats}) => `${digits(stats.kinetic_energy_j)} J`],
  ['potential energy', ({stats}) => `${digits(stats.potential_energy_j)} J`],
  ['substeps', ({stats}) => (stats.substep_s > 0 ? `${stats.substep_count} of ${digits(1e6 * stats.substep_s)} µs` : '0')],
  ['cuts of cloth', ({stats}) => `${stats.cloth_cut_count ?? 'not counted'}`],
  ['repairs', ({stats}) => `${stats.repair_count}`],
  ['at rest', ({stats}) => (stats.at_rest ? 'yes' : 'no')],
];

class Live extends Stage {
  constructor() {
    super();
    this.textile = new TextilePanel((change) => this.updateTextile(change));
    this.cells = kCurrent.map(([label]) => {
      const value = cell('td', '');
      $('facts').append(row(cell('th', label, {scope: 'row'}), value));
      return value;
    });
  }

  get sight() { return this.panes[0]?.source; }
  get isRunning() { return this.state === 'running'; }

  // ---- what is seen

  // Shows a session until another one is chosen, through whatever happens to the server.
  async follow(name) {
    const turn = this.turn = (this.turn ?? 0) + 1;
    this.hand?.release();
    this.panes = [];
    this.name = name;
    this.begun = undefined;
    message('Waiting for the first frame …');
    while (turn === this.turn) {
      const stream = this.stream = new Conversation('weft.v1.FrameService/ViewFrames');
      const {asked} = this;
      const wanted = () => turn === this.turn && asked === this.asked;
      try {
        await this.watch(name, stream, wanted);
      } catch (error) {
        if (wanted()) trouble('view', error.message);
      } finally {
        stream.close();
      }
      if (wanted()) await pause(1);
    }
  }

  // What frames have to have for the colours, beside positions.
  get asked() { return kQuantities[this.quantity]?.recorded ? this.quantity : undefined; }

  colourChosen() {
    const {asked} = this;
    super.colourChosen();
    if (asked !== this.asked) this.stream?.close();
  }

  // A credit for each frame, granted when the one before was drawn: a browser that is slow, or hidden, sees fewer.
  async watch(name, stream, wanted) {
    const shown = await session('GetSession', {name});
    const topology = shown.scene.sheets.some(({grid}) => !grid);
    const format = {stats: true, topology, ...(this.asked && {[this.asked]: true})};
    const {header} = await stream.ask({session: name, uid: shown.uid, format, credits: 1});
    this.setState(stateOf(shown));
    const sight = new Sight(shown, header);
    for (let request = ''; wanted();) {
      const answer = await stream.ask(request);
      if (!wanted()) return;
      trouble('view', '');
      request = '';
      if (answer.progress) this.setState(stateOf(answer.progress));
      if (answer.topology && !header.sheets[answer.topology.sheet].rows) sight.layOut(answer.topology);
      if (!answer.frame) continue;
      sight.take(answer);
      if (this.begun !== sight) this.begin(sight);
      this.time = answer.frame.time_s;
      this.stale = true;
      await new Promise((done) => { this.drawn = done; });
      this.showFrame(answer.frame);
      request = {credits: 1};
    }
  }

  // The same session that comes back is seen from where it was.
  begin(sight) {
    const again = this.sight?.uid === sight.uid;
    this.begun = sight;
    if (again) {
      this.panes[0].source = sight;
    } else {
      this.show([sight]);
      message('');
    }
    this.textile.show(sight.session.scene.sheets);
    for (const id of ['textile', 'judged', 'now-shown']) $(id).hidden = false;
    if (!again) this.offerPoses();
    if (!again) {
      $('verdicts').replaceChildren();
      this.judgedRest = undefined;
    }
    for (const id of ['play', 'step', 'record']) $(id).disabled = false;
    document.body.dataset.state = 'ready';
  }

  fit() {
    if (this.sight) this.box = this.boxOf([this.sight]);
    super.fit();
  }

  setState(state) {
    this.state = state;
    setPlaying(this.isRunning);
    this.showName();
  }

  showName(phase = this.begun && this.sight?.phase) {
    const label = $('names').lastElementChild?.lastElementChild;
    if (label) label.textContent = phase ? `${this.state}, ${phase}` : this.state;
  }

  showFrame(frame) {
    kCurrent.forEach(([, text], k) => { this.cells[k].textContent = text(frame).replaceAll(' ', '\u00a0'); });
    this.showPoses(frame);
    const {phase} = this.sight;
    $('clock').textContent = `frame ${frame.number}, ${frame.time_s.toFixed(3)} s`;
    this.showName(phase);
    // what has come to rest is judged once
    const {at_rest} = frame.stats;
    if (at_rest && !this.judgedRest && phase) this.judge();
    this.judgedRest = at_rest;
  }

  // A slider for each body that has poses: where it is among them, and where it is led to.
  offerPoses() {
    this.posed = posedOf(this.sight.colliders).map(({name, mesh: {data: {poses: {times_s}}}}) => {
      const [first, last] = [times_s[0], times_s[times_s.length - 1]];
      const input = Object.assign(document.createElement('input'),
        {type: 'range', min: first, max: last, step: 'any', value: first, disabled: last === first, ariaLabel: `Pose of ${name}`});
      const output = cell('output', '');
      const lead = new Lead(this.name, name, (frame) => {
        body.applied = frame;
        doing(`Leads ${name} from frame ${frame} on${this.isRunning ? '' : ', when it runs'}.`);
      });
      const body = {name, input, output, first, last};
      input.addEventListener('input', () => {
        body.target = Number(input.value);
        body.applied = undefined;
        attempt(() => lead.to(body.target).catch((error) => {
          body.target = undefined;  // it stays on its way
          throw error;
        }));
      });
      return body;
    });
    $('poses').replaceChildren(...this.posed.map(({name, input, output}) => {
      const line = cell('label', '', {class: 'slider'});
      line.append(cell('span', name), input, output);
      return line;
    }));
    $('posed').hidden = this.posed.length === 0;
  }

  // Thumbs are where a body is led to until it is there, or another leads it elsewhere.
  showPoses({number, time_s}) {
    this.posed.forEach((body, k) => {
      const {input, output, first, last} = body;
      const at = Math.min(last, Math.max(first, this.sight.poseTime(k, time_s)));
      output.textContent = `${at.toFixed(2)}\u00a0s`;
      const left = Math.abs(at - body.target);
      const strays = body.seen >= body.applied && number > body.seen && left >= body.left;
      if (left < 1e-6 || strays) body.target = undefined;
      if (body.target === undefined) input.value = at;
      [body.seen, body.left] = [number, left];
    });
  }

  judge() {
    return attempt(async () => {
      const {name, sight} = this;
      const verdict = await session('GetVerdict', {name});
      if (name === this.name) showVerdicts($('verdicts'), [{name: sight.name, verdict}], `Frame ${verdict.frame}`);
    });
  }

  // ---- what is done

  run() {
    const speed = $('speed').value;
    return attempt(async () => {
      const {applied_frame} = await session('RunSession', {name: this.name, ...(speed && {time_scale: Number(speed)})});
      this.setState('running');
      doing(`Runs from frame ${applied_frame} on.`);
    });
  }

  pause() {
    return attempt(async () => {
      const {applied_frame} = await session('PauseSession', {name: this.name});
      this.setState('paused');
      doing(`Paused before frame ${applied_frame}.`);
    });
  }

  step(frames) {
    return attempt(async () => {
      if (this.isRunning) await this.pause();
      const {frame} = await session('StepSession', {name: this.name, frames});
      doing(`Stepped to frame ${frame}.`);
    });
  }

  async updateTextile(change) {
    const answer = await attempt(() => session('UpdateTextile', {name: this.name, ...change}));
    if (!answer) throw new Error('refused');
    this.stale = true;  // bending energy has other colours
    return answer;
  }

  async record() {
    const active = isPressed($('record'));
    const {name} = this;
    await attempt(async () => {
      const {file, frames} = await call(`recordings/${active ? 'stop' : 'start'}`, {session: name});
      doing(active ? `Recorded ${frames} frames in ${file}.` : `Records to ${file}.`);
    });
    await showRecordings(this);
  }

  // ---- the hand

  // The particle under the pointer that is simulated, unless a body is before it; on the pattern too.
  pick(event) {
    const found = this.find(event);
    if (!found) return undefined;
    const {pane, place: {triangle, weights}} = found;
    const particle = this.sight.simulated(
      pane.source.cloth.triangles[3 * triangle + weights.indexOf(Math.max(...weights))]);
    return {particle, at: new THREE.Vector3().fromBufferAttribute(pane.position, particle)};
  }

  grab(event) {
    if (!isPressed($('hand')) || !this.sight || this.hand || event.button !== 0 || !event.isPrimary ||
        event.ctrlKey || event.metaKey || event.shiftKey) return;
    const picked = this.pick(event);
    if (!picked) return;
    this.controls.enabled = false;  // it would turn the view
    this.place = undefined;
    $('view').setPointerCapture(event.pointerId);
    $('view').classList.add('holding');
    const toward = this.camera.getWorldDirection(new THREE.Vector3());
    this.plane = new THREE.Plane().setFromNormalAndCoplanarPoint(toward, picked.at);
    const {name, first_particle} = this.sight.sheetOf(picked.particle);
    const particle = picked.particle - first_particle;
    const held = `particle ${particle}${this.sight.sheets.length > 1 ? ` of ${name}` : ''}`;
    this.hand = new Hand(this.name, name, particle, (frame) =>
      doing(`Leads ${held} from frame ${frame} on${this.isRunning ? '' : ', when it runs'}.`));
    this.panes[0].hold(picked.particle);
    this.stale = true;
    this.hand.end.then(() => doing('Let go.'), refuse).finally(() => this.letGo());
  }

  drag(event) {
    if (!this.hand || this.aim(event)?.onPattern !== false) return;
    const target = this.ray.ray.intersectPlane(this.plane, new THREE.Vector3());
    if (target) this.hand.lead(target);
  }

  letGo() {
    this.hand?.release();
    this.hand = undefined;
    this.controls.enabled = true;
    $('view').classList.remove('holding');
    this.panes[0]?.hold();
    this.stale = true;
  }

  toggleHand() {
    $('hand').setAttribute('aria-pressed', !isPressed($('hand')));
    $('view').classList.toggle('free', isPressed($('hand')));
  }
}

// ---- lists

function sessionRow(live, {name, frame, time_s, at_rest, lateness_s, failure, ...rest}) {
  const state = stateOf(rest);
  const button = cell('button', '', {class: state, 'aria-current': name === live.name});
  const late = state === 'running' && lateness_s > 0.1 ? `, ${lateness_s.toFixed(1)} s late` : '';
  button.append(cell('span', '', {class: 'dot'}), cell('span', shortName(name), {class: 'name'}),
    cell('span', at_rest && state !== 'failed' ? `${state}, at rest` : state, {class: 'state'}),
    cell('small', failure || `frame ${frame}, ${time_s.toFixed(3)} s${late}`));
  button.addEventListener('click', () => { location.hash = shortName(name); });
  const item = document.createElement('li');
  item.append(button);
  return item;
}

async function showSessions(live) {
  try {
    const {sessions} = await session('ListSessions');
    trouble('list', '');
    const focused = [...$('sessions').children].findIndex((item) => item.contains(document.activeElement));
    $('sessions').replaceChildren(...sessions.map((each) => sessionRow(live, each)));
    $('sessions').children[focused]?.firstChild.focus();
    $('none').hidden = sessions.length > 0;
    if (!live.name && sessions.length > 0) location.hash = shortName(sessions[0].name);
    else if (!live.name) message('No session to show.');
    if (!$('preset').length) live.textile.offer((await call('weft.v1.TextileService/ListTextiles')).textiles);
  } catch (error) {
    trouble('list', error.message);
  }
}

const sizeText = (bytes) => (bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

async function showRecordings(live) {
  try {
    const {recordings} = await call('recordings/list');
    $('recorded').hidden = recordings.length === 0;
    $('recordings').replaceChildren(...recordings.map(({file, state, frames, last_time_s, bytes, message: why}) => {
      const item = cell('li', file, {class: state});
      item.append(cell('small', why || `${frames} frames, up to ${last_time_s.toFixed(3)} s, ${sizeText(bytes)}`));
      return item;
    }));
    const active = recordings.some(({session: name, state}) => name === live.name && state === 'recording');
    $('record').setAttribute('aria-pressed', active);
    $('record').setAttribute('aria-label', active ? 'End the recording' : 'Record');
  } catch {
    // the list of sessions says so
  }
}

async function keepLists(live) {
  for (;;) {
    if (!document.hidden) await Promise.all([showSessions(live), showRecordings(live)]);
    await pause(1);
  }
}

// ---- control

function listen(live) {
  const toggle = () => (live.isRunning ? live.pause() : live.run());
  const record = () => live.record();
  $('play').addEventListener('click', toggle);
  $('step').addEventListener('click', () => live.step(1));
  $('record').addEventListener('click', record);
  $('hand').addEventListener('click', () => live.toggleHand());
  $('judge').addEventListener('click', () => live.judge());
  $('speed').addEventListener('change', () => { if (live.isRunning) live.run(); });
  $('view').addEventListener('pointerdown', (event) => live.grab(event));
  $('view').addEventListener('pointermove', (event) => live.drag(event));
  for (const end of ['pointerup', 'pointercancel']) {
    $('view').addEventListener(end, () => live.hand?.release());
  }
  live.listen({
    ' ': toggle, ArrowRight: (frames) => live.step(frames), r: record, g: () => live.toggleHand(),
  });
  const follow = () => {
    const name = decodeURIComponent(location.hash.slice(1));
    if (name) live.follow(`sessions/${name}`);
  };
  addEventListener('hashchange', follow);
  follow();
}

function main() {
  const live = makeStage(Live);
  if (!live) return;
  listen(live);
  keepLists(live);
  requestAnimationFrame((now) => live.tick(now));
}

main();
