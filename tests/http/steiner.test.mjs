// `tightwire steiner` as a program: what it prints, where, and how it exits. The tree is checked here by its own means.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { temporaryFolder, tightwire } from './service.mjs';

const square = 'SECTION Graph\nNodes 5\nEdges 5\nE 1 2 3\nE 2 3 4\nE 3 4 5\nE 1 4 20\nE 4 5 1\nEND\n\n'
  + 'SECTION Terminals\nTerminals 3\nT 1\nT 3\nT 4\nEND\n\nEOF\n';

const steiner = (input, ...flags) =>
  spawnSync(tightwire, ['steiner', ...flags], { input, encoding: 'utf8', timeout: 60000, maxBuffer: 1 << 26 });

/** A grid of side*side vertices with pseudo-random weights and terminals on a coarser grid. */
function grid(side, step, seed = 1) {
  let state = seed;
  const random = () => (state = (state * 48271) % 2147483647);
  const edges = [], terminals = [];
  for (let y = 0; y < side; y++)
    for (let x = 0; x < side; x++) {
      const v = y * side + x + 1;
      if (x + 1 < side) edges.push([v, v + 1, 1000 + random() % 1000]);
      if (y + 1 < side) edges.push([v, v + side, 1000 + random() % 1000]);
      if (x % step === step >> 1 && y % step === step >> 1) terminals.push(v);
    }
  const text = `33D32945 STP File, STP Format Version 1.0\n\nSECTION Graph\nNodes ${side * side}\nEdges ${edges.length}\n`
    + edges.map((e) => `E ${e.join(' ')}\n`).join('')
    + `END\n\nSECTION Terminals\nTerminals ${terminals.length}\n${terminals.map((t) => `T ${t}\n`).join('')}END\n\nEOF\n`;
  return { text, edges, terminals };
}

/** Checks that `chosen` is a tree that spans the terminals, and returns its weight. */
function weigh({ edges, terminals }, chosen) {
  const weights = new Map(edges.map(([u, v, w]) => [`${u} ${v}`, w]));
  const group = new Map();
  const find = (v) => (group.has(v) && group.get(v) !== v ? find(group.get(v)) : v);
  let sum = 0;
  for (const [u, v] of chosen) {
    const weight = weights.get(`${u} ${v}`) ?? weights.get(`${v} ${u}`);
    assert.ok(weight !== undefined, `${u} ${v} is an edge`);
    assert.notEqual(find(u), find(v), `${u} ${v} closes a cycle`);
    group.set(find(u), find(v));
    sum += weight;
  }
  assert.equal(new Set(terminals.map(find)).size, 1, 'the terminals hang together');
  return sum;
}

test('a tree is printed as PACE wants it', () => {
  const { status, stdout, stderr } = steiner(square, '-');
  assert.equal(stdout, 'VALUE 12\n1 2\n2 3\n3 4\n');
  assert.equal(stderr, '');
  assert.equal(status, 0);
});

test('the JSON answer holds outcome, weight, bound, gap, edges and statistics', () => {
  const answer = JSON.parse(steiner(square, '-', '--json').stdout);
  assert.equal(answer.outcome, 'optimal');
  assert.equal(answer.weight, '12');
  assert.equal(answer.lower_bound, '12');
  assert.equal(answer.gap_percent, 0);
  assert.deepEqual(answer.edges, [[1, 2], [2, 3], [3, 4]]);
  assert.ok(Number.isInteger(answer.stats.work));
  assert.equal(answer.stats.seconds, undefined, 'the clock is not in the answer unless asked for');
  assert.ok(JSON.parse(steiner(square, '-', '--json', '--stats').stdout).stats.seconds.total >= 0);
});

test('the same answer for every number of threads and every time', () => {
  const { text } = grid(40, 10);
  const answers = new Set(['1', '2', '4', '1'].map((n) => steiner(text, '-', '--json', '--threads', n).stdout));
  assert.equal(answers.size, 1);
});

test('a work limit ends with a valid tree, a bound below it, and the same bytes again', () => {
  const instance = grid(60, 6);
  const first = steiner(instance.text, '-', '--json', '--work-limit', '3000000');
  const answer = JSON.parse(first.stdout);
  assert.equal(weigh(instance, answer.edges), Number(answer.weight));
  assert.ok(Number(answer.lower_bound) > 0 && Number(answer.lower_bound) <= Number(answer.weight));
  assert.equal(steiner(instance.text, '-', '--json', '--work-limit', '3000000').stdout, first.stdout);
});

test('an interrupt ends with the best tree so far', async () => {
  const instance = grid(150, 10);
  const folder = temporaryFolder();
  const file = join(folder.path, 'grid.stp');
  writeFileSync(file, instance.text);
  const child = spawn(tightwire, ['steiner', file, '--json']);
  let stdout = '';
  child.stdout.on('data', (bytes) => (stdout += bytes));
  setTimeout(() => child.kill('SIGINT'), 700);
  await new Promise((resolve) => child.on('close', resolve));
  const answer = JSON.parse(stdout);
  assert.equal(weigh(instance, answer.edges), Number(answer.weight));
  assert.ok(Number(answer.lower_bound) <= Number(answer.weight));
});

