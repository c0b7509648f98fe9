// Clients that hold on to connections: they slow nobody else down, /livez least of all, and stop costing when they go.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { connect } from 'node:net';
import { join } from 'node:path';
import { test } from 'node:test';
import { Worker } from 'node:worker_threads';
import { Service, run, sleep, temporaryFolder, until } from './service.mjs';

// Asks /livez every 10 ms from a thread of its own, a new connection each time, as a load balancer does.
const prober = `
  const { parentPort, workerData } = require('node:worker_threads');
  const { connect } = require('node:net');
  let stopped = false;
  parentPort.on('message', () => (stopped = true));
  const ask = () => new Promise((done) => {
    const start = performance.now();
    const socket = connect(workerData.port, '127.0.0.1');
    let back = '';
    socket.on('data', (data) => (back += data));
    socket.on('error', () => done(Infinity));
    socket.on('close', () => done(back.startsWith('HTTP/1.1 200') ? performance.now() - start : Infinity));
    socket.write('GET /livez HTTP/1.1\\r\\nHost: localhost\\r\\nConnection: close\\r\\n\\r\\n');
  });
  (async () => {
    const times = [];
    while (!stopped) {
      times.push(await ask());
      await new Promise((done) => setTimeout(done, 10));
    }
    parentPort.postMessage(times.sort((a, b) => a - b));
  })();`;

// Runs `attack` while somebody asks /livez. A machine that does other work beside makes single answers late: the figures
// are printed, and only what is far beyond them fails.
async function livezDuring(t, service, what, attack) {
  const worker = new Worker(prober, { eval: true, workerData: { port: Number(new URL(service.url).port) } });
  const result = new Promise((done) => worker.once('message', done));
  t.after(() => worker.terminate());
  await sleep(100);
  await attack();
  worker.postMessage('stop');
  const times = await result;
  const at = (share) => times[Math.min(times.length - 1, Math.floor(share * times.length))];
  t.diagnostic(
    `${what}: ${times.length} x /livez, median ${at(0.5).toFixed(1)}, p99 ${at(0.99).toFixed(1)}, most ${at(1).toFixed(1)} ms`,
  );
  assert.ok(times.length > 20, `${times.length}`);
  assert.ok(at(1) < Infinity, 'every /livez is answered with 200');
  assert.ok(at(0.9) < 1000, `${at(0.9)} ms`);
}

async function serve(t, flags) {
  const service = await Service.start(flags);
  t.after(() => service.stop());
  return service;
}

const portOf = (service) => Number(new URL(service.url).port);

function open(service, text, from = '127.0.0.1') {
  const socket = connect({ port: portOf(service), host: '127.0.0.1', localAddress: from });
  socket.back = '';
  socket.on('data', (data) => (socket.back += data));
  socket.on('error', () => {});
  socket.gone = new Promise((done) => socket.on('close', done));
  if (text) socket.write(text);
  return socket;
}

// Opens `count` connections, some at a time: the backlog of the kernel is no part of the test.
async function openMany(service, count, text, from) {
  const sockets = [];
  for (let i = 0; i < count; i++) {
    sockets.push(open(service, text(i), from));
    if (i % 100 === 99) await sleep(10);
  }
  return sockets;
}

async function trickle(sockets, seconds) {
  for (const end = Date.now() + seconds * 1000; Date.now() < end; await sleep(200))
    for (const socket of sockets) if (!socket.destroyed && socket.writable) socket.write('v');
}

const gauge = async (service, name) =>
  Number((await service.get('/metrics')).text.match(new RegExp(`^tightwire_http_${name} (\\d+)`, 'm'))[1]);

const upload = (i) =>
  `POST /v1/meshes?name=${i}.obj HTTP/1.1\r\nHost: localhost\r\nContent-Type: model/obj\r\nContent-Length: 100000\r\n\r\n`;

