// The page of `weft view` in Chromium, by what a person does; ./dev test-page runs it.
import assert from 'node:assert/strict';
import {readFileSync, statSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {before, test} from 'node:test';
import {canvas, file, open as openUrl, picture, plain, settle, weft} from './browser.mjs';
import {sewn} from './sewn.mjs';

before(() => {
  for (const [name, stiffness] of [['limp', '0'], ['stiff', '0.3']]) {
    weft('scene', 'new', '--template', 'paper-3', '--bend', stiffness, '-o', file(`${name}.json`));
    weft('record', file(`${name}.json`), '--embedded', '--to', '40', '-o', file(`${name}.weft`));
  }
  weft('view', file('limp.weft'), file('stiff.weft'), '-o', file('pair.html'), '--title', 'Limp and stiff');
  weft('view', file('stiff.weft'), '-o', file('one.html'));
  writeFileSync(file('sewn.json'), JSON.stringify(sewn()));
  weft('record', file('sewn.json'), '--embedded', '--to', '60', '-o', file('sewn.weft'));
  weft('view', file('sewn.weft'), '-o', file('sewn.html'));
  weft('drape', 'tshirt', '--size', '40', '--edge', '0.03', '--page', file('shirt.html'), '--recording', file('shirt.weft'));
});

// The page from disk, without a network, standing at its first frame.
async function open(name, {hash = '', ...options} = {}) {
  const {page, problems, context} = await openUrl(pathToFileURL(file(name)).href + hash,
    {reducedMotion: 'reduce', offline: true, asks: (url) => url.startsWith('file:'), ...options});
  await page.waitForSelector('body[data-state=ready]');
  await settle(page);
  return {page, close: async () => { await context.close(); assert.deepEqual(problems, []); }};
}

const clock = (page) => page.textContent('#clock');

test('one recording is shown with its facts', async () => {
  const {page, close} = await open('one.html');
  assert.equal(await clock(page), '0.000 / 4.000 s');
  const facts = plain(await page.textContent('#facts'));
  for (const fact of ['31 x 31', '33.33 mm', '3e-05 N m²', '2000 N/m', '32 line segments']) assert.ok(facts.includes(fact), fact);
  assert.match(await page.textContent('#precision'), /within 4\.1 µm/);
  await page.keyboard.press('End');
  await settle(page);
  assert.equal(await clock(page), '4.000 / 4.000 s');
  await picture(page, 'one');
  await close();
});

test('keys, buttons and the slider go through the frames', async () => {
  const {page, close} = await open('one.html');
  const steps = [
    [() => page.keyboard.press('ArrowRight'), '0.100'],
    [() => page.keyboard.press('Shift+ArrowRight'), '1.100'],
    [() => page.keyboard.press('ArrowLeft'), '1.000'],
    [() => page.getByLabel('One frame forward').click(), '1.100'],
    [() => page.getByLabel('First frame').click(), '0.000'],
    [() => page.getByLabel('Simulated time').fill('25'), '2.500'],
    [() => page.keyboard.press('Home'), '0.000'],
  ];
  for (const [act, time] of steps) {
    await act();
    await settle(page);
    assert.equal(await clock(page), `${time} / 4.000 s`);
  }
  await close();
});

test('it plays to the end and stops there', async () => {
  const {page, close} = await open('one.html');
  await page.locator('#speed').selectOption('4');
  await page.getByLabel('Play', {exact: true}).click();
  await page.waitForFunction(() => document.getElementById('clock').textContent.startsWith('4.000 /'));
  await page.getByLabel('Play', {exact: true}).waitFor();
  await close();
});

test('dragging turns the view, and F fits it again', async () => {
  const {page, close} = await open('one.html');
  await page.keyboard.press('End');
  await settle(page);
  const fitted = await canvas(page);
  await page.mouse.move(400, 400);
  await page.mouse.down();
  await page.mouse.move(600, 380, {steps: 4});
  await page.mouse.up();
  await settle(page);
  assert.notEqual(await canvas(page), fitted);
  await page.keyboard.press('f');
  await page.mouse.move(5, 5);  // takes away what it points at
  await page.evaluate(() => document.activeElement.blur());  // and the ring around it
  await settle(page);
  assert.equal(await canvas(page), fitted);
  await close();
});

test('two recordings stand side by side in step, with what differs in bold', async () => {
  const {page, close} = await open('pair.html');
  await page.keyboard.press('End');
  await settle(page);
  const names = await page.locator('#names div').allTextContents();
  assert.match(names[0], /^limpframe 40, strain up to /);
  assert.match(names[1], /^stiffframe 40, strain up to /);
  assert.deepEqual(await page.locator('tr.differs th').filter({hasText: 'k_b'}).allTextContents(), ['k_b,\u00a0bend']);
  await picture(page, 'pair');
  await page.locator('#colour').selectOption('strain');
  await page.getByRole('button', {name: 'Theme'}).click();
  await settle(page);
  assert.match(await page.textContent('#most'), /^\d+(\.\d+)? %$/);
  await picture(page, 'pair-strain-dark');
  await close();
});

test('colours of bending energy mean what weft render says', async () => {
  const {page, close} = await open('one.html');
  await page.keyboard.press('End');
  await page.locator('#colour').selectOption('bending');
  await page.getByLabel('Scale to this frame').check();
  await settle(page);
  const [, shown] = (await page.textContent('#most')).match(/^([\d.e-]+) J\/m²$/);
  const said = JSON.parse(weft('render', file('stiff.weft'), '--colour', 'bending', '--size', '64x64', '--json',
    '-o', file('bending.png'))).largest_bending_energy_j_per_m2;
  assert.ok(Math.abs(Number(shown) / said - 1) < 0.01, `${shown} J/m², ${said} J/m²`);
  await picture(page, 'one-bending');
  await close();
});

test('on a phone everything fits the width, and a finger turns the view', async () => {
  const {page, close} = await open('pair.html', {viewport: {width: 390, height: 844}, hasTouch: true, deviceScaleFactor: 2});
  await page.getByLabel('Simulated time').fill('30');
  await settle(page);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
  const before = await canvas(page);
  const touch = (type, x) => page.locator('#view').dispatchEvent(type, {touches: type === 'touchend' ? [] : [{identifier: 0, pageX: x, pageY: 300, clientX: x, clientY: 300}]});
  await touch('touchstart', 150);
  await touch('touchmove', 250);
  await touch('touchend', 250);
  await settle(page);
  assert.notEqual(await canvas(page), before);
  await picture(page, 'phone');
  await close();
});

test('ten seconds of 31 x 31 at 60 frames a second take less than 4 MB', async () => {
  weft('scene', 'new', '--template', 'flag', '--rows', '31', '-o', file('flag.json'));
  weft('record', file('flag.json'), '--embedded', '--to', '599', '-o', file('flag.weft'));
  weft('view', file('flag.weft'), '-o', file('flag.html'));
  assert.ok(statSync(file('flag.html')).size < 4e6, `${statSync(file('flag.html')).size} bytes`);
  const {page, close} = await open('flag.html');
  await page.keyboard.press('End');
  await settle(page);
  await picture(page, 'flag');
  await close();
});

test('200 frames of 15 000 particles take less than 8 MB, and less where that is asked', async () => {
  weft('scene', 'new', '--template', 'sphere', '--rows', '123', '--columns', '122', '--textile', 'wool_tropical',
    '--accuracy', 'draft', '--set', 'solver.max_self_weight_strain=0.1', '-o', file('large.json'));
  weft('record', file('large.json'), '--embedded', '--to', '199', '-o', file('large.weft'));
  const written = (...words) => JSON.parse(weft('view', file('large.weft'), '-o', file('large.html'), '--json', ...words));
  const whole = written();
  assert.ok(whole.bytes < 8e6, `${whole.bytes} bytes`);
  const small = written('--most-mb', '3');
  assert.ok(small.bytes < 3e6, `${small.bytes} bytes`);
  assert.ok(small.largest_error_m > whole.largest_error_m);
  const {page, close} = await open('large.html');
  await page.keyboard.press('End');
  await settle(page);
  await picture(page, 'large');
  await close();
});

test('a turntable turns by itself until it is stopped', async () => {
  const {page, close} = await open('one.html', {hash: '#frame=40&turn', viewport: {width: 480, height: 360}});
  assert.equal(await clock(page), '4.000 / 4.000 s');
  const turntable = page.getByRole('button', {name: 'Turntable'});
  assert.equal(await turntable.getAttribute('aria-pressed'), 'true');
  const before = await canvas(page);
  await settle(page);
  assert.notEqual(await canvas(page), before);
  await page.keyboard.press('r');
  assert.equal(await turntable.getAttribute('aria-pressed'), 'false');
  await settle(page);
  const stopped = await canvas(page);
  await settle(page);
  assert.equal(await canvas(page), stopped);
  await close();
});

test('a page of one frame is a still without playback', async () => {
  weft('view', file('stiff.weft'), '--frames', '40:40', '-o', file('still.html'));
  const {page, close} = await open('still.html');
  assert.equal(await page.locator('#transport').isVisible(), false);
  await picture(page, 'still');
  await close();
});

test('what is shown can be saved as a picture', async () => {
  const {page, close} = await open('one.html', {hash: '#frame=40'});
  const [saved] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('p')]);
  assert.equal(saved.suggestedFilename(), 'stiff-4.000s.png');
  await saved.saveAs(join(process.env.PICTURES, 'saved.png'));
  const {width, height} = await page.locator('#view').boundingBox();
  const header = readFileSync(join(process.env.PICTURES, 'saved.png')).subarray(16, 24);
  assert.deepEqual([header.readUInt32BE(0), header.readUInt32BE(4)], [Math.round(width), Math.round(height)]);
  await close();
});

