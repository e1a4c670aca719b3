// The page of `weft view`: shows recordings side by side, at one simulated time, through one camera.
// Lengths in m, times in s.
'use strict';

class Viewer extends Stage {
  ticks = [0];
  turning = false;
  turned = undefined;  // when it last was

  async open(figure) {
    this.pause();
    this.panes = [];
    message('Unpacking the frames …');
    const recordings = [];
    for (const index of figure.recordings) recordings.push(await recordingAt(index));
    message('');

    this.show(recordings);
    const times = recordings.flatMap(({time_s}) => time_s).sort((a, b) => a - b);
    this.ticks = times.filter((t, k) => k === 0 || t - times[k - 1] > kSameTime);
    $('scrub').max = this.ticks.length - 1;
    $('transport').hidden = this.ticks.length < 2;
    this.phases = phasesOf(recordings[0], this.ticks);
    showPhases(this.phases);
    showVerdicts($('verdicts'), recordings);
    showFacts(figure, recordings, this.panes[0].gridCell);
    this.goTo(this.ticks[0]);
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
    setPlaying(true);
  }

  // Ends at a frame, not between two.
  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.goTo(this.ticks[indexAt(this.ticks, this.time)]);
    setPlaying(false);
  }

  turntable(on = !this.turning) {
    this.turning = on;
    this.turned = undefined;
    $('turntable').setAttribute('aria-pressed', on);
  }

  advance(now) {
    if (this.turning && this.panes.length > 0) {
      this.turn(this.turned === undefined ? 0 : 2 * Math.PI * (now - this.turned) / 1000 / kTurn, 0);
      this.turned = now;
    }
    if (!this.playing) return;
    this.goTo(this.time + (this.last === undefined ? 0 : (now - this.last) / 1000 * Number($('speed').value)));
    this.last = now;
    if (this.time >= this.ticks[this.ticks.length - 1]) {
      if ($('repeat').checked) this.goTo(this.ticks[0]); else this.pause();
    }
  }

  drawn() {
    showTime(this);
    clearTimeout(this.telling);
    this.telling = setTimeout(() => this.tell(), 1000 * kQuiet);
  }

  // Says what is shown, once it has stood still for a while.
  tell() {
    if (this.playing || this.turning) return;
    const frames = [...$('names').children].map(({textContent, lastChild}) =>
      `${textContent.slice(0, -lastChild.textContent.length)}, ${lastChild.textContent}`);
    const {front, right} = frontOf(this.up);
    const from = this.camera.position.clone().sub(this.controls.target).normalize();
    const degrees = (radians) => Math.round(radians * 180 / Math.PI);
    const around = degrees(Math.atan2(from.dot(right), from.dot(front)));
    const above = degrees(Math.asin(from.dot(this.up)));
    const hand = around > 0 ? 'right' : 'left';
    const side = around === 0 ? 'the front' : `${Math.abs(around)}° to the ${hand} of the front`;
    const height = above === 0 ? '' : `, ${Math.abs(above)}° ${above > 0 ? 'above' : 'below'}`;
    $('shown').textContent = `${this.time.toFixed(3)} s: ${frames.join('; ')}. Seen from ${side}${height}.`;
  }

  // The view with its background, as a file.
  async save() {
    this.draw();
    const view = $('view');
    const copy = Object.assign(document.createElement('canvas'), {width: view.width, height: view.height});
    const drawing = copy.getContext('2d');
    const background = drawing.createLinearGradient(0, 0, 0, copy.height);
    background.addColorStop(0, style('--stage-top'));
    background.addColorStop(1, style('--stage-bottom'));
    drawing.fillStyle = background;
    drawing.fillRect(0, 0, copy.width, copy.height);
    drawing.drawImage(view, 0, 0);
    const file = URL.createObjectURL(await new Promise((done) => { copy.toBlob(done); }));
    const name = `${page.title.replace(/[^\p{L}\p{N}_-]+/gu, '-')}-${this.time.toFixed(3)}s.png`;
    Object.assign(document.createElement('a'), {href: file, download: name}).click();
    setTimeout(() => URL.revokeObjectURL(file), 60_000);
  }
}
const kTurn = 12;  // s, once around
const kQuiet = 0.5;  // s

const unpacked = [];
async function recordingAt(index) {
  if (!unpacked[index]) {
    const facts = page.recordings[index];
    const bytes = await inflate(`frames-${index}`);
    const [frames, particles] = [facts.time_s.length, facts.particles];
    const kinds = facts.values ?? {};
    const values = facts.values ? unpackValues(await inflate(`values-${index}`), kinds, frames, particles) : {};
    unpacked[index] = new Recording(facts, unpack(bytes, frames, particles), values);
  }
  return unpacked[index];
}

// ---- dressing

// What goes on from which tick on, with how many ticks: of phases that end at a time, or with the last tick.
function phasesOf({phases}, ticks) {
  let from = 0;
  return (phases ?? []).flatMap(({name, until_s}) => {
    const next = until_s === undefined ? ticks.length - 1 : indexAt(ticks, until_s);
    const [first, count] = [from, next - from];
    from = Math.max(from, next);
    return count > 0 ? [{name, first, count}] : [];
  });
}

function showPhases(phases) {
  $('phases').hidden = phases.length < 2;
  $('phases').replaceChildren(...phases.map(({name, count}) => {
    const part = cell('span', name, {title: name});
    part.style.flexGrow = count;
    return part;
  }));
}

