// The page of `weft view` in Chromium, by what a person does; ./dev test-page runs it.
import assert from 'node:assert/strict';
import {statSync, writeFileSync} from 'node:fs';
import {pathToFileURL} from 'node:url';
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
});

// The page from disk, without a network, standing at its first frame.
async function open(name, options = {}) {
  const {page, problems, context} = await openUrl(pathToFileURL(file(name)).href,
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
  await page.evaluate(() => document.activeElement.blur());  // takes away the ring around it
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

test('ten seconds of 31 x 31 at 60 frames a second take less than 5 MB', async () => {
  weft('scene', 'new', '--template', 'flag', '--rows', '31', '-o', file('flag.json'));
  weft('record', file('flag.json'), '--embedded', '--to', '599', '-o', file('flag.weft'));
  weft('view', file('flag.weft'), '-o', file('flag.html'));
  assert.ok(statSync(file('flag.html')).size < 5e6, `${statSync(file('flag.html')).size} bytes`);
  const {page, close} = await open('flag.html');
  await page.keyboard.press('End');
  await settle(page);
  await picture(page, 'flag');
  await close();
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
  await page.keyboard.press('l');
  await settle(page);
  assert.deepEqual(await page.locator('#panels li').allTextContents(), ['left', 'right']);
  assert.notEqual(await canvas(page), cloth);
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