test('1,040 clients without a key that trickle a body are refused by their heads', async (t) => {
  const folder = temporaryFolder();
  const keys = join(folder.path, 'keys');
  writeFileSync(keys, run('key', 'somebody'), { mode: 0o600 });
  const service = await serve(t, { 'key-file': keys, 'log-level': 'error' });
  await livezDuring(t, service, '1,040 strangers', async () => {
    const sockets = await openMany(service, 1040, upload);
    await trickle(sockets, 2);
    await Promise.all(sockets.map((socket) => socket.gone));
    const refused = sockets.filter((socket) => /^HTTP\/1\.1 (401|429|503) /.test(socket.back));
    assert.equal(refused.length, 1040);
    assert.ok(sockets.some((socket) => socket.back.startsWith('HTTP/1.1 401 ')));
  });
  folder.remove();
});

test('1,040 clients that are let in and trickle a body are too many of one address, or too slow', async (t) => {
  const service = await serve(t, { 'least-rate-bytes-s': 1000, 'log-level': 'error' });
  await livezDuring(t, service, '1,040 tricklers', async () => {
    const sockets = await openMany(service, 1040, upload);
    const open = () => sockets.filter((socket) => !socket.destroyed).length;
    await until('those beyond the limit are refused', () => open() <= 512);
    const refused = sockets.filter((socket) => socket.back.startsWith('HTTP/1.1 429 '));
    assert.ok(refused.length > 200, `${refused.length}`);
    assert.match(refused[0].back, /^Retry-After: 1\r$/m);
    assert.ok(open() > 400, `${open()}`);
    assert.equal((await service.get('/v1/meshes')).status, 429); // we are of that address too
    await trickle(sockets, 8);
    await Promise.all(sockets.map((socket) => socket.gone));
    const kinds = {};
    for (const { back } of sockets) kinds[back.slice(9, 12)] = (kinds[back.slice(9, 12)] ?? 0) + 1;
    t.diagnostic(`answers by status: ${JSON.stringify(kinds)}`);
    const slow = sockets.filter((socket) => socket.back.startsWith('HTTP/1.1 408 '));
    assert.ok(slow.length > 400 && slow.length <= 512, `${slow.length}`);
  });
  assert.deepEqual((await service.get('/v1/meshes')).json.items, []);
});

for (const [what, request] of [
  ['Prefer: wait', () => 'POST /v1/rig/recordings HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nPrefer: wait=60\r\nContent-Length: 2\r\n\r\n{}'],
  ['event streams', (job) => `GET /v1/jobs/${job}/events HTTP/1.1\r\nHost: localhost\r\n\r\n`],
])
  test(`1,100 aborted requests: ${what}`, async (t) => {
    const service = await serve(t, { 'connections-per-address': 1024, 'log-level': 'error' });
    const job = (await service.post('/v1/rig/recordings', { name: 'nobody records' })).json.job.id;
    await livezDuring(t, service, `1,100 x ${what}`, async () => {
      for (let round = 0; round < 11; round++) {
        const sockets = await openMany(service, 100, () => request(job));
        await sleep(50);
        sockets.forEach((socket) => (round % 2 ? socket.destroy() : socket.end()));
      }
      await until('nobody is held any more', async () => (await gauge(service, 'held')) === 0, 10);
    });
    await until('no connection is left', async () => (await gauge(service, 'connections')) <= 3, 10);
    });

test('a client that has gone is noticed at once, and its job goes on', async (t) => {
  const service = await serve(t, {});
  const socket = open(service, 'POST /v1/rig/recordings HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nPrefer: wait=60\r\nContent-Length: 2\r\n\r\n{}');
  await until('it is held', async () => (await gauge(service, 'held')) === 1);
  socket.destroy();
  await until('it is gone', async () => (await gauge(service, 'held')) === 0, 5);
  await until('the log says so', () => / status=499 .*aborted=true/.test(service.log));
  assert.equal((await service.get('/v1/jobs?state=queued')).json.items.length, 1);
});