test('in the frame of another page there is the cloth, and facts are a key away', async () => {
  writeFileSync(file('around.html'),
    '<iframe src="one.html" sandbox="allow-scripts" title="A drape" width="480" height="360"></iframe>');
  const {page, close} = await openUrl(pathToFileURL(file('around.html')).href, {asks: (url) => url.startsWith('file:')})
    .then(({page, problems, context}) => ({page, close: async () => { await context.close(); assert.deepEqual(problems, []); }}));
  const inside = page.frameLocator('iframe');
  await inside.locator('body[data-state=ready]').waitFor();
  assert.equal(await inside.locator('#panel').isVisible(), false);
  const {height} = await inside.locator('#stage').boundingBox();
  assert.ok(height > 260, `${height} pixels of 360`);
  await picture(page, 'framed');
  await inside.getByRole('button', {name: 'Facts'}).click();
  assert.equal(await inside.locator('#panel').isVisible(), true);
  await close();
});

test('who cannot see it hears what is shown, and reaches everything by keys', async () => {
  const {page, close} = await open('one.html', {hash: '#frame=40'});
  const shown = page.locator('#shown');
  await page.waitForFunction(() => document.getElementById('shown').textContent);
  assert.match(plain(await shown.textContent()),
    /^4\.000 s: stiff, frame 40, strain up to [0-9.]+ %\. Seen from 29° to the right of the front, 22° above\.$/);
  await page.keyboard.press('ArrowLeft');
  await page.waitForFunction(() => document.getElementById('shown').textContent.startsWith('3.900 s'));
  const reached = new Set();
  for (let k = 0; k < 40; ++k) {
    await page.keyboard.press('Tab');
    reached.add(await page.evaluate(() => document.activeElement.id));
  }
  for (const id of ['view', 'colour', 'pattern', 'layers-button', 'turntable', 'picture', 'facts-button', 'play', 'scrub', 'speed', 'repeat']) {
    assert.ok(reached.has(id), id);
  }
  await close();
});

