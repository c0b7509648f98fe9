// The whole way: a suit and its motions go in, a layout comes out, whatever happens to the workers meanwhile. The oracle
// for the results is the command line, which shares no process, queue or store with the service.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Service, run, sleep, temporaryFolder, until } from './service.mjs';

const folder = temporaryFolder();
const suit = (...parts) => join(folder.path, 'suit', ...parts);
const terminalsOf = (set) => JSON.parse(readFileSync(suit('terminals', `${set}.json`)));
const motionNames = ['walk', 'squat'];
let service, mesh, motions, field;

const wait = { prefer: 'wait=30' };
const object = { 'content-type': 'model/obj', ...wait };
const cache = { 'content-type': 'application/octet-stream', ...wait };

before(async () => {
  run('sample', '--out', suit(), '--vertices', '3000');
  service = await Service.start({ workers: 2, 'lease-s': 1, 'worker-threads': 1 });
});
after(async () => {
  await service.stop();
  folder.remove();
});

// The same layout by the command line: name -> bytes of every file.
function layoutByCommand(request, flags = []) {
  const out = join(folder.path, `out-${Math.random()}`);
  const file = `${out}.json`;
  writeFileSync(file, JSON.stringify(request));
  const caches = motionNames.flatMap((name) => ['--motion', suit('motions', `${name}.pc2`)]);
  run('layout', '--worn', suit('suit.obj'), ...caches, '--terminals', file, '--out', out, ...flags);
  return (name) => readFileSync(join(out, name));
}

async function assertSameFiles(layout, filesOf) {
  assert.equal(layout.state, 'succeeded', JSON.stringify(layout.problem));
  assert.ok(layout.artifacts.length >= 2);
  const files = {};
  for (const { name, href } of layout.artifacts) files[name] = await service.get(href);
  // Now that all have been asked for, the list knows all.
  const { json } = await service.get(layout.href);
  assert.deepEqual(json.artifacts.map(({ name }) => name).sort(), Object.keys(files).sort());
  for (const artifact of json.artifacts) {
    const { status, bytes, type, headers } = files[artifact.name];
    assert.equal(status, 200);
    assert.equal(type, artifact.media_type);
    assert.equal(bytes.length, artifact.size_bytes);
    assert.ok(headers.get('etag'));
    assert.ok(bytes.equals(filesOf(artifact.name)), `${artifact.name} differs from the command line's`);
  }
}

test('a garment is imported, with its counts', async () => {
  const answer = await service.post('/v1/meshes?name=suit.obj', readFileSync(suit('suit.obj')), object);
  assert.equal(answer.status, 200);
  mesh = answer.json;
  assert.equal(mesh.state, 'succeeded', JSON.stringify(mesh.problem));
  const text = readFileSync(suit('suit.obj'), 'latin1');
  assert.equal(mesh.summary.vertices, text.match(/^v /gm).length);
  assert.equal(mesh.summary.faces, text.match(/^f /gm).length);
  assert.ok(mesh.summary.pieces.length >= 4);
});

test('arrays are the numbers of the file', async () => {
  const array = mesh.arrays.find((one) => one.name === 'position');
  const { bytes, headers } = await service.get(array.href);
  assert.equal(headers.get('x-array-type'), 'f64');
  assert.equal(headers.get('x-array-shape'), `${array.rows}, ${array.columns}`);
  const values = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
  const [x, y, z] = readFileSync(suit('suit.obj'), 'latin1')
    .match(/^v (\S+) (\S+) (\S+)/m)
    .slice(1)
    .map(Number);
  for (const [i, value] of [x, y, z].entries()) assert.ok(Math.abs(values[i] - value) < 1e-3);
  assert.equal((await service.get(array.href, { headers: { 'if-none-match': headers.get('etag') } })).status, 304);
  const missing = await service.get(mesh.href + '/arrays/positions');
  assert.equal(missing.status, 404);
  assert.equal(missing.json.type, 'urn:tightwire:problem:no-such-blob');
  assert.match(missing.json.detail, /no array "positions"; did you mean position\? There are: .*face/);
});