/** What a certificate proves for an instance, worked out as `tightwire certificate --help` says. */
function prove({ edges, terminals }, text) {
  const lines = text.split('\n').filter((line) => line && !line.startsWith('#')).map((line) => line.split(' '));
  const next = (keyword) => {
    const [word, ...numbers] = lines.shift();
    assert.equal(word, keyword);
    return numbers.map(BigInt);
  };
  const rows = (count) => lines.splice(0, Number(count)).map((numbers) => numbers.map(BigInt));
  assert.equal(lines.shift().join(' '), 'TIGHTWIRE STEINER CERTIFICATE 1');
  assert.deepEqual(next('INSTANCE').slice(1), [BigInt(edges.length), BigInt(terminals.length)]);
  const [weight] = next('WEIGHT'), [bound] = next('BOUND'), [certified] = next('CERTIFIED');
  const tree = rows(next('TREE')[0]).map(([u, v]) => [Number(u), Number(v)]);
  const [root, scale, total, potentials] = next('DUAL');
  const taken = new Map();
  let sum = 0n;
  for (let i = 0n; i < potentials; i++) {
    const [terminal, radius, members] = next('POTENTIAL');
    const value = new Map(rows(members));
    const at = (v) => value.get(BigInt(v)) ?? radius;
    assert.ok(terminals.includes(Number(terminal)) && at(terminal) === 0n && at(root) === radius);
    for (const [u, v] of edges) {
      for (const [arc, fall] of [[`${u} ${v}`, at(u) - at(v)], [`${v} ${u}`, at(v) - at(u)]])
        if (fall > 0n) taken.set(arc, (taken.get(arc) ?? 0n) + fall);
    }
    sum += radius;
  }
  next('END');
  for (const [u, v, w] of edges)
    for (const arc of [`${u} ${v}`, `${v} ${u}`])
      assert.ok((taken.get(arc) ?? 0n) <= BigInt(w) * scale, `${arc} bears what is taken from it`);
  assert.equal(sum, total);
  assert.equal((total + scale - 1n) / scale, certified);
  return { weight: Number(weight), bound: Number(bound), certified: Number(certified), tree };
}

test('a certificate proves its tree and its bound, here and by `tightwire certificate`', () => {
  const instance = grid(40, 10), folder = temporaryFolder();
  const file = join(folder.path, 'grid.stp'), certificate = join(folder.path, 'grid.certificate');
  writeFileSync(file, instance.text);
  const answer = JSON.parse(steiner('', file, '--json', '--certificate', certificate).stdout);
  const text = readFileSync(certificate, 'utf8');
  const proof = prove(instance, text);
  assert.equal(weigh(instance, proof.tree), proof.weight);
  assert.equal(proof.weight, Number(answer.weight));
  assert.equal(proof.bound, Number(answer.lower_bound));
  assert.ok(proof.certified <= proof.weight && proof.certified > 0.9 * proof.weight);

  const check = (...files) => spawnSync(tightwire, ['certificate', ...files], { encoding: 'utf8', timeout: 60000 });
  const good = check(file, certificate);
  assert.equal(good.status, 0, good.stderr);
  assert.ok(good.stdout.includes(`no tree weighs less than ${proof.certified} `));
  for (const [from, to, words] of [
    [/^WEIGHT .*/m, `WEIGHT ${proof.weight + 1}`, /tree: the edges weigh/],
    [/^CERTIFIED .*/m, `CERTIFIED ${proof.certified + 1}`, /certified: is not the total/],
    [/^(POTENTIAL \d+) \d+ /m, '$1 999999999999 ', /potentials: take more|total: is /],
    [/^END/m, '', /the file ends where END should stand/],
  ]) {
    writeFileSync(certificate, text.replace(from, to));
    const { status, stdout, stderr } = check(file, certificate);
    assert.equal(status, 1);
    assert.equal(stdout, '');
    assert.match(stderr, words);
  }
  assert.equal(check(file).status, 2);
  assert.match(check('/does/not/exist', certificate).stderr, /does\/not\/exist: cannot open/);
});

test('no tree, no certificate', () => {
  const certificate = join(temporaryFolder().path, 'none');
  const apart = square.replace('E 3 4 5', 'E 4 5 5').replace('E 1 4 20', 'E 4 5 5');
  assert.equal(steiner(apart, '-', '--certificate', certificate).status, 1);
  assert.ok(!existsSync(certificate));
});

