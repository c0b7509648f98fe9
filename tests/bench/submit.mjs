// Layout requests against a real service, none of which is ever computed: how many a second 32 clients get kept, how many
// waits for the disk that takes, and how long one waits where 200 a second come and a worker is busy. A client is a
// bare connection that is kept open; what takes the time is the service.
//   TIGHTWIRE  the binary     SECONDS  of each part, 5 unless told otherwise
//   SLOW_DISK  a library that is loaded before the C library, and makes the disk slow: then only what depends on it
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const seconds = Number(process.env.SECONDS ?? 5);
const folder = mkdtempSync(join(tmpdir(), 'tightwire-submit-'));
const store = `sqlite:${join(folder, 'store.db')}`;
const tightwire = process.env.TIGHTWIRE;
const slow = process.env.SLOW_DISK;
const now = () => Number(process.hrtime.bigint()) / 1e6;
const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

function line(name, value, unit, goal) {
  const met = goal === undefined ? '' : (goal < 0 ? value >= -goal : value <= goal) ? 'ok' : 'MISSED';
  const bound = goal === undefined ? '' : goal < 0 ? `>= ${-goal}` : `<= ${goal}`;
  console.log(`${name.padEnd(36)} ${Number(value.toPrecision(4)).toString().padStart(12)} ${unit.padEnd(6)} ${bound.padEnd(10)} ${met}`);
}

async function start(...args) {
  const child = spawn(tightwire, ['serve', '--listen', '127.0.0.1:0', '--store', store, '--log-level', 'error', ...args], {
    env: slow ? { ...process.env, LD_PRELOAD: slow } : process.env,
  });
  let out = '';
  child.stdout.on('data', (bytes) => (out += bytes));
  child.stderr.on('data', (bytes) => process.stderr.write(bytes));
  while (!out.includes('\n')) await sleep(20);
  return { child, port: Number(out.match(/:(\d+)\s/)[1]) };
}

class Client {
  constructor(port) {
    this.socket = connect(port, '127.0.0.1');
    this.socket.setNoDelay(true);
    this.text = '';
    this.socket.on('data', (bytes) => {
      this.text += bytes.toString('latin1');
      const head = this.text.indexOf('\r\n\r\n');
      if (head < 0) return;
      const length = Number(this.text.match(/content-length: (\d+)/i)?.[1] ?? 0);
      if (this.text.length < head + 4 + length) return;
      const answer = {
        status: Number(this.text.slice(9, 12)),
        etag: this.text.slice(0, head).match(/^etag: (.*)$/im)?.[1],
        body: this.text.slice(head + 4, head + 4 + length),
      };
      this.text = this.text.slice(head + 4 + length);
      this.done(answer);
    });
  }
  ask(method, path, body = '', type = 'application/json', more = '') {
    const answer = new Promise((done) => (this.done = done));
    this.socket.write(`${method} ${path} HTTP/1.1\r\nHost: localhost\r\n${more}Content-Type: ${type}\r\nContent-Length: ${Buffer.byteLength(body)}\r\n\r\n`);
    if (body.length) this.socket.write(body);
    return answer;
  }
  close() {
    this.socket.destroy();
  }
}

const percentile = (times, share) => times.sort((a, b) => a - b)[Math.min(times.length - 1, Math.floor(times.length * share))];