test('motions are imported, and belong to their mesh', async () => {
  motions = [];
  for (const name of motionNames) {
    const bytes = readFileSync(suit('motions', `${name}.pc2`));
    const answer = await service.post(`${mesh.href}/motions?name=${name}`, bytes, cache);
    assert.equal(answer.json.state, 'succeeded', answer.text);
    assert.equal(answer.json.summary.frames, bytes.readInt32LE(28));
    motions.push(answer.json);
  }
  const { json } = await service.get(`${mesh.href}/motions?state=succeeded`);
  assert.deepEqual(new Set(json.items.map((item) => item.id)), new Set(motions.map((motion) => motion.id)));
});

test('a field is computed, and asking for it again is no work', async () => {
  const request = { mesh: mesh.id, motions: motions.map((motion) => motion.id), name: 'walk and squat' };
  field = (await service.post('/v1/fields', request, wait)).json;
  assert.equal(field.state, 'succeeded', JSON.stringify(field.problem));
  const again = await service.post('/v1/fields', { ...request, options: { eta_mpa: 0.1 } });
  assert.equal(again.status, 200);
  assert.equal(again.json.id, field.id);
  assert.equal(again.json.job.attempts, 1);
});

test('a layout has the bytes of the command line', async () => {
  for (const set of ['joints10', 'segments17']) {
    const request = terminalsOf(set);
    const answer = await service.post('/v1/layouts', { ...request, field: field.id }, wait);
    assert.equal(answer.status, 200);
    assert.equal(answer.json.summary.outcome, 'optimal');
    await assertSameFiles(answer.json, layoutByCommand(request));
    const picture = await service.get(`${answer.json.href}/pattern.png`);
    assert.equal(picture.status, 404);
    assert.match(picture.json.detail, /no file "pattern.png"; did you mean pattern.svg\? There are: /);
  }
});

test('layouts list by their field, fields by their mesh', async () => {
  const { json } = await service.get(`/v1/layouts?field=${field.id}&limit=1`);
  assert.equal(json.items[0].field, field.id);
  assert.equal(json.items[0].request, undefined);
  assert.deepEqual((await service.get(json.items[0].href)).json.request.field, field.id);
  assert.match(json.next, new RegExp(`field=${field.id}`));
  assert.deepEqual((await service.get('/v1/layouts?field=field_x')).json.items, []);
  assert.deepEqual((await service.get(`/v1/fields?mesh=${mesh.id}`)).json.items.map((item) => item.id), [field.id]);
});

test('options of the request reach the solver', async () => {
  const request = { ...terminalsOf('joints10'), options: { baseline: 'none', elongation: false } };
  const { json } = await service.post('/v1/layouts', { ...request, field: field.id }, wait);
  await assertSameFiles(json, layoutByCommand(request));
});

test('the layouts of a drag, whose search goes on from the one before, have the bytes of the command line', async () => {
  const options = { baseline: 'none', elongation: false };
  for (let move = 0; move < 5; move++) {
    const { terminals } = terminalsOf('joints10');
    terminals[3] = { name: 'dragged', face: 1700 + 2 * move, barycentric: [0.25, 0.25, 0.5] };
    const request = { terminals, options };
    const { json } = await service.post('/v1/layouts', { ...request, field: field.id }, { ...wait, session: 'desk-1' });
    await assertSameFiles(json, layoutByCommand(request));
  }
});

// A PC2 file with every coordinate changed.
function changed(name, change) {
  const bytes = Buffer.from(readFileSync(suit('motions', `${name}.pc2`)));
  for (let at = 32; at < bytes.length; at += 4) bytes.writeFloatLE(change(bytes.readFloatLE(at)), at);
  return bytes;
}

const importMotion = async (query, bytes) => {
  const { json } = await service.post(`${mesh.href}/motions?${query}`, bytes, cache);
  assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
  return json;
};

