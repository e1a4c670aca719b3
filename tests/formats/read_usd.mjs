// Prints what tinyusdz reads of USD files: the mesh of each at its first frame.
import {copyFileSync, mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const library = join(dirname(fileURLToPath(import.meta.url)), 'node_modules', 'tinyusdz');
globalThis.window = globalThis;  // it takes itself to be in a browser
process.type = 'renderer';
const folder = mkdtempSync(join(tmpdir(), 'weft-usd-'));
copyFileSync(join(library, 'tinyusdz.js'), join(folder, 'tinyusdz.mjs'));  // a module, but Node 18 goes by the name
const {default: load} = await import(join(folder, 'tinyusdz.mjs'));
rmSync(folder, {recursive: true});
const tinyusdz = await load({wasmBinary: readFileSync(join(library, 'tinyusdz.wasm'))});

const meshes = process.argv.slice(2).map((path) => {
  const stage = new tinyusdz.TinyUSDZLoaderNative();
  if (!stage.loadFromBinary(new Uint8Array(readFileSync(path)), path)) throw new Error(`${path}: ${stage.error()}`);
  const {points, faceVertexIndices} = stage.getMesh(0);
  return {meshes: stage.numMeshes(), points: [...points], triangles: faceVertexIndices.length / 3};
});
const {version} = JSON.parse(readFileSync(join(library, 'package.json')));
console.log(JSON.stringify({version, meshes}));