// A field that is never computed, so that what is asked of it is kept, and waits.
async function prepare(port) {
  const client = new Client(port);
  const mesh = JSON.parse((await client.ask('POST', '/v1/meshes?name=a.obj', 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n', 'model/obj')).body);
  const motion = JSON.parse((await client.ask('POST', `/v1/meshes/${mesh.id}/motions?name=a.pc2`, 'POINTCACHE2', 'application/octet-stream')).body);
  const field = JSON.parse((await client.ask('POST', '/v1/fields', JSON.stringify({ mesh: mesh.id, motions: [motion.id] }))).body);
  client.close();
  return field;
}

async function prepareSample(port) {
  const client = new Client(port), binary = 'application/octet-stream';
  const read = (...path) => readFileSync(join(folder, 'sample', ...path));
  const mesh = JSON.parse((await client.ask('POST', '/v1/meshes?name=suit.obj', read('suit.obj'), 'model/obj')).body);
  const motion = JSON.parse((await client.ask('POST', `/v1/meshes/${mesh.id}/motions?name=walk.pc2`, read('motions', 'walk.pc2'), binary)).body);
  const field = JSON.parse((await client.ask('POST', '/v1/fields', JSON.stringify({ mesh: mesh.id, motions: [motion.id] }))).body);
  while (JSON.parse((await client.ask('GET', `/v1/fields/${field.id}`)).body).state !== 'succeeded') await sleep(100);
  client.close();
  return field;
}

async function syncs(port) {
  const client = new Client(port);
  const { body } = await client.ask('GET', '/metrics');
  client.close();
  return Number(body.match(/^tightwire_store_syncs_total (\d+)/m)?.[1] ?? NaN);
}

const request = (field, i) => JSON.stringify({ field, terminals: [{ vertex: 0, name: `order-${i}` }, { vertex: 1 + (i % 2) }] });

async function flatOut(port, field) {
  let kept = 0, failed = 0, last = '';
  const times = [], before = await syncs(port), end = now() + seconds * 1000;
  await Promise.all(
    Array.from({ length: 32 }, async (_, c) => {
      const client = new Client(port);
      for (let i = 0; now() < end; i++) {
        const since = now();
        const { status, body } = await client.ask('POST', '/v1/layouts', request(field.id, i * 32 + c));
        times.push(now() - since);
        if (status === 202) kept++;
        else (failed++, (last = body));
      }
      client.close();
    }),
  );
  if (failed) console.log(`${failed} requests failed: ${last}`);
  const disk = slow ? ', disk + 5 ms' : '';
  line(`submits of 32 clients${disk}`, kept / seconds, '/s', -1500);
  line(`p99 of 32 clients${disk}`, percentile(times, 0.99), 'ms');
  line(`waits for the disk a submit${disk}`, ((await syncs(port)) - before) / kept, '');
}

// At fixed times, whatever the answers do; the waiting for a free client counts.
async function steady(port, field, rate) {
  const clients = Array.from({ length: 32 }, () => new Client(port)), free = [...clients], waiting = [];
  const times = [], all = [];
  const start = now();
  for (let i = 0; i < rate * seconds; i++) {
    const due = start + (i * 1000) / rate;
    if (due > now()) await sleep(due - now());
    all.push(
      (async () => {
        const client = free.pop() ?? (await new Promise((done) => waiting.push(done)));
        await client.ask('POST', '/v1/layouts', request(field.id, i));
        times.push(now() - due);
        const next = waiting.shift();
        next ? next(client) : free.push(client);
      })(),
    );
  }
  await Promise.all(all);
  clients.forEach((client) => client.close());
  return times;
}

const alone = await start('--workers', '0');
const field = await prepare(alone.port);
await flatOut(alone.port, field);
if (slow) {
  alone.child.kill('SIGTERM');
  await new Promise((done) => alone.child.on('exit', done));
  rmSync(folder, { recursive: true, force: true });
  process.exit(0);
}
line('submit at 200/s: p99, no worker', percentile(await steady(alone.port, field, 200), 0.99), 'ms', 25);
const live = [];
const watch = setInterval(async () => {
  const client = new Client(alone.port), since = now();
  await client.ask('GET', '/livez');
  live.push(now() - since);
  client.close();
}, 20);
await flatOut(alone.port, field);
clearInterval(watch);
line('/livez beside 32 clients: p99', percentile(live, 0.99), 'ms', 100);
alone.child.kill('SIGTERM');
await new Promise((done) => alone.child.on('exit', done));

// The same with a worker that computes them, one after the other, and writes what comes out.
execFileSync(tightwire, ['sample', '--out', join(folder, 'sample'), '--vertices', '3000']);
const busy = await start('--workers', '1');
const real = await prepareSample(busy.port);
// Who polls a finished layout and has its tag, as 16 clients do it flat out.
async function readFlatOut(port, href) {
  let unchanged = 0;
  const first = new Client(port);
  while (JSON.parse((await first.ask('GET', href)).body).state !== 'succeeded') await sleep(100);
  const { etag } = await first.ask('GET', href);
  first.close();
  const end = now() + seconds * 1000;
  await Promise.all(
    Array.from({ length: 16 }, async () => {
      const client = new Client(port);
      while (now() < end) {
        const { status } = await client.ask('GET', href, '', 'application/json', `If-None-Match: ${etag}\r\n`);
        if (status === 304) unchanged++;
      }
      client.close();
    }),
  );
  line('reads of a layout with its ETag', unchanged / seconds, '/s', -5000);
}
const probe = new Client(busy.port);
const finished = JSON.parse((await probe.ask('POST', '/v1/layouts', request(real.id, 1))).body).href;
probe.close();
await readFlatOut(busy.port, finished);
line('submit at 200/s: p99, a busy worker', percentile(await steady(busy.port, real, 200), 0.99), 'ms', 25);
busy.child.kill('SIGTERM');
await new Promise((done) => busy.child.on('exit', done));
rmSync(folder, { recursive: true, force: true });
