// Drawings are made when somebody first asks for them. The oracle is the command line, which makes all at once.
import assert from 'node:assert/strict';
import { connect } from 'node:net';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Service, run, sleep, temporaryFolder, until } from './service.mjs';

const folder = temporaryFolder();
const suit = (...parts) => join(folder.path, 'suit', ...parts);
const wait = { prefer: 'wait=60' };
let service, request, expected;

const start = (flags) => Service.start({ store: `sqlite:${join(folder.path, 'store.db')}`, 'worker-threads': 1, ...flags });
const restart = async (flags) => {
  await service.stop();
  service = await start(flags);
};
const lay = async () => {
  const { json } = await service.post('/v1/layouts', request, wait);
  assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
  return json;
};
const drawJobs = async (query = '') => (await service.get(`/v1/jobs?kind=draw&limit=1000${query}`)).json.items;

before(async () => {
  run('sample', '--out', suit(), '--vertices', '3000');
  service = await start({ workers: 2 });
  const { json: mesh } = await service.post('/v1/meshes?name=suit.obj', readFileSync(suit('suit.obj')), { 'content-type': 'model/obj', ...wait });
  const { json: field } = await service.post('/v1/fields', { mesh: mesh.id, motions: [] }, wait);
  assert.equal(field.state, 'succeeded', JSON.stringify(field.problem));
  const terminals = JSON.parse(readFileSync(suit('terminals', 'joints10.json'))).terminals;
  request = { field: field.id, terminals };
  const file = join(folder.path, 'terminals.json'), out = join(folder.path, 'out');
  writeFileSync(file, JSON.stringify({ terminals }));
  run('layout', '--worn', suit('suit.obj'), '--terminals', file, '--out', out);
  expected = (name) => readFileSync(join(out, name));
});
after(async () => {
  await service.stop();
  folder.remove();
});

test('a drawing is made once, whoever asks for it at the same time, and listed before it is there', async () => {
  const layout = await lay();
  assert.deepEqual(layout.artifacts.map(({ name, size_bytes }) => [name, size_bytes === null]), [
    ['layout.json', false],
    ['pattern.svg', true],
    ['suit.svg', true],
  ]);
  const before = (await drawJobs()).length;
  const answers = await Promise.all(Array.from({ length: 12 }, () => service.get(`${layout.href}/pattern.svg`)));
  for (const { status, bytes, type } of answers) {
    assert.equal(status, 200);
    assert.equal(type, 'image/svg+xml');
    assert.ok(bytes.equals(expected('pattern.svg')), 'the bytes of the command line');
  }
  const jobs = await drawJobs();
  assert.equal(jobs.length, before + 1);
  assert.deepEqual([jobs[0].subject, jobs[0].resource, jobs[0].class], [{ kind: 'layout', id: layout.id, file: 'pattern.svg' }, null, 'interactive']);
  const etag = answers[0].headers.get('etag');
  assert.equal((await service.get(`${layout.href}/pattern.svg`, { headers: { 'if-none-match': etag } })).status, 304);
  assert.equal((await service.get(layout.href)).json.artifacts.find(({ name }) => name === 'pattern.svg').size_bytes, answers[0].bytes.length);
});

test('who does not want to wait gets the job', async () => {
  const layout = await lay();
  const answer = await service.get(`${layout.href}/suit.svg`, { headers: { prefer: 'respond-async' } });
  assert.equal(answer.status, 202);
  assert.equal(answer.headers.get('location'), `/v1/jobs/${answer.json.id}`);
  assert.equal((await service.finished(`/v1/jobs/${answer.json.id}`)).state, 'succeeded');
  const { status, bytes } = await service.get(`${layout.href}/suit.svg`, { headers: { prefer: 'respond-async' } });
  assert.equal(status, 200);
  assert.ok(bytes.equals(expected('suit.svg')));
});

test('what is no drawing, or not asked for in a form that it has, makes no job', async () => {
  const layout = await lay();
  const before = (await drawJobs()).length;
  const missing = await service.get(`${layout.href}/pattern.dxf`);
  assert.equal(missing.status, 404);
  assert.match(missing.json.detail, /There are: layout.json, pattern.svg and suit.svg/);
  assert.equal((await service.get(`${layout.href}/pattern.svg`, { headers: { accept: 'image/png' } })).status, 406);
  assert.equal((await service.get(`${layout.href}/pattern.svg?scale=2`)).status, 400);
  assert.equal((await drawJobs()).length, before);
});

test('a drawing that is late is to be asked for again; a client that leaves does not want it', async () => {
  const layout = await lay();
  await restart({ workers: 0 });
  const late = await service.get(`${layout.href}/pattern.svg`, { headers: { prefer: 'wait=1' } });
  assert.equal(late.status, 503);
  assert.equal(late.json.type, 'urn:tightwire:problem:drawing-queued');
  assert.ok(late.headers.get('retry-after'));
  const [job] = await drawJobs('&state=queued');
  assert.equal(job.subject.id, layout.id);
  const socket = connect({ port: Number(new URL(service.url).port), host: '127.0.0.1' });
  socket.on('error', () => {});
  socket.write(`GET ${layout.href}/pattern.svg HTTP/1.1\r\nHost: localhost\r\n\r\n`);
  await until('it waits', async () => /^tightwire_http_held 1$/m.test((await service.get('/metrics')).text));
  await sleep(100);
  socket.destroy();
  await until('it is cancelled', async () => (await service.get(`/v1/jobs/${job.id}`)).json.state === 'cancelled');
  await restart({ workers: 1 });
  const { status, bytes } = await service.get(`${layout.href}/pattern.svg`);
  assert.equal(status, 200);
  assert.ok(bytes.equals(expected('pattern.svg')), 'asked for again, it is made');
});

test('where room is short drawings are dropped, and made again with the same bytes', async () => {
  const layout = await lay();
  const first = await service.get(`${layout.href}/pattern.svg`);
  assert.equal(first.status, 200);
  // A limit a little above what there is: less room than layouts may want.
  const path = join(folder.path, 'store.db');
  await service.stop();
  const size = readFileSync(path).length;
  service = await start({ workers: 1, store: `sqlite:${path}?limit_bytes=${size + (48 << 20)}` });
  await until('it is dropped', async () => (await service.get(layout.href)).json.artifacts.find(({ name }) => name === 'pattern.svg').size_bytes === null);
  const again = await service.get(`${layout.href}/pattern.svg`);
  assert.equal(again.status, 200);
  assert.ok(again.bytes.equals(first.bytes));
  assert.equal((await service.get(`${layout.href}/layout.json`)).status, 200);
});

test('a drawing goes with its layout, and so does its job', async () => {
  const layout = await lay();
  assert.equal((await service.get(`${layout.href}/pattern.svg`)).status, 200);
  const [job] = await drawJobs();
  assert.equal((await service.delete(layout.href)).status, 204);
  assert.equal((await service.get(`/v1/jobs/${job.id}`)).status, 404);
  assert.equal((await service.get(`${layout.href}/pattern.svg`)).status, 404);
});
