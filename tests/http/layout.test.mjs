// tightwire layout, from files to files: its document against the contract, its arithmetic against arithmetic done here,
// its drawings against another renderer, its exit codes and its one line on stderr.
import { test, before, after } from 'node:test';
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { existsSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import Ajv from 'ajv/dist/2020.js';
import { openapi, temporaryFolder, tightwire } from './service.mjs';

const folder = temporaryFolder();
const suit = join(folder.path, 'suit');
const run = (...args) => spawnSync(tightwire, args, { encoding: 'utf8' });
const file = (name, content) => {
  writeFileSync(join(folder.path, name), content);
  return join(folder.path, name);
};
const motions = () =>
  ['squat', 'walk'].flatMap((name) => ['--motion', join(suit, 'motions', `${name}.pc2`)]);
const layout = (out, terminals, ...args) =>
  run('layout', '--worn', join(suit, 'suit.obj'), '--terminals', terminals, '--out', join(folder.path, out), ...args);
const terminalSet = () => {
  const sets = join(suit, 'terminals');
  return join(sets, readdirSync(sets).find((name) => name.includes('10')));
};
const documentOf = (out) => JSON.parse(readFileSync(join(folder.path, out, 'layout.json')));

before(() => {
  const { status, stderr } = run('sample', '--out', suit, '--vertices', '3000');
  assert.equal(status, 0, stderr);
});
after(() => folder.remove());

test('a layout of the sample is optimal, fits the contract, and its sums add up', () => {
  const { status, stdout, stderr } = layout('joints', terminalSet(), ...motions(), '--json');
  assert.equal(status, 0, stderr);
  assert.equal(stderr, '');
  const document = documentOf('joints');
  const ajv = new Ajv({ strict: false, allErrors: true });
  ajv.addSchema(openapi, 'openapi');
  const check = ajv.compile({ $ref: 'openapi#/components/schemas/LayoutDocument' });
  assert.ok(check(document), JSON.stringify(check.errors?.slice(0, 3)));
  for (const wiring of [document.layout, document.baseline]) {
    assert.equal(wiring.outcome, 'optimal');
    assert.equal(wiring.weight, wiring.lower_bound);
    const energy = wiring === document.layout ? Number(wiring.weight) / wiring.weight_scale : null;
    for (const shown of [wiring.weight_mpa_mm2, wiring.lower_bound_mpa_mm2])
      if (energy === null) assert.equal(shown, null, 'edges are no energy');
      else assert.ok(Math.abs(shown / energy - 1) < 1e-6, `${shown} ${energy}`);
    const sum = (key) => wiring.branches.reduce((total, branch) => total + branch[key], 0);
    assert.ok(Math.abs(sum('length_mm') - wiring.metrics.length_mm) < 0.01);
    assert.ok(Math.abs(sum('energy_mpa_mm2') - wiring.metrics.energy_mpa_mm2) < 0.01);
    for (const branch of wiring.branches) {
      const spans = branch.spans.reduce(
        (total, { type, from_mm: a, to_mm: b, radius_mm, turn_rad }) =>
          total + (type === 'arc' ? radius_mm * Math.abs(turn_rad) : Math.hypot(a[0] - b[0], a[1] - b[1])),
        0,
      );
      assert.ok(Math.abs(spans - branch.length_mm) < 0.01, `${spans} ${branch.length_mm}`);
    }
    assert.equal(wiring.branches.length, wiring.metrics.branches);
    // A tree: ends and junctions are one more than branches.
    assert.equal(document.terminals.length + wiring.junctions.length, wiring.branches.length + 1);
  }
  assert.ok(document.layout.metrics.energy_mpa_mm2 < document.baseline.metrics.energy_mpa_mm2);
  const { energy } = document.reduction_percent;
  const ratio = document.layout.metrics.energy_mpa_mm2 / document.baseline.metrics.energy_mpa_mm2;
  assert.ok(Math.abs(energy - 100 * (1 - ratio)) < 1e-3);
  const figures = JSON.parse(stdout);
  assert.equal(figures.outcome, 'optimal');
  for (const path of figures.files) assert.ok(existsSync(path), path);
});

test('equal input gives equal bytes, whatever the threads', () => {
  for (const threads of ['1', '2'])
    assert.equal(layout(`threads${threads}`, terminalSet(), ...motions(), '--threads', threads).status, 0);
  for (const name of readdirSync(join(folder.path, 'threads1')))
    assert.deepEqual(
      readFileSync(join(folder.path, 'threads1', name)),
      readFileSync(join(folder.path, 'threads2', name)),
      name,
    );
});

test('another program can draw the drawings', { skip: spawnSync('rsvg-convert', ['--version']).status !== 0 }, () => {
  for (const name of ['pattern.svg', 'suit.svg']) {
    const { status, stdout, stderr } = spawnSync('rsvg-convert', ['-w', '300', join(folder.path, 'joints', name)]);
    assert.equal(status, 0, stderr.toString());
    assert.equal(stdout.subarray(1, 4).toString(), 'PNG');
  }
});

/* The boxes of the terminals' names, estimated from their anchors and letters. */
function boxesOfNames(svg, names, size) {
  const text = /<text x="([-\d.]+)" y="([-\d.]+)" font-size="[\d.]+"(?: text-anchor="(\w+)")?>([^<]*)<\/text>/g;
  return [...svg.matchAll(text)]
    .filter(([, , , , name]) => names.has(name))
    .map(([, x, y, anchor, name]) => {
      const width = 0.55 * size * name.length;
      const left = Number(x) - (anchor === 'end' ? width : anchor === 'middle' ? width / 2 : 0);
      return { name, left, right: left + width, top: Number(y) - 0.7 * size, bottom: Number(y) };
    });
}

test('no two names of terminals lie on each other', () => {
  const names = new Set(documentOf('joints').terminals.map(({ name }) => name));
  for (const [drawing, size] of [['pattern.svg', 9], ['suit.svg', 26]]) {
    const svg = readFileSync(join(folder.path, 'joints', drawing), 'utf8');
    for (const part of svg.split('<g id="back"')) {
      const boxes = boxesOfNames(part, names, size);
      assert.ok(boxes.length > 3 || part === svg);
      for (const a of boxes)
        for (const b of boxes)
          if (a !== b && a.left < b.right && b.left < a.right)
            assert.ok(a.bottom <= b.top || b.bottom <= a.top, `${a.name} and ${b.name}`);
    }
  }
});

test('a drawing says which baseline it is compared with', () => {
  assert.equal(layout('shortest', terminalSet(), '--baseline', 'length').status, 0);
  assert.match(readFileSync(join(folder.path, 'shortest', 'suit.svg'), 'utf8'), /dashed tree of least length/);
  assert.match(readFileSync(join(folder.path, 'joints', 'suit.svg'), 'utf8'), /dashed tree of fewest edges/);
});

test('the table keeps its columns where figures are nothing or missing', () => {
  for (const flags of [[], ['--baseline', 'none']]) {
    const { status, stdout } = layout('still', terminalSet(), ...flags);
    assert.equal(status, 0);
    const rows = stdout.split('\n').filter((line) => /^ {2}(energy|length)/.test(line));
    assert.equal(rows.length, 3);
    const units = rows.map((row) => row.search(/MPa·mm²$|mm$/));
    assert.deepEqual(units, units.map(() => units[0]), stdout);
    assert.ok(units[0] > 0, stdout);
    assert.match(rows[1], flags.length ? /without eta +0\.00 +- +- / : /without eta +0\.00 +0\.00 +- /);
  }
  const figures = JSON.parse(layout('still', terminalSet(), '--json').stdout);
  for (const name of ['energy_without_eta_mpa_mm2', 'baseline_energy_without_eta_mpa_mm2'])
    assert.ok(Object.is(figures[name], 0), `${name}: ${figures[name]}`);
});

test('a request outweighs defaults, and a flag outweighs the request', () => {
  const request = JSON.parse(readFileSync(terminalSet()));
  request.options = { baseline: 'length', elongation: false };
  const terminals = file('options.json', JSON.stringify(request));
  assert.equal(layout('request', terminals).status, 0);
  assert.equal(documentOf('request').options.baseline, 'length');
  assert.equal(layout('flag', terminals, '--baseline', 'none').status, 0);
  assert.equal(documentOf('flag').options.baseline, 'none');
  assert.equal(documentOf('flag').options.elongation, false);
  assert.equal(documentOf('flag').baseline, undefined);
});

test('bad input gives exit 1 and one line that names the place', () => {
  const obj = join(suit, 'suit.obj');
  const half = file('half.pc2', readFileSync(join(suit, 'motions', 'walk.pc2')).subarray(0, 5000));
  const cases = [
    [['--terminals', file('bad.json', '{"terminals":[{"vertex":-1}]}')], /terminals\/0\/vertex/],
    [['--terminals', file('far.json', '{"terminals":[{"vertex":99999999}]}')], /terminals\/0\/vertex/],
    [['--terminals', file('not.json', '{')], /line 1/],
    [['--terminals', join(folder.path, 'absent.json')], /absent\.json/],
    [['--terminals', terminalSet(), '--motion', half], /half\.pc2/],
    [['--terminals', terminalSet(), '--worn', file('empty.obj', '')], /empty\.obj/],
    [['--terminals', terminalSet(), '--out', join(obj, 'below-a-file')], /suit\.obj/],
  ];
  for (const [args, place] of cases) {
    const others = Object.entries({ '--worn': obj, '--out': join(folder.path, 'bad') }).filter(([flag]) => !args.includes(flag));
    const { status, stdout, stderr } = run('layout', ...others.flat(), ...args);
    assert.equal(status, 1, `${args}: ${stderr}`);
    assert.equal(stdout, '');
    assert.match(stderr, place);
    assert.equal(stderr.trimEnd().split('\n').length, 1, stderr);
  }
});

test('a wrong command line gives exit 2, --help explains every option', () => {
  for (const args of [[], ['--worn'], ['--speed', '9'], ['--baseline', 'none', 'stray']]) {
    const { status, stderr } = run('layout', ...args);
    assert.equal(status, 2, `${args}: ${stderr}`);
  }
  const { status, stdout } = run('layout', '--help');
  assert.equal(status, 0);
  for (const name of Object.keys(openapi.components.schemas.LayoutOptions.properties))
    assert.ok(stdout.includes(`--${name.replaceAll('_', '-')}`), name);
});