test('no rule of accessibility is broken, in light and dark, wide and narrow', async () => {
  const narrow = {viewport: {width: 390, height: 844}};
  for (const [name, options] of ['pair', 'shirt'].flatMap((each) => [{}, {colorScheme: 'dark'}, narrow].map((option) => [each, option]))) {
    const {page, close} = await open(`${name}.html`, options);
    await page.locator('#colour').selectOption('strain');
    await page.keyboard.press('u');
    await page.locator('#layers-button').click();
    await settle(page);
    await page.addScriptTag({content: readFileSync(fileURLToPath(import.meta.resolve('axe-core')), 'utf8')});
    const {violations} = await page.evaluate(() => axe.run());
    assert.deepEqual(violations.map(({id, nodes}) => `${id}: ${nodes.map(({html}) => html).join(' ')}`), []);
    await close();
  }
});

const kSewn = {particles: 676, triangles: 1250};

test('a cloth of triangles is shown with its panels, in light and dark', async () => {
  const {page, close} = await open('sewn.html');
  const facts = plain(await page.textContent('#facts'));
  for (const fact of [`particles${kSewn.particles}`, `triangles${kSewn.triangles}`, 'panels2', 'panel left', 'grain 22.5°']) {
    assert.ok(facts.includes(fact), `${fact} in ${facts}`);
  }
  await page.keyboard.press('End');
  await settle(page);
  await picture(page, 'sewn');
  const cloth = await canvas(page);
  await page.locator('#colour').selectOption('panels');
  await settle(page);
  assert.deepEqual(await page.locator('#panels li').allTextContents(), ['left', 'right']);
  const panels = await canvas(page);
  assert.notEqual(panels, cloth);
  await page.keyboard.press('l');
  await settle(page);
  assert.notEqual(await canvas(page), panels);  // without seams
  await page.keyboard.press('l');
  await settle(page);
  await picture(page, 'sewn-panels');
  await page.getByRole('button', {name: 'Theme'}).click();
  await settle(page);
  await picture(page, 'sewn-panels-dark');
  await close();
});

