// The page of `weft serve` in Chromium, by what a person does; ./dev test-page runs it.
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {after, before, test} from 'node:test';
import {canvas, directory, file, open as openUrl, picture, plain, program, settle, weft as run} from './browser.mjs';
import {sewn} from './sewn.mjs';

const programs = new Set();
let address;
let url;
let weftd;
let served;
let dressed;  // session of a garment at rest
const weft = (...words) => run(...words, '--server', address);
const scene = (session) => JSON.parse(weft('session', 'get', session, '--json')).scene;

// Starts a program and waits for the address in the first line that it writes.
async function start(name, ...words) {
  const started = spawn(program(name), words, {stdio: ['ignore', 'pipe', 'inherit']});
  programs.add(started);
  const line = await new Promise((done) => { started.stdout.once('data', (text) => done(String(text))); });
  return [started, line.match(/[\d.]+:\d+/)[0]];
}

async function stop(started, signal = 'SIGTERM') {
  programs.delete(started);
  const ended = new Promise((done) => { started.once('exit', done); });
  started.kill(signal);
  return ended;
}

const startWeftd = async (port) => {
  [weftd, address] = await start('weftd', '--port', port, '--data-dir', file('data'), '--log-level', 'off');
};

async function serve(port) {
  let where;
  [served, where] = await start('weft', 'serve', '--http', `127.0.0.1:${port}`, '--server', address,
    '--recordings', file('recordings'));
  url = `http://${where}/`;
}

before(async () => {
  await startWeftd('0');
  for (const [name, ...options] of [['ball', 'sphere'], ['curtain', 'hang', '--rows', '15', '--columns', '15']]) {
    weft('scene', 'new', '--textile', 'wool_tropical', '--template', ...options, '-o', file(`${name}.json`));
    weft('session', 'create', file(`${name}.json`), '--id', name);
  }
  writeFileSync(file('sewn.json'), JSON.stringify(sewn()));
  weft('session', 'create', file('sewn.json'), '--id', 'sewn');
  dressed = JSON.parse(weft('drape', 'tshirt', '--size', '40', '--edge', '0.03', '--json')).session.split('/')[1];
  mkdirSync(file('recordings'));
  await serve('0');
});

after(async () => {
  for (const started of programs) await stop(started, 'SIGKILL');
});

async function open(session = '', options = {}) {
  const own = (asked) => [url, url.replace('http', 'ws')].some((start) => asked.startsWith(start));
  const {page, problems, context} = await openUrl(`${url}${session && '#'}${session}`,
    {asks: own, complains: (text) => /Failed to load resource|WebSocket connection/.test(text), ...options});
  await page.waitForSelector('body[data-state=ready]');
  await settle(page);
  return {page, close: async () => { await context.close(); assert.deepEqual(problems, []); }};
}

const says = (page, id, pattern) => page.waitForFunction(
  ([name, source]) => new RegExp(source).test(document.getElementById(name).textContent.replaceAll('\u00a0', ' ')),
  [id, pattern.source]);
const play = (page) => page.getByLabel('Play', {exact: true}).click();
const pause = async (page) => {
  await page.getByLabel('Pause', {exact: true}).click();
  await page.getByLabel('Play', {exact: true}).waitFor();
};
const clock = async (page) => Number((await page.textContent('#clock')).match(/frame (\d+)/)[1]);
const pass = async (page, many) => page.waitForFunction(
  (last) => Number(document.getElementById('clock').textContent.match(/frame (\d+)/)[1]) >= last,
  await clock(page) + many);

// Records while `work` goes on; the frames of the file: rows of a time and x, y, z of every particle.
async function recorded(page, work) {
  await page.getByLabel('Record', {exact: true}).click();
  await says(page, 'doing', /Records to/);
  await work();
  await page.getByLabel('End the recording').click();
  await says(page, 'doing', /Recorded \d+ frames in/);
  const path = (await page.textContent('#doing')).match(/frames in (.*)\.$/)[1];
  assert.ok(path.startsWith(directory));
  weft('verify', path);
  weft('export', path, '--format', 'csv', '-o', `${path}.csv`);
  return readFileSync(`${path}.csv`, 'utf8').trim().split('\n').slice(1).map((line) => line.split(',').map(Number));
}

