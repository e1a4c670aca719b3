// The page of `weft view`: shows recordings side by side, at one simulated time, through one camera.
// Lengths in m, times in s.
'use strict';

class Viewer extends Stage {
  ticks = [0];

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

  advance(now) {
    if (!this.playing) return;
    this.goTo(this.time + (this.last === undefined ? 0 : (now - this.last) / 1000 * Number($('speed').value)));
    this.last = now;
    if (this.time >= this.ticks[this.ticks.length - 1]) {
      if ($('repeat').checked) this.goTo(this.ticks[0]); else this.pause();
    }
  }

  drawn() { showTime(this); }
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
    `rigidities of the textile at the start. While it plays, positions between two frames are interpolated. ` +
    `The grid has cells of ${grid}.`;
}

function showTime(viewer) {
  const index = indexAt(viewer.ticks, viewer.time);
  $('scrub').value = index;
  const last = viewer.ticks[viewer.ticks.length - 1];
  const clock = `${viewer.time.toFixed(3)} / ${last.toFixed(3)} s`;
  $('clock').textContent = clock;
  $('scrub').setAttribute('aria-valuetext', clock);
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
    if (!matchMedia('(prefers-reduced-motion: reduce)').matches) viewer.play();
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
  viewer.listen({
    ' ': toggle, Home: start, End: end,
    ArrowLeft: (frames) => viewer.step(-frames), ArrowRight: (frames) => viewer.step(frames),
  });
}

async function main() {
  document.title = page.title;
  $('title').textContent = page.title;
  if (typeof DecompressionStream === 'undefined') {
    message('This browser is too old for the page: it lacks DecompressionStream (2023).');
    return;
  }
  const viewer = makeStage(Viewer);
  if (!viewer) return;
  listen(viewer);
  await makeFigures(viewer);
  document.body.dataset.state = 'ready';
  requestAnimationFrame((now) => viewer.tick(now));
}

main().catch((error) => message(`The page is damaged: ${error.message}`));