test('colours of triangles mean what weft render says', async () => {
  const {page, close} = await open('sewn.html');
  await page.keyboard.press('End');
  await page.getByLabel('Scale to this frame').waitFor({state: 'attached'});
  for (const [colour, field] of [['strain', 'largest_strain'], ['warp', 'largest_warp_strain'],
    ['weft', 'largest_weft_strain'], ['shear', 'largest_shear'], ['bending', 'largest_bending_energy_j_per_m2']]) {
    await page.locator('#colour').selectOption(colour);
    await settle(page);
    await page.getByLabel('Scale to this frame').check();
    await settle(page);
    const shown = parseFloat(await page.textContent('#most')) / (colour === 'bending' ? 1 : 100);
    const said = JSON.parse(weft('render', file('sewn.weft'), '--colour', colour, '--size', '64x64', '--json',
      '-o', file('sewn.png')))[field];
    const rounding = colour === 'bending' ? 0 : 3e-4;  // of positions on the page
    assert.ok(Math.abs(shown - said) < 0.02 * said + rounding, `${colour}: ${shown}, ${said}`);
    const balanced = ['warp', 'weft', 'shear'].includes(colour);
    assert.equal((await page.textContent('#least')).startsWith(balanced ? '−' : '0'), true);
    await picture(page, `sewn-${colour}`);
  }
  await close();
});

test('on a phone the panels of a cloth fit the width', async () => {
  const {page, close} = await open('sewn.html', {viewport: {width: 390, height: 844}, hasTouch: true, deviceScaleFactor: 2, colorScheme: 'dark'});
  await page.keyboard.press('End');
  await page.locator('#colour').selectOption('warp');
  await settle(page);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
  await picture(page, 'sewn-phone');
  await close();
});

// Columns of the pixels of a colour that the view shows.
const columnsOf = async (page, colour) => {
  const png = (await page.locator('#view').screenshot()).toString('base64');
  return page.evaluate(async ([data, wanted]) => {
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], {type: 'image/png'}));
    const drawing = new OffscreenCanvas(image.width, image.height).getContext('2d');
    drawing.drawImage(image, 0, 0);
    const {data: pixels} = drawing.getImageData(0, 0, image.width, image.height);
    return Array.from({length: image.width * image.height}, (_, i) => i)
      .filter((i) => wanted.every((part, k) => Math.abs(pixels[4 * i + k] - part) < 12)).map((i) => i % image.width);
  }, [png, colour]);
};

test('a dressed garment is shown with its verdict, phases, and what presses it', async () => {
  const {page, close} = await open('shirt.html');
  const verdict = plain(await page.textContent('#verdicts'));
  assert.match(verdict, /Good drape.*at restyes.*cuts of clothnone.*in the bodynothing.*pressureup to [0-9.]+ kPa/);
  assert.deepEqual(await page.locator('#phases span').allTextContents().then((all) => all.map(plain)),
    ['seams close', 'weight comes in', 'comes to rest']);
  const current = () => page.locator('#phases [aria-current=true]').textContent().then(plain);
  assert.equal(await current(), 'seams close');
  await page.keyboard.press('End');
  await settle(page);
  assert.equal(await current(), 'comes to rest');
  await picture(page, 'shirt');

  const said = JSON.parse(weft('info', file('shirt.weft'), '--json')).header.format;
  assert.deepEqual([said.pressure, said.clearance], [true, true]);
  for (const [colour, unit] of [['pressure', 'kPa'], ['clearance', 'mm'], ['weft', '%']]) {
    await page.locator('#colour').selectOption(colour);
    await settle(page);
    assert.match(plain(await page.textContent('#most')), new RegExp(`^[\\d.]+ ${unit}`));
    await picture(page, `shirt-${colour}`);
  }
  // once its seams are closed no strain is as large as while they close
  assert.ok(parseFloat(await page.textContent('#most')) < 100);
  await close();
});

test('a recording keeps its verdict, which is shown with its frame, and what was not recorded cannot be chosen', async () => {
  weft('view', file('shirt.weft'), '--frames', '9:', '-o', file('late.html'));
  const late = await open('late.html');
  assert.match(plain(await late.page.textContent('#verdicts')), /Good drape/);
  await late.close();
  weft('view', file('shirt.weft'), '--frames', '0:9', '-o', file('early.html'));
  const early = await open('early.html');
  assert.equal(await early.page.locator('#verdicts section').count(), 0);
  await early.close();
  const {page, close} = await open('sewn.html');
  assert.equal(await page.locator('#phases').isVisible(), false);
  for (const colour of ['pressure', 'clearance']) {
    assert.equal(await page.locator(`#colour [value=${colour}]`).evaluate(({disabled}) => disabled), true);
  }
  await close();
});

