// What happens to the work when the store has no room, is damaged, or goes away, and when the whole service is killed.
import test from 'node:test';
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFileSync, renameSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Service, run, sleep, temporaryFolder, tightwire, until } from './service.mjs';

const mesh = (i) =>
  `# ${i}\nv 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nvt 0 0\nvt 100 0\nvt 100 100\nvt 0 100\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n`;
const obj = { 'content-type': 'model/obj' };
const json = { 'content-type': 'application/json' };

async function lastJobs(service, count) {
  return (await service.get(`/v1/jobs?limit=${count}`)).json.items;
}

test('a full store holds jobs back, costs them nothing, and they go on by themselves when there is room', async () => {
  const folder = temporaryFolder();
  const service = await Service.start({ workers: 2, store: `sqlite:${folder.path}/small.db?limit_bytes=${54 << 20}` });
  const filler = (await service.post('/v1/uploads?part=worn', undefined, { 'content-type': 'application/octet-stream' })).json;
  const filled = await service.request('PATCH', filler.href, {
    body: Buffer.alloc(52 << 20, 'v'),
    headers: { 'content-type': 'application/octet-stream', 'upload-offset': '0', 'upload-complete': '?0' },
  });
  assert.equal(filled.status, 200);
  for (let i = 0; i < 60; i++) assert.equal((await service.post('/v1/meshes?name=a.obj', mesh(i), obj)).status, 202);
  await sleep(2000);
  for (const job of await lastJobs(service, 60)) assert.deepEqual([job.state, job.attempts], ['queued', 0]);
  assert.equal((await service.delete(filler.href)).status, 204);
  const since = Date.now();
  await until('all are done', async () => (await lastJobs(service, 60)).every((job) => job.state === 'succeeded'), 60);
  for (const job of await lastJobs(service, 60)) assert.equal(job.attempts, 1);
  console.log(`# 60 jobs were done ${Date.now() - since} ms after there was room again`);
  await service.stop();
  folder.remove();
});

test('a result whose bytes have rotted is an error, and never handed out', async () => {
  const folder = temporaryFolder();
  run('sample', '--out', join(folder.path, 'sample'), '--vertices', '3000');
  const read = (...path) => readFileSync(join(folder.path, 'sample', ...path));
  const store = join(folder.path, 'store.db');
  let service = await Service.start({ workers: 1, store: `sqlite:${store}` });
  const suit = (await service.post('/v1/meshes?name=suit.obj', read('suit.obj'), { ...obj, prefer: 'wait=60' })).json;
  const walk = (await service.post(`/v1/meshes/${suit.id}/motions?name=walk.pc2`, read('motions', 'walk.pc2'), { 'content-type': 'application/octet-stream' })).json;
  const field = (await service.post('/v1/fields', { mesh: suit.id, motions: [walk.id] })).json;
  const terminals = JSON.parse(read('terminals', 'joints10.json'));
  const layout = (await service.post('/v1/layouts', { ...terminals, field: field.id }, { ...json, prefer: 'wait=60' })).json;
  assert.equal((await service.finished(layout.href)).state, 'succeeded');
  const pattern = (await service.get(`${layout.href}/pattern.svg`)).bytes;
  await service.stop();
  // One byte, in the middle of the drawing.
  const bytes = readFileSync(store);
  const at = bytes.indexOf(pattern.subarray(pattern.length >> 1, (pattern.length >> 1) + 60));
  assert.ok(at > 0);
  bytes[at + 30] ^= 1;
  writeFileSync(store, bytes);
  service = await Service.start({ workers: 0, store: `sqlite:${store}` });
  const answer = await service.get(`${layout.href}/pattern.svg`);
  assert.equal(answer.status, 500);
  assert.equal(answer.json.type, 'urn:tightwire:problem:stored-bytes-damaged');
  await until('it is logged', () => /failed id=\S+ type=stored-bytes-damaged/.test(service.log));
  assert.equal((await service.get(layout.href)).json.state, 'succeeded');
  await service.stop();
  folder.remove();
});

test('a worker whose store is gone says so and ends; the daemon is not ready', async () => {
  const folder = temporaryFolder();
  const store = join(folder.path, 'store.db');
  const service = await Service.start({ workers: 0, store: `sqlite:${store}` });
  const worker = spawn(tightwire, ['worker', '--store', `sqlite:${store}`]);
  let said = '';
  worker.stderr.on('data', (bytes) => (said += bytes));
  const ended = new Promise((done) => worker.on('exit', done));
  await sleep(300);
  assert.equal(worker.exitCode, null);
  renameSync(store, `${store}.away`);
  assert.equal(await Promise.race([ended, sleep(10000)]), 1);
  assert.match(said, /was deleted, replaced or unmounted/);
  assert.equal((await service.get('/livez')).status, 200);
  assert.equal((await service.get('/readyz')).status, 503);
  const refused = await service.post('/v1/meshes?name=a.obj', mesh(1), obj);
  assert.equal(refused.status, 503);
  assert.equal(refused.json.type, 'urn:tightwire:problem:store-gone');
  // It comes back, as a mount would.
  renameSync(`${store}.away`, store);
  assert.equal((await service.get('/readyz')).status, 200);
  assert.equal((await service.post('/v1/meshes?name=a.obj', mesh(1), obj)).status, 202);
  await service.stop();
  const none = spawn(tightwire, ['worker', '--store', `sqlite:${folder.path}/none.db`]);
  assert.equal(await new Promise((done) => none.on('exit', done)), 1);
  folder.remove();
});

test('a service that is killed with all its workers, again and again, costs its jobs no attempt', async () => {
  const folder = temporaryFolder();
  run('sample', '--out', join(folder.path, 'sample'), '--vertices', '30000');
  const store = `sqlite:${folder.path}/store.db`;
  let service = await Service.start({ workers: 1, store });
  const { json: suit } = await service.post('/v1/meshes?name=suit.obj', readFileSync(join(folder.path, 'sample', 'suit.obj')), obj);
  for (let i = 0; i < 5; i++) {
    await until('a worker has it', async () => (await lastJobs(service, 1))[0].state !== 'queued');
    const workers = service.workers();
    for (const pid of [service.process.pid, ...workers]) process.kill(pid, 'SIGKILL');
    await service.exited;
    service = await Service.start({ workers: 1, store });
  }
  const done = await service.finished(suit.href);
  assert.equal(done.state, 'succeeded');
  const [job] = await lastJobs(service, 1);
  assert.equal(job.attempts, 1);
  await service.stop();
  folder.remove();
});

test('a job of a worker that was killed goes back into the queue though no other worker is there', async () => {
  const folder = temporaryFolder();
  run('sample', '--out', join(folder.path, 'sample'), '--vertices', '60000');
  const store = `sqlite:${folder.path}/store.db`;
  const service = await Service.start({ workers: 0, store });
  await service.post('/v1/meshes?name=suit.obj', readFileSync(join(folder.path, 'sample', 'suit.obj')), obj);
  const worker = spawn(tightwire, ['worker', '--store', store, '--lease-s', '1']);
  await until('it has begun', async () => (await lastJobs(service, 1))[0].state === 'running');
  worker.kill('SIGKILL');
  const [job] = await until('it is queued again', async () => {
    const jobs = await lastJobs(service, 1);
    return jobs[0].state === 'queued' && jobs;
  });
  assert.equal(job.attempts, 1);
  await service.stop();
  folder.remove();
});
