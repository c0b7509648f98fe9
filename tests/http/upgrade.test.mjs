// A store of 0.1.0 under today's service: what was answered stays as it was, what is asked again is computed anew.
// What was answered is read from the dump of the store, as text.
import { test, before, after } from 'node:test';
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { Service, build, temporaryFolder } from './service.mjs';

const dump = new URL('../fixtures/store-0.1.0.sql', import.meta.url).pathname;
const wait = { prefer: 'wait=30' };

// The rows of a table of the dump: numbers, texts, null, and buffers for blobs.
function rows(table) {
  const literal = /\s*(X'[0-9a-f]*'|'(?:[^']|'')*'|NULL|[-0-9.e+]+)\s*[,)]/iy;
  return readFileSync(dump, 'utf8')
    .split('\n')
    .filter((line) => line.startsWith(`INSERT INTO ${table} VALUES(`))
    .map((line) => {
      const values = [];
      literal.lastIndex = line.indexOf('(') + 1;
      for (let found; (found = literal.exec(line)); ) {
        const text = found[1];
        if (text === 'NULL') values.push(null);
        else if (text[0] === "'") values.push(text.slice(1, -1).replaceAll("''", "'"));
        else if (text[0] === 'X') values.push(Buffer.from(text.slice(2, -1), 'hex'));
        else values.push(Number(text));
      }
      return values;
    });
}

const states = ['queued', 'running', 'succeeded', 'failed', 'cancelled'];
const collections = ['/v1/meshes', null, '/v1/fields', '/v1/layouts', '/v1/rig/recordings'];
const old = {};
let service, folder;

before(async () => {
  const chunks = rows('chunk');
  const jobs = rows('job');
  const needs = rows('need');
  old.resources = rows('resource').map(([number, id, kind, name, options]) => {
    const job = jobs.find((row) => row[2] === number);
    const [, , mesh] = needs.find((row) => row[0] === number && row[1] === 0) ?? [];
    return { number, id, kind, name, text: options, options: JSON.parse(options), state: states[job[4]], need: mesh };
  });
  const byNumber = (number) => old.resources.find((one) => one.number === number);
  for (const one of old.resources) {
    one.href = one.kind === 1 ? `/v1/meshes/${byNumber(one.need).id}/motions/${one.id}` : `${collections[one.kind]}/${one.id}`;
    one.needs = needs.filter((row) => row[0] === one.number).map((row) => byNumber(row[2]));
  }
  old.blobs = rows('blob').map(([number, resource, , role, name]) => ({
    name,
    role,
    owner: byNumber(resource),
    bytes: Buffer.concat(chunks.filter((row) => row[1] === number).map((row) => row[3])),
  }));
  [old.key] = rows('idempotency').map((row) => row[1]);
  folder = temporaryFolder();
  const path = join(folder.path, 'old.db');
  execFileSync(join(build, 'tests/tools/old_store'), [dump, path]);
  service = await Service.start({ store: `sqlite:${path}`, workers: 1, 'lease-s': 1 });
});
after(async () => {
  await service.stop();
  folder.remove();
});

const named = (kind, name) => old.resources.find((one) => one.kind === kind && one.name === name);
const motion = (name) => named(1, name);
const layouts = () => old.resources.filter((one) => one.kind === 3 && one.state === 'succeeded');

function askField(field) {
  const [mesh, ...motions] = field.needs;
  return { mesh: mesh.id, motions: motions.map((one) => one.id), options: field.options };
}

test('every file and every array of an old store is served as it was', async () => {
  let served = 0;
  for (const blob of old.blobs.filter((one) => one.owner?.state === 'succeeded' && one.role > 0)) {
    const { status, bytes } = await service.get(`${blob.owner.href}/${blob.role === 1 ? 'arrays/' : ''}${blob.name}`);
    assert.equal(status, 200);
    assert.ok(bytes.equals(blob.bytes), `${blob.owner.id} ${blob.name}`);
    served++;
  }
  assert.ok(served >= 35, `${served}`);
  const recording = old.resources.find((one) => one.kind === 4);
  const { text } = await service.get(`${recording.href}/samples.csv`);
  assert.equal(text.trim().split('\n').length, 1 + 50);
});

test('what has ended stays as it ended, and is outdated; what has not is computed by this release', async () => {
  const finished = await Promise.all(old.resources.map((one) => service.finished(one.href)));
  for (const [i, one] of old.resources.entries()) {
    const now = finished[i];
    const isFinal = ['succeeded', 'failed', 'cancelled'].includes(one.state);
    assert.equal(now.state, isFinal ? one.state : 'succeeded', `${one.id} ${JSON.stringify(now.problem)}`);
    assert.equal(now.version === 1, isFinal, one.id);
    // A layout on a field of 0.1.0 is outdated like the field, whoever computes it.
    assert.equal(now.outdated, now.state === 'succeeded' || one.kind === 3, one.id);
  }
});

test('the same field is computed anew, beside the old one', async () => {
  const fields = old.resources.filter(
    (one) => one.kind === 2 && one.state === 'succeeded' && !one.needs.includes(motion('gone')),
  );
  assert.equal(fields.length, 4);
  for (const field of fields) {
    const { status, json } = await service.post('/v1/fields', askField(field), wait);
    assert.equal(status, 200, JSON.stringify(json));
    assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
    assert.notEqual(json.id, field.id);
    assert.equal(json.outdated, false);
    assert.equal((await service.post('/v1/fields', askField(field))).json.id, json.id);
    assert.equal((await service.get(field.href)).json.outdated, true);
  }
});