test('a point is marked on the cloth and on its pattern, with its panel and value', async () => {
  const {page, close} = await open('shirt.html');
  await page.keyboard.press('End');
  await page.getByRole('button', {name: 'Pattern'}).click();
  await page.locator('#colour').selectOption('clearance');
  await settle(page);
  assert.deepEqual((await page.locator('#cut span').allTextContents()).slice(0, 2), ['front', 'back']);
  const {x, y, width, height} = await page.locator('#view').boundingBox();
  const front = await page.locator('#cut span').first().boundingBox();
  await page.mouse.move(front.x + front.width / 2, front.y + 40);
  await settle(page);
  assert.match(plain(await page.textContent('#probe')), /^front [\d.]+ mm$/);
  const marks = await columnsOf(page, [31, 95, 191]);  // in the accent of the page
  assert.ok(marks.some((at) => at < 0.5 * width) && marks.some((at) => at > 0.55 * width), `${marks.length} pixels`);
  await picture(page, 'shirt-pattern');

  // and from the cloth to the pattern: the same panel
  await page.mouse.move(x + 0.25 * width, y + 0.55 * height);
  await settle(page);
  assert.match(plain(await page.textContent('#probe')), /^front [\d.]+ mm$/);
  await page.mouse.move(x + 0.02 * width, y + 0.1 * height);
  await settle(page);
  assert.equal(await page.locator('#probe').isVisible(), false);
  await close();
});

test('one of two sheets is hidden, in space and on the pattern', async () => {
  const {sheets: [sheet], ...scene} = sewn();
  const over = {...sheet, name: 'over', placement: {origin_m: {...sheet.placement.origin_m, y: 0.3}}};
  writeFileSync(file('layers.json'), JSON.stringify({...scene, sheets: [sheet, over]}));
  weft('record', file('layers.json'), '--embedded', '--to', '5', '-o', file('layers.weft'));
  weft('view', file('layers.weft'), '-o', file('layers.html'));
  const {page, close} = await open('layers.html');
  await page.keyboard.press('u');
  await page.locator('#colour').selectOption('panels');
  await settle(page);
  assert.deepEqual((await page.locator('#cut span').allTextContents()).map(plain),
    ['cloth left', 'cloth right', 'over left', 'over right']);
  const both = await canvas(page);
  await picture(page, 'layers');
  await page.locator('#layers-button').click();
  await page.getByLabel('over').uncheck();
  await page.keyboard.press('Escape');
  await settle(page);
  const one = await canvas(page);
  assert.notEqual(one, both);
  await picture(page, 'layers-one');
  await page.locator('#layers-button').click();
  await page.getByLabel('over').check();
  await page.getByLabel('cloth').uncheck();
  await page.keyboard.press('Escape');
  await settle(page);
  assert.notEqual(await canvas(page), one);
  await close();
});

test('bodies are shown or not', async () => {
  const {page, close} = await open('shirt.html');
  await page.keyboard.press('End');
  await settle(page);
  const both = await canvas(page);
  await page.locator('#layers-button').click();
  await page.getByLabel('bodies').uncheck();
  await page.keyboard.press('Escape');
  await settle(page);
  assert.notEqual(await canvas(page), both);
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press('b');
  await settle(page);
  assert.equal(await canvas(page), both);
  await close();
});

test('on a phone a garment and its pattern fit the width, and a tap names a panel', async () => {
  for (const colorScheme of ['light', 'dark']) {
    const {page, close} = await open('shirt.html', {viewport: {width: 390, height: 844}, hasTouch: true, deviceScaleFactor: 2, colorScheme});
    await page.keyboard.press('End');
    await page.keyboard.press('u');
    await page.locator('#colour').selectOption('pressure');
    await settle(page);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
    const back = await page.locator('#cut span').nth(1).boundingBox();
    await page.touchscreen.tap(back.x + back.width / 2, back.y + 25);
    await settle(page);
    assert.match(plain(await page.textContent('#probe')), /^back [\d.]+ kPa$/);
    await picture(page, `shirt-phone-${colorScheme}`);
    await page.screenshot({path: join(process.env.PICTURES, `shirt-phone-whole-${colorScheme}.png`), fullPage: true});
    await close();
  }
});
