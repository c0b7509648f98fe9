// tightwire field: arrays and JSON that agree with each other and with arithmetic done here.
import { test, before, after } from 'node:test';
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, existsSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { tmpdir } from 'node:os';

const folder = mkdtempSync(join(tmpdir(), 'tightwire-field-'));
const suit = join(folder, 'suit');
const run = (...args) => spawnSync(process.env.TIGHTWIRE, args, { encoding: 'utf8' });
const bytes = (...path) => readFileSync(join(folder, ...path));
const numbers = (Kind, ...path) => {
  const data = bytes(...path);
  return new Kind(data.buffer.slice(data.byteOffset, data.byteOffset + data.length));
};
const field = (out, ...args) => run('field', '--worn', join(suit, 'suit.obj'), '--out', join(folder, out), ...args);

before(() => assert.equal(run('sample', '--out', suit, '--vertices', '3000').status, 0));
after(() => rmSync(folder, { recursive: true }));

test('without motion every edge costs its strip times eta', () => {
  const { status, stderr } = field('still', '--eta-mpa', '2', '--strip-width-mm', '10');
  assert.equal(status, 0, stderr);
  const json = JSON.parse(bytes('still', 'field.json'));
  const edges = numbers(Uint32Array, 'still', 'edge_vertex.u32');
  const weight = numbers(BigUint64Array, 'still', 'weight.u64');
  const coverage = numbers(Float32Array, 'still', 'coverage.f32');
  assert.equal(json.edges, weight.length);
  assert.equal(json.edges, edges.length / 2);
  assert.ok(numbers(Float64Array, 'still', 'density.f64').every((density) => density === 0));

  const run2 = field('length', '--weight', 'length');
  assert.equal(run2.status, 0, run2.stderr);
  const length = numbers(BigUint64Array, 'length', 'weight.u64');
  const lengthScale = JSON.parse(bytes('length', 'field.json')).scale;
  let checked = 0, overlapping = 0;
  for (let e = 0; e < weight.length; e++) {
    if (coverage[e] < 0.9999999) continue; // a hem, or a seam that gapes
    const want = (Number(length[e]) / lengthScale) * 10 * 2;
    const cost = Number(weight[e]) / json.scale;
    assert.ok(cost > want * (1 - 2e-6), `edge ${e} costs ${cost}, not ${want}`);
    checked++;
    overlapping += cost > want * (1 + 2e-6); // the two sides of a bent seam cover a place twice
  }
  assert.ok(checked > weight.length / 2, `${checked} of ${weight.length}`);
  assert.ok(overlapping < checked / 10, `${overlapping} of ${checked}`);
});

test('the field of two motions has the larger of their means, and the same bytes for any number of threads', () => {
  const motions = ['squat', 'walk'].map((name) => join(suit, 'motions', `${name}.pc2`)).map((path) => {
    assert.ok(existsSync(path), path);
    return ['--motion', path];
  }).flat();
  for (const threads of ['1', '3']) {
    const { status, stderr } = field(`threads${threads}`, ...motions, '--means', '--threads', threads);
    assert.equal(status, 0, stderr);
  }
  const squat = numbers(Float64Array, 'threads1', 'mean_0_squat.f64');
  const walk = numbers(Float64Array, 'threads1', 'mean_1_walk.f64');
  const density = numbers(Float64Array, 'threads1', 'density.f64');
  assert.ok(density.length > 5000);
  density.forEach((value, f) => assert.equal(value, Math.max(squat[f], walk[f])));
  for (const file of ['weight.u64', 'coverage.f32', 'density.f64', 'field.json'])
    assert.deepEqual(bytes('threads1', file), bytes('threads3', file), file);
});

test('the paper preset says what it changes, and what is set by hand stays', () => {
  const { status, stdout, stderr } = field('paper', '--preset', 'paper', '--overhang', 'forbid', '--json');
  assert.equal(status, 0, stderr);
  const json = JSON.parse(stdout);
  assert.deepEqual(json.preset_changes, { energy: 'printed' });
  assert.equal(json.options.overhang, 'forbid');
  assert.ok(json.forbidden_edges > 0);
  assert.ok(json.seconds.weights > 0);
});

test('an explicit option wins over the preset, in any order and when it names a default', () => {
  const options = (...more) => {
    const { status, stdout, stderr } = field('preset', '--json', ...more);
    assert.equal(status, 0, stderr);
    const { energy, overhang, preset } = JSON.parse(stdout).options;
    return { energy, overhang, preset };
  };
  const stvk = { energy: 'stvk', overhang: 'ignore', preset: 'paper' };
  assert.deepEqual(options('--preset', 'paper', '--energy', 'stvk'), stvk);
  assert.deepEqual(options('--energy=stvk', '--preset=paper'), stvk);
  assert.deepEqual(options('--overhang', 'charge', '--preset', 'paper'), { energy: 'printed', overhang: 'charge', preset: 'paper' });
  const twice = field('preset', '--preset', 'paper', '--preset', 'none');
  assert.equal(twice.status, 2);
  assert.match(twice.stderr, /--preset is given twice/);
});

test('what cannot be done exits 1 with one line, and a wrong call 2', () => {
  writeFileSync(join(folder, 'short.pc2'), bytes('suit', 'motions', 'walk.pc2').subarray(0, 5000));
  const cases = [
    [field('x', '--motion', join(folder, 'short.pc2')), 1, /short\.pc2/],
    [field('x', '--motion', join(folder, 'none.pc2')), 1, /none\.pc2/],
    [field('x', '--eta-mpa', 'auto'), 2, /eta/],
    [field('x', '--eta-mpa', '-1'), 2, /eta/],
    [field('x', '--energy', 'kinetic'), 2, /stvk/],
    [run('field', '--out', folder), 2, /--worn/],
    [run('field', '--worn'), 2, /--worn/],
  ];
  for (const [result, status, pattern] of cases) {
    assert.equal(result.status, status, result.stderr);
    assert.match(result.stderr, pattern);
    assert.equal(result.stderr.trim().split('\n').length, 1);
  }
  const help = run('field', '--help');
  assert.equal(help.status, 0);
  for (const name of ['preset', 'energy', 'reference', 'strip-width-mm', 'eta-mpa', 'overhang-share'])
    assert.match(help.stdout, new RegExp(`--${name}`));
});