test('the sessions are listed with what they do, and one is chosen by a click', async () => {
  const {page, close} = await open();
  await page.getByRole('button', {name: /ball/}).waitFor();
  assert.match(plain(await page.getByRole('button', {name: /curtain/}).textContent()), /curtainpausedframe 0, 0\.000 s/);
  assert.match(await page.textContent('#names'), /ball/);
  await page.getByRole('button', {name: /curtain/}).click();
  await says(page, 'names', /curtain/);
  await close();
});

test('it runs as fast as asked, shows every state, and stands when it is paused', async () => {
  const {page, close} = await open('ball');
  const before = await canvas(page);
  await play(page);
  await pass(page, 40);
  assert.notEqual(await canvas(page), before);
  await says(page, 'names', /running/);
  await page.locator('#speed').selectOption('0.1');
  await says(page, 'doing', /Runs from frame \d+ on/);
  await pause(page);
  await says(page, 'names', /paused/);
  const {frame, state} = JSON.parse(weft('session', 'get', 'ball', '--json'));
  assert.equal(state, 'SESSION_STATE_PAUSED');
  await page.waitForFunction((last) => document.getElementById('clock').textContent.startsWith(`frame ${last},`), frame);
  await page.keyboard.press('ArrowRight');
  await says(page, 'clock', new RegExp(`frame ${frame + 1},`));
  await page.keyboard.press('Shift+ArrowRight');
  await says(page, 'clock', new RegExp(`frame ${frame + 11},`));
  await picture(page, 'serve');
  await close();
});

test('the mouse takes the cloth by a particle, which follows it and is let go', async () => {
  const {page, close} = await open('curtain');
  await page.locator('#speed').selectOption('1');
  await play(page);
  await pass(page, 20);
  let particle;
  const frames = await recorded(page, async () => {
    const {x, y, width, height} = await page.locator('#view').boundingBox();
    await page.mouse.move(x + width / 2, y + 0.35 * height);
    await page.mouse.down();
    await says(page, 'doing', /Leads particle \d+ from frame \d+ on/);
    assert.equal((await page.locator('#view').boundingBox()).width, width);  // whatever is said below it
    particle = Number((await page.textContent('#doing')).match(/particle (\d+)/)[1]);
    await page.mouse.move(x + width / 2 + 150, y + 0.35 * height - 60, {steps: 10});
    await pass(page, 60);
    await picture(page, 'serve-drag');
    await page.mouse.up();
    await says(page, 'doing', /Let go/);
    await pass(page, 60);
  });
  const at = (row) => row.slice(1 + 3 * particle, 4 + 3 * particle);
  const way = (a, b) => Math.hypot(...at(a).map((value, axis) => value - at(b)[axis]));
  // it went somewhere, was held there, and fell when it was let go
  const held = frames.findIndex((row, k) => k >= 10 && way(row, frames[k - 10]) === 0 && way(row, frames[0]) > 0.1);
  assert.ok(held > 0, 'it was led away and held');
  assert.ok(way(frames.at(-1), frames[held]) > 0.02, 'it was let go');
  await pause(page);
  await close();
});

test('a cloth of triangles is shown by its panels and led by any particle', async () => {
  const {page, close} = await open('sewn');
  await page.locator('#speed').selectOption('1');
  await play(page);
  await pass(page, 20);
  await page.locator('#colour').selectOption('panels');
  const {x, y, width, height} = await page.locator('#view').boundingBox();
  await page.mouse.move(x + 0.6 * width, y + 0.45 * height);
  await page.mouse.down();
  await says(page, 'doing', /Leads particle \d+ from frame \d+ on/);
  await page.mouse.move(x + 0.6 * width + 80, y + 0.45 * height - 60, {steps: 10});
  await pass(page, 30);
  assert.deepEqual(await page.locator('#panels li').allTextContents(), ['left', 'right']);
  await picture(page, 'serve-sewn');
  await page.mouse.up();
  await says(page, 'doing', /Let go/);
  await page.locator('#colour').selectOption('weft');
  await says(page, 'least', /^−[\d.]+ %$/);
  await pause(page);
  await picture(page, 'serve-sewn-weft');
  await close();
});