test('whatever is kept of the frames, a field and a layout have the bytes of the command line', async () => {
  assert.equal(motions[0].options.frames, 'packed');
  const walk = readFileSync(suit('motions', 'walk.pc2'));
  const densities = [];
  for (const frames of ['packed', 'upload']) {
    const motion = await importMotion(`name=walk&frames=${frames}`, walk);
    const options = { reference: 'worn' };
    const kept = (await service.post('/v1/fields', { mesh: mesh.id, motions: [motion.id], options }, wait)).json;
    const out = join(folder.path, `worn-${frames}`);
    const files = ['--worn', suit('suit.obj'), '--motion', suit('motions', 'walk.pc2'), '--frames', frames];
    run('field', ...files, '--reference', 'worn', '--out', out);
    for (const [name, type] of [['density', 'f64'], ['weight', 'u64'], ['coverage', 'f32']]) {
      const { bytes } = await service.get(kept.arrays.find((array) => array.name === name).href);
      assert.ok(bytes.equals(readFileSync(join(out, `${name}.${type}`))), `${name} of frames ${frames}`);
      if (name === 'density') densities.push(bytes);
    }
  }
  assert.ok(!densities[0].equals(densities[1]), 'packed frames were rounded');

  const none = await Promise.all(
    motionNames.map((name) => importMotion(`name=${name}&frames=none`, readFileSync(suit('motions', `${name}.pc2`)))),
  );
  const ids = none.map((motion) => motion.id);
  const without = (await service.post('/v1/fields', { mesh: mesh.id, motions: ids }, wait)).json;
  const { json } = await service.post('/v1/layouts', { ...terminalsOf('joints10'), field: without.id }, wait);
  await assertSameFiles(json, layoutByCommand(terminalsOf('joints10'), ['--frames', 'none']));
  const worn = { mesh: mesh.id, motions: ids, options: { reference: 'worn' } };
  const refused = (await service.post('/v1/fields', worn, wait)).json;
  assert.match(refused.problem.type, /motion-without-frames$/);
});

test('a motion may have a unit of its own', async () => {
  const metres = await importMotion('name=metres&motion_unit=m', changed('walk', (mm) => mm / 1000));
  const ratio = metres.summary.average_density_mpa / motions[0].summary.average_density_mpa;
  assert.ok(Math.abs(ratio - 1) < 1e-4, `${ratio}`);
  const asMesh = await service.post(`${mesh.href}/motions?name=lost`, changed('walk', (mm) => mm / 1000), cache);
  assert.match(asMesh.json.problem.type, /motion-does-not-fit$/);
  const inches = await service.post(`${mesh.href}/motions?motion_unit=inch`, changed('walk', (mm) => mm), cache);
  assert.equal(inches.status, 422);
});

test('the motion of another size of the garment comes with a warning', async () => {
  assert.deepEqual(motions.map((motion) => motion.summary.warnings), [[], []]);
  const larger = await importMotion('name=larger', changed('walk', (mm) => mm * 1.05));
  const [warning] = larger.summary.warnings;
  assert.equal(warning.type, 'motion-other-size');
  assert.match(warning.text, /[45]\.[0-9] % longer/);
});

test('all can be asked for at once: each job waits for what it needs', async () => {
  const bytes = Buffer.concat([readFileSync(suit('suit.obj')), Buffer.from('# another\n')]);
  const { json: other } = await service.post('/v1/meshes?name=other.obj', bytes, { 'content-type': 'model/obj' });
  const ids = [];
  for (const name of motionNames) {
    const body = readFileSync(suit('motions', `${name}.pc2`));
    const headers = { 'content-type': 'application/octet-stream' };
    ids.push((await service.post(`${other.href}/motions?name=${name}`, body, headers)).json.id);
  }
  const { json: waiting } = await service.post('/v1/fields', { mesh: other.id, motions: ids });
  const layout = await service.post('/v1/layouts', { ...terminalsOf('joints10'), field: waiting.id }, wait);
  assert.equal(layout.status, 200);
  await assertSameFiles(layout.json, layoutByCommand(terminalsOf('joints10')));
});

