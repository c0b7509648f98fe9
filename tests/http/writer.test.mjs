// The write lock of the store: who reads never waits for it, and who waits for it loses nothing.
import test from 'node:test';
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { join } from 'node:path';
import { Service, build, sleep, until } from './service.mjs';

const mesh = (i) => `v 0 0 ${i}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n`;
const obj = { 'content-type': 'model/obj' };

test('reads and /livez answer at once while the write lock is taken, and writes are kept when it is free', async () => {
  const service = await Service.start({ workers: 0, 'http-threads': 2 });
  const kept = (await service.post('/v1/meshes?name=a.obj', mesh(0), obj)).json;
  const holder = spawn(join(build, 'tests/tools/hold_store'), [service.store]);
  let out = '';
  holder.stdout.on('data', (bytes) => (out += bytes));
  await until('the lock is taken', () => out.includes('held'));
  let answered = 0;
  const large = Buffer.alloc(5 << 20, '# a comment that takes room in the store\n');
  const writes = Array.from({ length: 40 }, (_, i) =>
    service.post(`/v1/meshes?name=a${i}.obj`, i < 4 ? Buffer.concat([large, Buffer.from(mesh(i + 1))]) : mesh(i + 1), obj),
  );
  writes.forEach((write) => write.then(() => answered++));
  await sleep(300);
  const start = Date.now();
  for (let i = 0; i < 20; i++) {
    assert.equal((await service.get('/livez')).status, 200);
    assert.equal((await service.get(kept.href)).status, 200);
    assert.equal((await service.get('/v1/jobs?state=queued')).json.items.length, 1);
    assert.equal((await service.get('/metrics')).status, 200);
  }
  assert.ok(Date.now() - start < 5000, `80 reads took ${Date.now() - start} ms`);
  assert.equal(answered, 0);
  holder.stdin.end();
  for (const { status } of await Promise.all(writes)) assert.equal(status, 202);
  assert.equal((await service.get('/v1/meshes?limit=100')).json.items.length, 41);
  assert.deepEqual(await service.stop(), { code: 0, signal: null });
});

test('a service that is stopped while writes wait for the lock ends, and what it acknowledged is there', async () => {
  const service = await Service.start({ workers: 0, 'drain-s': 2 });
  const holder = spawn(join(build, 'tests/tools/hold_store'), [service.store]);
  let out = '';
  holder.stdout.on('data', (bytes) => (out += bytes));
  await until('the lock is taken', () => out.includes('held'));
  const writes = Array.from({ length: 30 }, (_, i) => service.post('/v1/meshes?name=a.obj', mesh(i), obj).catch(() => ({})));
  await sleep(200);
  const end = service.stop();
  await sleep(500);
  holder.stdin.end();
  assert.deepEqual(await end, { code: 0, signal: null });
  for (const { status } of await Promise.all(writes)) assert.ok([202, undefined, 503].includes(status), status);
});