test('a wrong file is one line on stderr that names the line, and exit code 1', () => {
  for (const [text, words] of [
    ['', /the file is empty/],
    ['SECTION Comment\n', /line 1: the file ends here without EOF/],
    [square.replace('E 2 3 4', 'E 2 9 4'), /line 5: vertex 9 is not one of 1 to 5/],
    [square.replace('E 2 3 4', 'E 2 3 4.5'), /line 5: expected a whole/],
    [square.replace('E 2 3 4', 'E 2 3 4 7 8'), /line 5: expected nothing behind the edge's weight/],
    [square.replace('Terminals 3\nT 1\nT 3\nT 4\n', ''), /line 12: expected Terminals, with their number/],
    [square.replace('Nodes 5', 'Nodes 4000000000'), /line 2: 4000000000 nodes are announced/],
    [square.replace('E 3 4 5\n', ''), /5 edges were announced, 4 stand here/],
    [square.replace('E 3 4 5', 'E 4 5 5').replace('E 1 4 20', 'E 4 5 5'), /the terminals 1 and 4 are not connected/],
  ]) {
    const { status, stdout, stderr } = steiner(text, '-');
    assert.equal(status, 1, text);
    assert.equal(stdout, '');
    assert.match(stderr, words);
    assert.equal(stderr.trim().split('\n').length, 1);
  }
  assert.match(steiner('', '/does/not/exist').stderr, /does\/not\/exist: cannot open: No such file/);
});

test('a terminal that is listed twice is told, as an edge from a vertex to itself is', () => {
  const text = square.replace('T 3\n', 'T 3\nT 1\n').replace('Terminals 3', 'Terminals 4').replace('Edges 5', 'Edges 6');
  const { status, stdout, stderr } = steiner(text.replace('E 4 5 1', 'E 4 5 1\nE 2 2 1'), '-');
  assert.equal(status, 0, stderr);
  assert.match(stdout, /^VALUE 12\n/);
  assert.match(stderr, /1 edges from a vertex to itself .*\(line 9\)/);
  assert.match(stderr, /1 terminals were listed before.*\(line 16\)/);
});

test('a memory limit that holds not even the instance names the flag to raise', () => {
  const { status, stdout, stderr } = steiner(grid(150, 50).text, '-', '--memory-limit', '1');
  assert.equal(status, 1, stdout.slice(0, 100));
  assert.match(stderr, /^tightwire steiner: -: 1 MiB, which --memory-limit allows, do not hold 22500 vertices and \d+ edges/);
});

test('of a file with a long name the end is told, with a sign that it was cut, and the line', () => {
  const folder = temporaryFolder();
  const deep = join(folder.path, 'ä'.repeat(60), 'ö'.repeat(61));
  mkdirSync(deep, { recursive: true });
  for (const name of ['short.gr', 'long.gr']) {
    const file = name === 'short.gr' ? join(folder.path, name) : join(deep, name);
    writeFileSync(file, square.replace('E 2 3 4', 'E 2 9 4'));
    for (const [path, words] of [[file, 'line 5: vertex 9 is not one of 1 to 5'], [`${file}.none`, 'cannot open']]) {
      const { stderr } = steiner('', path);
      const told = stderr.replace(/^tightwire steiner: /, '').split(`: ${words}`)[0];
      assert.ok(stderr.includes(`: ${words}`), stderr);
      if (name === 'short.gr') assert.equal(told, path);
      else assert.ok(told[0] === '…' && told.length > 50 && path.endsWith(told.slice(1)), stderr);
    }
  }
  folder.remove();
});

test('the weight that a presolver took is told beside, and the file is named once', () => {
  const text = '33D32945 STP File\nSECTION Presolve\nFIXED 12.0\nEND\nSECTION Graph\nNodes 2\nEdges 1\nE 1 2 3\nEND\n' +
    'SECTION Terminals\nTerminals 2\nT 1\nT 2\nEND\nEOF\n';
  const folder = temporaryFolder();
  const file = join(folder.path, 'reduced.stp');
  writeFileSync(file, text);
  const solved = steiner('', file);
  assert.equal(solved.status, 0);
  assert.match(solved.stdout, /^VALUE 3\n/);
  assert.match(solved.stderr, /12 more \(FIXED\)/);
  writeFileSync(file, text.replace('12.0', '12.5'));
  const refused = steiner('', file);
  assert.notEqual(refused.status, 0);
  for (const { stderr } of [solved, refused]) assert.equal(stderr.split('reduced.stp').length, 2, stderr);
  folder.remove();
});

test('wrong usage is exit code 2', () => {
  for (const flags of [[], ['a', 'b'], ['-', '--bogus'], ['-', '--time-limit'], ['-', '--time-limit', 'soon'],
    ['-', '--threads', '0']]) {
    const { status, stdout, stderr } = steiner(square, ...flags);
    assert.equal(status, 2, flags.join(' '));
    assert.equal(stdout, '');
    assert.equal(stderr.trim().split('\n').length, 1);
  }
  const help = steiner('', '--help');
  assert.equal(help.status, 0);
  for (const flag of ['--time-limit', '--work-limit', '--memory-limit', '--threads', '--json', '--stats', '--certificate'])
    assert.ok(help.stdout.includes(flag), flag);
});