test('an idempotency key gives the same layout, and only for the same request', async () => {
  const request = { ...terminalsOf('joints10'), field: field.id };
  const post = (body, key) => service.post('/v1/layouts', body, { 'idempotency-key': key });
  const [first, second] = await Promise.all([post(request, 'order 17'), post(request, 'order 17')]);
  assert.equal(first.json.id, second.json.id);
  assert.notEqual((await post(request, 'order 18')).json.id, first.json.id);
  const reused = await post({ ...request, terminals: request.terminals.slice(1) }, 'order 17');
  assert.equal(reused.status, 422);
  assert.equal(reused.json.type, 'urn:tightwire:problem:idempotency-key-reused');
});

test('a worker that is killed in the middle of a job loses nothing and doubles nothing', async () => {
  const request = terminalsOf('segments17');
  const filesOf = layoutByCommand(request);
  for (let round = 0; round < 20; round++) {
    const { json } = await service.post('/v1/layouts', { ...request, field: field.id });
    const running = await until('the job runs', async () => {
      const { json: job } = await service.get(`/v1/jobs/${json.job.id}`);
      return job.state !== 'queued' && job;
    });
    for (const pid of service.workers()) process.kill(pid, 'SIGKILL');
    const done = await service.finished(json.href);
    if (running.state !== 'running' || done.job.attempts < 2) continue; // it was quicker than the kill
    assert.equal(done.state, 'succeeded'); // at the second attempt; at the third where a busy machine lets a lease run out
    await assertSameFiles(done, filesOf);
    return;
  }
  assert.fail('no job could be caught in the middle');
});

test('workers asked to end finish their job first', async () => {
  const { json } = await service.post('/v1/layouts', { ...terminalsOf('segments17'), field: field.id });
  await until('the job runs', async () => (await service.get(`/v1/jobs/${json.job.id}`)).json.state !== 'queued');
  for (const pid of service.workers()) process.kill(pid, 'SIGTERM');
  const done = await service.finished(json.href);
  assert.equal(done.state, 'succeeded');
  assert.equal(done.job.attempts, 1);
});

test('twenty layouts at once from several clients all come back, each its own', async () => {
  const { terminals } = terminalsOf('segments17');
  const requests = Array.from({ length: 20 }, (_, i) => ({
    terminals: terminals.slice(i % 10, (i % 10) + 5),
    field: field.id,
    options: { elongation: false },
  }));
  const answers = await Promise.all(requests.map((request) => service.post('/v1/layouts', request, wait)));
  const hashes = answers.map(({ json }) => json.artifacts.find((one) => one.name === 'layout.json').blake2b);
  assert.equal(new Set(answers.map(({ json }) => json.id)).size, 20);
  assert.equal(new Set(hashes).size, 10);
  for (let i = 0; i < 10; i++) assert.equal(hashes[i], hashes[i + 10]);
});

test('a stored hash is what b2sum says of each MiB', { skip: !hasBlake2() }, async () => {
  const bytes = readFileSync(suit('motions', 'walk.pc2'));
  const { uploads } = await importMotion('name=walk&frames=upload', bytes);
  const { blake2b } = uploads[0];
  assert.ok([hashOf(bytes), hashOfChunks(bytes)].includes(blake2b));
});

function hasBlake2() {
  try {
    return Boolean(execFileSync('b2sum', ['--version']));
  } catch {
    return false;
  }
}

function hashOf(bytes) {
  return execFileSync('b2sum', ['-l', '256'], { input: bytes, encoding: 'utf8' }).split(' ')[0];
}

function hashOfChunks(bytes) {
  const hashes = [];
  for (let at = 0; at < bytes.length; at += 1 << 20) hashes.push(hashOf(bytes.subarray(at, at + (1 << 20))));
  return hashOf(Buffer.from(hashes.join(''), 'hex'));
}

// --- bad input that only a worker can see: the resource fails, with the place ---