test('beyond the limit of held requests the others are answered at once', async (t) => {
  const service = await serve(t, { 'held-requests': 2 });
  const held = [0, 1].map((i) => service.post('/v1/rig/recordings', { name: `${i}` }, { prefer: 'wait=3' }));
  await until('two are held', async () => (await gauge(service, 'held')) === 2);
  const start = Date.now();
  const third = await service.post('/v1/rig/recordings', { name: 'third' }, { prefer: 'wait=3' });
  assert.equal(third.status, 202);
  assert.equal(third.headers.get('preference-applied'), null);
  assert.ok(Date.now() - start < 2500);
  const events = await service.get(`/v1/jobs/${third.json.job.id}/events`);
  assert.equal(events.status, 503);
  assert.equal(events.headers.get('retry-after'), '1');
  for (const answer of await Promise.all(held)) assert.equal(answer.headers.get('preference-applied'), 'wait=3');
});

test('beyond the limit of connections /livez is answered, and all else told to come again', async (t) => {
  const service = await serve(t, { connections: 8 });
  const held = await openMany(service, 8, () => 'GET /v1/meshes HTTP/1.1\r\nHost: localhost\r\nX-Half: ');
  await sleep(200);
  for (let i = 0; i < 3; i++) {
    const late = open(service, 'GET /v1/meshes HTTP/1.1\r\nHost: localhost\r\n\r\n');
    await late.gone;
    assert.match(late.back, /^HTTP\/1\.1 503 [^]*Retry-After: 1\r[^]*problem:too-many-connections/);
    const live = open(service, 'GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n');
    await live.gone;
    assert.match(live.back, /^HTTP\/1\.1 200 /);
  }
  held.forEach((socket) => socket.destroy());
  await until('there is room again', async () => (await service.get('/v1/meshes')).status === 200);
});

test('idle connections make room for those that ask', async (t) => {
  const service = await serve(t, { connections: 8 });
  const idle = await openMany(service, 50, () => '');
  assert.equal((await service.get('/v1/meshes')).status, 200);
  idle.forEach((socket) => socket.destroy());
});

test('an address that has too many connections does not bar another', async (t) => {
  const service = await serve(t, { 'connections-per-address': 5 });
  const greedy = await openMany(service, 9, () => 'GET /v1/meshes HTTP/1.1\r\nHost: localhost\r\nX-Half: ', '127.0.0.2');
  const tenth = open(service, 'GET /v1/meshes HTTP/1.1\r\nHost: localhost\r\n\r\n', '127.0.0.2');
  await tenth.gone;
  assert.match(tenth.back, /^HTTP\/1\.1 429 [^]*problem:too-many-of-one-address/);
  assert.equal((await service.get('/v1/meshes')).status, 200);
  greedy.forEach((socket) => socket.destroy());
});

test('a head, and a whole request, have their time', async (t) => {
  const service = await serve(t, { 'head-timeout-s': 1, 'request-timeout-s': 2, 'idle-timeout-s': 20, 'least-rate-bytes-s': 0 });
  const head = open(service, 'GET /livez HTTP/1.1\r\nHost: loc');
  const body = open(service, upload(1));
  const drip = setInterval(() => [head, body].forEach((socket) => socket.writable && socket.write('x')), 100);
  await Promise.all([head.gone, body.gone]);
  clearInterval(drip);
  assert.match(head.back, /^HTTP\/1\.1 408 [^]*problem:request-timeout/);
  assert.match(body.back, /^HTTP\/1\.1 408 [^]*problem:request-timeout/);
});

test('a client that does not take its answer is let go', async (t) => {
  const service = await serve(t, { 'idle-timeout-s': 1 });
  const made = await service.post('/v1/rig/recordings', {});
  const socket = connect(portOf(service), '127.0.0.1');
  socket.on('error', () => {});
  socket.pause();
  const closed = new Promise((done) => socket.on('close', done));
  const ask = 'GET /openapi.yaml HTTP/1.1\r\nHost: localhost\r\n\r\n';
  socket.write(ask.repeat(300));
  await until('it is let go', async () => (await gauge(service, 'connections')) <= 2, 15);
  socket.destroy();
  await closed;
  assert.equal(made.status, 202);
});