test('a garment is shown with what presses it, and is judged', async () => {
  const {page, close} = await open(dressed);
  await says(page, 'names', /paused, at rest/);
  await page.locator('#colour').selectOption('pressure');
  await says(page, 'most', /^0\.\d+ kPa or more$/);
  const most = parseFloat(await page.textContent('#most'));
  assert.ok(most > 0.01 && most < 1, `${most} kPa`);
  await picture(page, 'serve-pressure');
  await page.locator('#colour').selectOption('clearance');
  await says(page, 'most', /^[1-9]\d mm or more$/);
  await page.getByRole('button', {name: 'Pattern'}).click();
  await page.getByRole('button', {name: 'Judge'}).click();
  await says(page, 'verdicts', /Good drape.*Frame \d+.*in the body.*nothing/);
  await settle(page);
  await picture(page, 'serve-clearance');
  await page.locator('#colour').selectOption('cloth');
  await play(page);
  await pass(page, 5);
  await pause(page);
  await close();
});

test('a garment takes another fabric, and is led from its pattern or by the cloth itself', async () => {
  const {page, close} = await open(dressed, {colorScheme: 'dark'});
  await page.locator('#preset').selectOption('textiles/denim_11oz');
  await says(page, 'applied', /: from frame \d+ on/);
  await page.locator('#colour').selectOption('warp');
  await play(page);
  await pass(page, 5);
  const {x, y, width, height} = await page.locator('#view').boundingBox();
  await page.mouse.move(x + width / 2, y + 0.7 * height);
  await page.mouse.down();
  await says(page, 'doing', /Leads particle \d+ from frame \d+ on/);
  await page.mouse.move(x + 0.75 * width, y + 0.6 * height, {steps: 10});
  await pass(page, 20);
  await picture(page, 'serve-garment');
  await page.mouse.up();
  await says(page, 'doing', /Let go/);
  await pass(page, 5);
  await pause(page);
  await close();
});

// A box whose upper side rises by 0.3 m from its first pose to its second.
function lid() {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 4 ? 0.2 : -0.2, k & 2 ? 0.05 : -0.05, k & 1 ? 0.2 : -0.2]);
  const triangles = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3];
  const risen = corners.map(([x, y, z]) => [x, y > 0 ? y + 0.3 : y, z]);
  const planes = (points) => [0, 1, 2].flatMap((axis) => points.map((point) => point[axis]));
  const base64 = (array) => Buffer.from(array.buffer).toString('base64');
  return {name: 'lid', mesh: {data: {triangles: base64(Uint32Array.from(triangles)),
    poses: {times_s: [10, 11], positions_m: base64(Float32Array.from([...planes(corners), ...planes(risen)]))}}}};
}

test('a slider leads a body through its poses, and it is drawn where it is', async () => {
  const {sheets: [sheet], ...rest} = sewn(true);
  const cloth = {...sheet, textile: {...sheet.textile, damping_ratio: 0.01}};
  const over = {...cloth, name: 'over', placement: {origin_m: {...sheet.placement.origin_m, y: 0.3}}};
  writeFileSync(file('lid.json'), JSON.stringify({...rest, sheets: [cloth, over], colliders: [lid()]}));
  weft('session', 'create', file('lid.json'), '--id', 'lid');
  const {page, close} = await open('lid');
  assert.equal(await page.locator('#posed').isVisible(), true);
  await says(page, 'poses', /lid10\.00 s/);
  await page.getByLabel('Pose of lid').fill('10.5');
  await says(page, 'doing', /Leads lid from frame 1 on, when it runs/);
  await play(page);
  await says(page, 'poses', /lid10\.50 s/);
  await pause(page);
  await settle(page);
  await picture(page, 'serve-poses');
  await page.getByLabel('Pose of lid').fill('10.9');
  weft('act', 'pose', 'lid', '--to', '10.2');
  await play(page);
  await says(page, 'poses', /lid10\.20 s/);
  await pause(page);
  assert.ok(Math.abs(Number(await page.getByLabel('Pose of lid').inputValue()) - 10.2) < 0.01, 'another led it');
  await page.setViewportSize({width: 390, height: 844});
  await page.locator('#posed').scrollIntoViewIfNeeded();
  await settle(page);
  await picture(page, 'serve-poses-phone');
  await page.setViewportSize({width: 1280, height: 800});
  const show = async (sheets) => {
    await page.locator('#layers-button').click();
    for (const name of ['cloth', 'over']) await page.locator('#layers').getByLabel(name).setChecked(sheets);
    await page.keyboard.press('Escape');
    await settle(page);
  };
  await show(false);
  const body = await canvas(page);
  await play(page);
  await pass(page, 2);
  await pause(page);
  await settle(page);
  assert.equal(await canvas(page), body, 'nothing leads it');
  await page.getByLabel('Pose of lid').fill('10.8');
  await play(page);
  await says(page, 'poses', /lid10\.80 s/);
  await pause(page);
  await settle(page);
  assert.notEqual(await canvas(page), body);
  await show(true);
  await page.getByRole('button', {name: 'Fit'}).click();
  await settle(page);
  const drawn = await canvas(page);
  await page.getByRole('button', {name: 'Pattern'}).click();
  await settle(page);
  await picture(page, 'serve-folds');
  await page.getByRole('button', {name: 'Pattern'}).click();
  await settle(page);
  assert.equal(await canvas(page), drawn);
  await close();
});