async function fails(promise, slug, place) {
  const { json, status } = await promise;
  assert.equal(status, 200);
  assert.equal(json.state, 'failed', JSON.stringify(json.summary));
  assert.equal(json.problem.type, `urn:tightwire:problem:${slug}`, json.problem.detail);
  const { pointer, place: where } = json.problem.errors?.[0] ?? {};
  if (place) assert.match(pointer ?? where, place);
  assert.ok(json.problem.detail.length > 10);
}

const square = (change = (text) => text) =>
  change(
    'v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nvt 0 0\nvt 100 0\nvt 100 100\nvt 0 100\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n',
  );
const upload = (text) => service.post('/v1/meshes?name=bad.obj', text, object);

test('garments that are no garments fail with the line, face or vertex', async () => {
  for (const [text, place] of [
    [square((t) => t.replace('f 1/1 3/3 4/4', 'f 1/1 3/3 9/4')), /line 10/],
    [square((t) => t.replace('v 100 100 0', 'v 100 nan 0')), /line 3/],
    [square((t) => t.replace('v 100 100 0', 'v 100')), /line 3/],
    [square((t) => t.replace(/^f.*\n/gm, '')), null],
    [square((t) => t + 'f 1/1 2/2 4/4\nf 1/1 2/2 3/3\n'), /edge|face|line|vert/],
    ['\0\0\0\0', null],
    ['#\n', null],
  ]) {
    const { json, status } = await upload(text);
    assert.equal(status, 200);
    assert.equal(json.state, 'failed', text);
    assert.match(json.problem.type, /^urn:tightwire:problem:[a-z-]+$/);
    assert.equal(json.summary, null);
    if (place) assert.match(JSON.stringify(json.problem.errors), place, json.problem.detail);
  }
});

test('what is made from something that failed fails too, and says so', async () => {
  const { json: bad } = await upload(square((text) => text.replace('v 100 100 0', 'v 100 inf 0')));
  const body = readFileSync(suit('motions', 'walk.pc2'));
  const { status, json } = await service.post(`${bad.href}/motions?name=walk`, body, cache);
  assert.equal(status, 409);
  assert.equal(json.type, 'urn:tightwire:problem:dependency-failed');
});

test('point caches that do not fit fail with a clear problem', async () => {
  const good = readFileSync(suit('motions', 'walk.pc2'));
  const changed = (change) => {
    const bytes = Buffer.from(good);
    change(bytes);
    return bytes;
  };
  const post = (bytes) => service.post(`${mesh.href}/motions?name=bad`, bytes, cache);
  for (const bytes of [
    good.subarray(0, 20),
    good.subarray(0, good.length - 5),
    Buffer.concat([good, Buffer.from('more')]),
    changed((b) => b.write('POINTCASH')),
    changed((b) => b.writeInt32LE(7, 12)),
    changed((b) => b.writeInt32LE(mesh.summary.vertices + 1, 16)),
    changed((b) => b.writeInt32LE(2000000000, 28)),
    changed((b) => b.writeInt32LE(-1, 28)),
    changed((b) => b.writeFloatLE(NaN, 32 + 12 * 5)),
    changed((b) => b.writeFloatLE(Infinity, 32 + 12 * 5)),
  ]) {
    const { json } = await post(bytes);
    assert.equal(json.state, 'failed');
    assert.match(json.problem.type, /^urn:tightwire:problem:[a-z0-9-]+$/);
    assert.ok(json.problem.status === 422 || json.problem.status === 413, json.problem.detail);
  }
});

test('terminals that cannot be placed are named', async () => {
  const layout = (...terminals) => service.post('/v1/layouts', { field: field.id, terminals }, wait);
  const good = { vertex: 0 };
  await fails(layout(good, { vertex: 10 ** 6 }), 'terminal-out-of-range', /^\/terminals\/1/);
  await fails(layout(good, { face: 10 ** 6, barycentric: [1, 0, 0] }), 'terminal-out-of-range', /^\/terminals\/1/);
  await fails(layout(good, { point_mm: [9000, 0, 0] }), 'terminal-off-fabric', /^\/terminals\/1/);
  await fails(layout(good, { piece: 'hat', uv_mm: [0, 0] }), 'terminal-unknown-piece', /^\/terminals\/1/);
  await fails(
    layout(good, { piece: mesh.summary.pieces[0], uv_mm: [-9999, 0] }),
    'terminal-off-fabric',
    /^\/terminals\/1/,
  );
});

