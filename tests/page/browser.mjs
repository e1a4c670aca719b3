// Chromium, the program weft and a directory for files. BIN is the directory of weft and weftd, CHROMIUM a program,
// PICTURES where pictures go.
import {execFileSync} from 'node:child_process';
import {createHash} from 'node:crypto';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {after} from 'node:test';
import {chromium} from 'playwright-core';

export const directory = mkdtempSync(join(tmpdir(), 'weft-page-'));
export const file = (name) => join(directory, name);
export const program = (name) => join(process.env.BIN, name);
export const weft = (...words) =>
  execFileSync(program('weft'), words, {stdio: ['ignore', 'pipe', 'pipe'], encoding: 'utf8'});
let browser;

after(async () => {
  await browser?.close();
  rmSync(directory, {recursive: true});
});

// A page of its own kind; what goes wrong in it fails the test when it is closed. `asks` says which requests it may
// make, and `complains` which errors it may write to the console.
export async function open(url, {asks, complains = () => false, ...options}) {
  browser ??= await chromium.launch({
    executablePath: process.env.CHROMIUM,
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });
  const context = await browser.newContext({viewport: {width: 1280, height: 800}, ...options});
  const page = await context.newPage();
  const problems = [];
  page.on('pageerror', (error) => problems.push(error.message));
  page.on('console', (said) => said.type() === 'error' && !complains(said.text()) && problems.push(said.text()));
  page.on('request', (request) => asks(request.url()) || problems.push(request.url()));
  await page.goto(url);
  return {page, problems, context};
}

// Until what was asked for has been drawn.
export const settle = (page) => page.evaluate(() => new Promise((done) =>
  requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)))));
export const picture = (page, name) => page.screenshot({path: join(process.env.PICTURES, `${name}.png`)});
export const plain = (text) => text.replaceAll('\u00a0', ' ');
// What the canvas shows, to be compared.
export const canvas = async (page) =>
  createHash('sha256').update(await page.locator('#view').screenshot()).digest('hex');