test('damping that a textile leaves to the server is no number, and a preset keeps its ratio', async () => {
  const {page, close} = await open('lid');
  const damping = page.getByLabel('Damping, g/s');
  assert.equal(await damping.inputValue(), '');
  assert.equal(await damping.getAttribute('placeholder'), 'auto');
  await page.locator('#preset').selectOption('textiles/denim_11oz');
  await says(page, 'applied', /: from frame \d+ on/);
  assert.equal(scene('lid').sheets[0].textile.damping_ratio, 0.01);
  await close();
});

test('a body without poses has no slider', async () => {
  const {page, close} = await open('ball');
  assert.equal(await page.locator('#posed').isVisible(), false);
  await close();
});

test('sliders and typed numbers change the textile while it runs', async () => {
  const {page, close} = await open('ball');
  await page.locator('#speed').selectOption('1');
  await play(page);
  await page.getByLabel('Shear', {exact: true}).focus();
  for (let k = 0; k < 20; ++k) await page.keyboard.press('ArrowRight');
  const shown = await page.getByLabel('Shear, N/m').inputValue();
  await says(page, 'applied', new RegExp(`Shear ${shown} N/m: from frame \\d+ on\\. A frame takes \\d+ substeps`));
  assert.equal(scene('ball').sheets[0].textile.measured.shear_n_per_m, Number(shown));

  await page.getByLabel('Bending, warp, µN m').fill('120');
  await page.keyboard.press('Enter');
  await says(page, 'applied', /Bending, warp 120 µN m: from frame/);
  assert.equal(scene('ball').sheets[0].textile.measured.bend_rigidity_warp_n_m, 120e-6);
  await page.getByLabel('Damping', {exact: true}).press('Home');
  await says(page, 'applied', /Damping 0 g\/s: from frame/);
  assert.equal(scene('ball').sheets[0].textile.damping_kg_per_s, 0);

  await page.locator('#preset').selectOption({label: await page.locator('#preset option').nth(1).textContent()});
  await says(page, 'applied', /: from frame \d+ on/);
  const {measured} = scene('ball').sheets[0].textile;
  assert.equal(Number(await page.getByLabel('Weight, g/m²').inputValue()), Number((1e3 * measured.areal_density_kg_per_m2).toPrecision(3)));
  await pause(page);
  await close();
});

test('colours of bending energy follow the textile, while the cloth stands too', async () => {
  const {page, close} = await open('ball');
  await page.locator('#colour').selectOption('bending');
  await page.getByLabel('Scale to this frame').check();
  await says(page, 'most', /^[\d.e-]+ J\/m²$/);
  const most = async () => parseFloat(await page.textContent('#most'));
  const before = await most();
  for (const along of ['warp', 'weft']) {
    const field = page.getByLabel(`Bending, ${along}, µN m`);
    await field.fill(String(4 * Number(await field.inputValue())));
    await page.keyboard.press('Enter');
    await says(page, 'applied', new RegExp(`Bending, ${along} .* from frame`));
  }
  await settle(page);
  assert.ok(Math.abs(await most() / before - 4) < 0.05, `${before}, ${await most()}`);
  await picture(page, 'serve-bending');
  await close();
});