test('terminals on the same place are merged and reported; on different components they fail', async () => {
  const twice = { field: field.id, terminals: [{ vertex: 5 }, { vertex: 900 }, { name: 'again', vertex: 5 }] };
  const { json } = await service.post('/v1/layouts', twice, wait);
  assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
  assert.equal(json.summary.terminals, 2);
  const two =
    square() +
    square()
      .replace(/f .*\n/g, '')
      .replace(/^v (\S+)/gm, 'v 9$1')
      .replace(/^vt (\S+)/gm, 'vt 9$1') +
    'f 5/5 6/6 7/7\nf 5/5 7/7 8/8\n';
  const { json: apart } = await upload(
    two.replace(/9(0 0 0|0 100 0|0 0|0 100)\n/g, '900$1\n').replace(/\b9(100)/g, '1$1'),
  );
  if (apart.state !== 'succeeded') return; // the importer may refuse two garments in one file
  const { json: flat } = await service.post(
    '/v1/fields',
    { mesh: apart.id, motions: [], options: { weight: 'length' } },
    wait,
  );
  assert.equal(flat.state, 'succeeded', JSON.stringify(flat.problem));
  const layout = service.post('/v1/layouts', { field: flat.id, terminals: [{ vertex: 0 }, { vertex: 4 }] }, wait);
  await fails(layout, 'terminals-apart', /^\/terminals\/1/);
});

test('jobs list newest first, by kind and state, and a failed one can be driven again', async () => {
  const { json } = await service.get('/v1/jobs?kind=import_motion&state=failed&limit=1000');
  assert.ok(json.items.length >= 10);
  const times = json.items.map((job) => job.created_at);
  assert.deepEqual(times, [...times].sort().reverse());
  const again = await service.post(`/v1/jobs/${json.items[0].id}/redrive`);
  assert.equal(again.status, 200);
  const ended = await service.finished(`/v1/jobs/${json.items[0].id}`);
  assert.equal(ended.state, 'failed');
  assert.ok(ended.finished_at > json.items[0].finished_at);
});

// The layouts of a square are shorter than a heartbeat, so that many of the cancels find one that is about to end.
test('a cancel is obeyed, or told that it came too late', async () => {
  const { json: flat } = await upload(square());
  const { json: plain } = await service.post('/v1/fields', { mesh: flat.id, motions: [] }, wait);
  assert.equal(plain.state, 'succeeded', JSON.stringify(plain.problem));
  const rounds = Array.from({ length: 60 }, async (_, i) => {
    const request = { field: plain.id, terminals: [{ vertex: 0 }, { vertex: 2 }] };
    const { json } = await service.post('/v1/layouts', request);
    await sleep(i % 20);
    const cancel = await service.post(`/v1/jobs/${json.job.id}/cancel`);
    const ended = await service.finished(json.href);
    if (cancel.status === 409) assert.equal(cancel.json.type, 'urn:tightwire:problem:job-finished');
    else assert.equal(cancel.status, 200);
    assert.equal(ended.state, cancel.status === 409 ? 'succeeded' : 'cancelled');
    assert.equal(ended.artifacts.length > 0, ended.state === 'succeeded');
  });
  await Promise.all(rounds);
});

test('deleting takes all that was made from it, when asked to', async () => {
  assert.equal((await service.delete(mesh.href)).status, 409);
  assert.equal((await service.delete(`${mesh.href}?dependents=true`)).status, 204);
  for (const gone of [mesh, motions[0], field]) assert.equal((await service.get(gone.href)).status, 404);
});