const phaseAt = (phases, tick) => phases.findLast(({first}) => first <= tick);

// ---- facts

// Rows of the panel that follow the time: label, and text of a recording's frame.
const kCurrent = [
  ['frame', (r, k) => `${r.first_frame + k} of ${r.first_frame + r.time_s.length - 1}`],
  ['time', (r, k) => `${r.time_s[k].toFixed(3)} s`],
  ['largest strain', (r, k) => r.stats && `${(100 * r.stats.largest_strain[k]).toPrecision(3)} %`],
  ['kinetic energy', (r, k) => r.stats && `${digits(r.stats.kinetic_energy_j[k])} J`],
  ['potential energy', (r, k) => r.stats && `${digits(r.stats.potential_energy_j[k])} J`],
  ['substeps', (r, k) => r.stats && `${r.stats.substep_count[k]}`],
  ['cuts of cloth', (r, k) => r.stats?.cloth_cut_count && `${r.stats.cloth_cut_count[k]}`],
];
let currentCells = [];

// Of what was recorded beside positions.
function levelsText(recordings) {
  const levels = recordings.flatMap(({recorded}) => Object.values(recorded).map(({most}) => most + 1));
  return levels.length > 0 ? ` Pressure and clearance are in ${Math.min(...levels)} levels, closer to each other near 0.` : '';
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
    `recording along each axis; strain, speed and bending energy are computed from them, the energy by the ` +
    `rigidities of the textile at the start.${levelsText(recordings)} While it plays, positions between two frames are interpolated. ` +
    `The grid has cells of ${grid}.`;
}

function showTime(viewer) {
  const index = indexAt(viewer.ticks, viewer.time);
  $('scrub').value = index;
  const last = viewer.ticks[viewer.ticks.length - 1];
  const clock = `${viewer.time.toFixed(3)} / ${last.toFixed(3)} s`;
  const phase = phaseAt(viewer.phases, index);
  $('clock').textContent = clock;
  $('scrub').setAttribute('aria-valuetext', phase ? `${clock}, ${phase.name}` : clock);
  [...$('phases').children].forEach((part, k) => {
    part.setAttribute('aria-current', viewer.phases[k] === phase);
    part.classList.toggle('narrow', part.scrollWidth > part.clientWidth + 1);
  });
  viewer.panes.forEach(({source, frame}, pane) => {
    kCurrent.forEach(([, text], k) => {
      currentCells[k][pane].textContent = (text(source, frame) ?? 'not recorded').replaceAll(' ', '\u00a0');
    });
    const strain = source.stats && (100 * source.stats.largest_strain[frame]).toPrecision(3);
    $('names').children[pane].lastChild.textContent = `frame ${source.first_frame + frame}` +
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
    if (viewer.ticks.length > 1 && !wanted.has('frame') && !isCalm()) viewer.play();
  };
  $('figures').append(...buttons);
  return choose(buttons[0], page.figures[0]);
}

function listen(viewer) {
  const toggle = () => (viewer.playing ? viewer.pause() : viewer.play());
  const end = () => viewer.step(Infinity);
  const start = () => viewer.step(-Infinity);
  $('play').addEventListener('click', toggle);
  $('first').addEventListener('click', start);
  $('back').addEventListener('click', () => viewer.step(-1));
  $('forward').addEventListener('click', () => viewer.step(1));
  $('scrub').addEventListener('input', () => {
    viewer.pause();
    viewer.goTo(viewer.ticks[Number($('scrub').value)]);
  });
  const facts = () => showPanel($('panel').hidden);
  $('turntable').addEventListener('click', () => viewer.turntable());
  $('picture').addEventListener('click', () => viewer.save());
  $('facts-button').addEventListener('click', facts);
  viewer.listen({
    r: () => viewer.turntable(), p: () => viewer.save(), i: facts,
    ' ': toggle, Home: start, End: end,
    ArrowLeft: (frames) => viewer.step(-frames), ArrowRight: (frames) => viewer.step(frames),
  });
}

const isFramed = window.self !== window.top;
function showPanel(shown) {
  $('panel').hidden = !shown;
  document.documentElement.classList.toggle('bare', isFramed && !shown);
  $('facts-button').setAttribute('aria-expanded', shown);
}

// What the address asks for, behind #: frame=97 to stand there, turn for the turntable, and facts, which with the
// tools are hidden in the frame of another page.
const wanted = new URLSearchParams(location.hash.slice(1));
const isCalm = () => matchMedia('(prefers-reduced-motion: reduce)').matches;

function heed(viewer) {
  if (wanted.has('frame')) {
    const [{first_frame, time_s}] = viewer.panes.map(({source}) => source);
    viewer.goTo(time_s[Math.min(Math.max(Number(wanted.get('frame')) - first_frame, 0), time_s.length - 1)] ?? 0);
  }
  viewer.turntable(wanted.has('turn'));
}

async function main() {
  page = JSON.parse(await inflateText('page'));
  document.title = page.title;
  $('title').textContent = page.title;
  const viewer = makeStage(Viewer);
  if (!viewer) return;
  listen(viewer);
  showPanel(wanted.has('facts') || !isFramed);
  await makeFigures(viewer);
  heed(viewer);
  document.body.dataset.state = 'ready';
  requestAnimationFrame((now) => viewer.tick(now));
}

main().catch((error) => message(`The page is damaged: ${error.message}`));