test('what the server refuses is one sentence, and the slider goes back', async () => {
  const {page, close} = await open('ball');
  const before = await page.getByLabel('Friction, number').inputValue();
  await page.getByLabel('Friction, number').fill('11');
  await page.keyboard.press('Enter');
  await says(page, 'trouble', /friction_coefficient: 11 is not within 0 to 10/);
  assert.equal(await page.getByLabel('Friction, number').inputValue(), before);
  await picture(page, 'serve-trouble');
  await close();
});

test('servers that go away and come back are said so, and shown again', async () => {
  const {page, close} = await open('curtain', {colorScheme: 'dark'});
  const last = await clock(page);
  await stop(weftd);
  await says(page, 'trouble', /no connection to/);
  await picture(page, 'serve-gone-dark');
  await startWeftd(address.split(':')[1]);
  await page.locator('#trouble').waitFor({state: 'hidden'});
  assert.equal(await clock(page), last);

  assert.equal(await stop(served, 'SIGINT'), 0);
  await says(page, 'trouble', /weft serve does not answer/);
  await serve(new URL(url).port);
  await page.locator('#trouble').waitFor({state: 'hidden'});
  await play(page);
  await pass(page, 10);
  await pause(page);
  await close();
});

test('on a phone everything fits the width, and a finger drags the cloth', async () => {
  const {page, close} = await open('curtain', {viewport: {width: 390, height: 844}, hasTouch: true, isMobile: true, deviceScaleFactor: 2});
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
  await play(page);
  await pass(page, 5);
  const {x, y, width, height} = await page.locator('#view').boundingBox();
  const fingers = await page.context().newCDPSession(page);
  const touch = (type, ...points) => fingers.send('Input.dispatchTouchEvent', {type, touchPoints: points.map(([px, py]) => ({x: px, y: py}))});
  await touch('touchStart', [x + width / 2, y + 0.4 * height]);
  await says(page, 'doing', /Leads particle/);
  for (let k = 1; k <= 8; ++k) await touch('touchMove', [x + width / 2 + 8 * k, y + 0.4 * height - 4 * k]);
  await pass(page, 20);
  await picture(page, 'serve-phone');
  await touch('touchEnd');
  await says(page, 'doing', /Let go/);
  await pause(page);
  await page.locator('#panel').scrollIntoViewIfNeeded();
  await page.screenshot({path: `${process.env.PICTURES}/serve-phone-whole.png`, fullPage: true});
  await close();
});

test('a hand takes the nearest particle that is simulated', async () => {
  weft('scene', 'new', '--template', 'hang', '--textile', 'wool_tropical', '--rows', '25', '--columns', '25',
    '--set', 'sheets[0].grid.simulated_every=4', '-o', file('smooth.json'));
  weft('session', 'create', file('smooth.json'), '--id', 'smooth');
  const {page, close} = await open('smooth');
  const {x, y, width, height} = await page.locator('#view').boundingBox();
  await page.mouse.move(x + width / 2 + 7, y + 0.4 * height + 5);
  await page.mouse.down();
  await says(page, 'doing', /Leads particle/);
  const particle = Number((await page.textContent('#doing')).match(/particle (\d+)/)[1]);
  assert.deepEqual([Math.floor(particle / 25) % 4, particle % 25 % 4], [0, 0]);
  await page.mouse.up();
  await says(page, 'doing', /Let go/);
  await close();
});

test('a hand lets go when its page is closed', async () => {
  const {page, close} = await open('curtain');
  await play(page);
  const {x, y, width, height} = await page.locator('#view').boundingBox();
  await page.mouse.move(x + width / 2, y + 0.35 * height);
  await page.mouse.down();
  await says(page, 'doing', /Leads particle/);
  const particle = Number((await page.textContent('#doing')).match(/particle (\d+)/)[1]);
  const place = `${Math.floor(particle / 15)},${particle % 15}`;
  assert.throws(() => weft('act', 'grab', 'curtain', place));
  await close();
  for (let free = false; !free;) {
    try {
      weft('act', 'grab', 'curtain', place);
      free = true;
    } catch {
      free = false;
    }
  }
  weft('act', 'release', 'curtain', place);
});