test('means of an old import are made again from its frames, as if the motion had been sent today', async () => {
  const raw = motion('raw');
  const sent = old.blobs.find((blob) => blob.owner === raw && blob.role === 0).bytes;
  const octets = { ...wait, 'content-type': 'application/octet-stream' };
  const [mesh] = raw.needs;
  const today = await service.post(`${mesh.href}/motions?name=raw&frames=upload`, sent, octets);
  assert.equal(today.json.state, 'succeeded', JSON.stringify(today.json.problem));
  assert.notEqual(today.json.id, raw.id);
  const weights = [];
  for (const id of [raw.id, today.json.id]) {
    const body = { mesh: mesh.id, motions: [id], options: { energy: 'tension' } };
    const { json } = await service.post('/v1/fields', body, wait);
    assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
    weights.push((await service.get(`${json.href}/arrays/density`)).bytes);
  }
  assert.ok(weights[0].equals(weights[1]));
  // And they differ from what 0.1.0 kept: the motion shortens the fabric along one direction.
  const { bytes } = await service.get(`${raw.href}/arrays/mean_tension`);
  assert.ok(!bytes.equals(weights[0]));
});

test('a motion of which no frames were kept must be sent again', async () => {
  const field = old.resources.find((one) => one.kind === 2 && one.needs.includes(motion('gone')));
  const { json } = await service.post('/v1/fields', askField(field), wait);
  assert.equal(json.state, 'failed');
  assert.equal(json.problem.type, 'urn:tightwire:problem:motion-outdated');
  assert.match(json.problem.detail, new RegExp(`${motion('gone').id}.*send the motion again`));
  // On the old field a layout can still be had, with the means that shaped the field; only not on one of today.
  const request = { field: field.id, terminals: [{ vertex: 0 }, { vertex: 53 }] };
  const layout = await service.post('/v1/layouts', request, wait);
  assert.equal(layout.json.state, 'succeeded', JSON.stringify(layout.json.problem));
  assert.equal(layout.json.outdated, true);
  const renewed = await service.post(`${layout.json.href}/renew`, undefined, wait);
  const state = renewed.status === 200 ? renewed.json.problem : renewed.json;
  assert.equal(state.type, 'urn:tightwire:problem:dependency-failed');
  assert.match(state.detail, /send the motion again/);
});

const isRefined = (layout) => layout.needs[0].needs[0].options.refinement !== 'none';

test('an outdated layout is renewed on a field of today, once', async () => {
  for (const layout of layouts().filter((one) => !isRefined(one))) {
    const { status, json } = await service.post(`${layout.href}/renew`, undefined, wait);
    assert.equal(status, 200, JSON.stringify(json));
    assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
    assert.notEqual(json.id, layout.id);
    assert.equal(json.outdated, false);
    assert.notEqual(json.field, layout.needs[0].id);
    assert.deepEqual(json.request, { ...layout.options, field: json.field });
    const again = await service.post(`${layout.href}/renew`);
    assert.equal(again.json.id, json.id);
    const itself = await service.post(`${json.href}/renew`);
    assert.equal(itself.status, 200);
    assert.equal(itself.json.id, json.id);
    assert.equal((await service.get(layout.href)).json.outdated, true);
  }
  assert.equal((await service.post('/v1/layouts/layout_none/renew')).status, 404);
});

test('a layout whose numbers would mean other places is not renewed, but can be asked for anew', async () => {
  const layout = layouts().find(isRefined);
  const renewed = await service.post(`${layout.href}/renew`, undefined, wait);
  assert.equal(renewed.status, 409);
  assert.equal(renewed.json.type, 'urn:tightwire:problem:numbers-have-changed');
  // The old mesh lacks the file's numbers; they are made again from its upload, for old fields and new ones.
  const [field] = layout.needs;
  const today = await service.post('/v1/fields', askField(field), wait);
  assert.equal(today.json.state, 'succeeded', JSON.stringify(today.json.problem));
  for (const id of [field.id, today.json.id]) {
    const { json } = await service.post('/v1/layouts', { field: id, terminals: [{ vertex: 0 }, { vertex: 11 }] }, wait);
    assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
    const { json: file } = await service.get(`${json.href}/layout.json`);
    // 4 x 3 vertices, 40 mm apart.
    assert.deepEqual(file.terminals.map((one) => one.point_mm), [[0, 0, 0], [120, 80, 0]]);
  }
});

test('the key of an order from before the upgrade finds its layout', async () => {
  const layout = layouts().find((one) => one.number === rows('idempotency')[0][3]);
  // Word for word as it was sent, its 60.0 and 0.0 included, which this release stores as 60 and 0.
  assert.match(layout.text, /60\.0.*0\.0/);
  const headers = { 'idempotency-key': old.key, 'content-type': 'application/json' };
  const { status, json } = await service.post('/v1/layouts', layout.text, headers);
  assert.equal(status, 200, JSON.stringify(json));
  assert.equal(json.id, layout.id);
  const other = layout.text.replace('"vertex":8', '"vertex":7');
  assert.equal((await service.post('/v1/layouts', other, headers)).json.type, 'urn:tightwire:problem:idempotency-key-reused');
});
