// The bench rig against an acquisition box that shares no code with ours: the Modbus server of npm's modbus-serial.
import { test, before, after } from 'node:test';
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import modbus from 'modbus-serial';

const binary = process.env.TIGHTWIRE;
const folder = mkdtempSync(join(tmpdir(), 'tightwire-rig-'));
const store = `sqlite:${join(folder, 'store.db')}`;
let daemon, base;

// A box whose channel c reads (scans + 10 c) mod 1024, or an exception when it is told so.
class Box {
  constructor(port) {
    this.port = port;
    this.scans = 0;
    this.broken = false;
  }
  start() {
    const vector = {
      getInputRegister: (address, unit, done) => {
        if (this.broken) return done({ modbusErrorCode: 4, msg: 'device failure' });
        if (address === 0) this.scans++;
        done(null, (this.scans + 10 * address) % 1024);
      },
    };
    this.server = new modbus.ServerTCP(vector, { host: '127.0.0.1', port: this.port, unitID: 1 });
    this.server.on('socketError', () => {});
    this.server.on('serverError', () => {});
    return new Promise((resolve) => this.server.on('initialized', resolve));
  }
  stop() {
    return new Promise((resolve) => this.server.close(resolve));
  }
}

function freePort() {
  return new Promise((resolve) => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}

async function until(what, check, seconds = 15) {
  const end = Date.now() + seconds * 1000;
  while (Date.now() < end) {
    const value = await check();
    if (value) return value;
    await sleep(50);
  }
  assert.fail(`waited ${seconds} s for ${what}`);
}

const get = async (path) => (await fetch(base + path)).json();

async function record(duration_s, name) {
  const response = await fetch(`${base}/v1/rig/recordings`, {
    method: 'POST',
    headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify({ duration_s, name }),
  });
  assert.equal(response.status, 202);
  return response.headers.get('location');
}

const ended = (location) =>
  until('the recording to end', async () => {
    const it = await get(location);
    return ['succeeded', 'failed', 'cancelled', 'incomplete'].includes(it.state) && it;
  });

function startRig(device) {
  return spawn(binary, ['rig', '--device', device, '--store', store, '--timeout-ms', '300'], { stdio: 'inherit' });
}

const gone = (child) =>
  child.exitCode !== null || child.signalCode !== null
    ? Promise.resolve()
    : new Promise((resolve) => child.on('exit', resolve));

before(async () => {
  daemon = spawn(binary, ['serve', '--listen', '127.0.0.1:0', '--store', store, '--workers', '0', '--log-level', 'error'], {
    stdio: ['ignore', 'pipe', 'inherit'],
  });
  base = await new Promise((resolve, reject) => {
    daemon.stdout.on('data', (text) => resolve(/listening on (\S+)/.exec(text)[1]));
    daemon.on('exit', (code) => reject(new Error(`the daemon ended with ${code}`)));
  });
});

after(async () => {
  daemon.kill('SIGTERM');
  await gone(daemon);
  rmSync(folder, { recursive: true, force: true });
});

test('without a rig process the state says stopped and has no sample', async () => {
  const state = await get('/v1/rig');
  assert.equal(state.status, 'stopped');
  assert.equal(state.latest, null);
});

test('a rig that is not there is reported, and found when it comes up', async () => {
  const box = new Box(await freePort());
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    const lost = await until('a reported problem', async () => {
      const state = await get('/v1/rig');
      return state.status === 'connecting' && state.text && state;
    });
    assert.match(lost.text, /refused/i);
    await box.start();
    const state = await until('a sample', async () => {
      const now = await get('/v1/rig');
      return now.latest && now.status === 'connected' && now;
    });
    assert.equal(state.latest.counts.length, 24);
    for (let c = 0; c < 24; c++) assert.equal(state.latest.counts[c], (state.latest.counts[0] + 10 * c) % 1024);
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
  assert.equal(rig.exitCode, 0);
  assert.equal((await get('/v1/rig')).status, 'stopped');
});

test('a recording holds fifty consecutive samples a second, as JSON and as CSV', async () => {
  const box = new Box(await freePort());
  await box.start();
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const location = await record(2, 'two seconds');
    const recording = await ended(location);
    assert.equal(recording.state, 'succeeded');
    assert.equal(recording.name, 'two seconds');

    const { items } = await get(`${location}/samples?limit=5000`);
    // A busy machine may miss slots, which are gaps. It has no more than there are, but for answers that were due just before
    // the recording began and came late: the time stamp is that of the answer.
    assert.ok(items.length >= 50 && items.length <= 104, `${items.length} samples in 2 s at 50 Hz`);
    for (let i = 1; i < items.length; i++) {
      const step = (items[i].counts[0] - items[i - 1].counts[0] + 1024) % 1024;
      assert.equal(step, 1, 'no sample of the box is missing or doubled');
      assert.ok(items[i].at_us > items[i - 1].at_us);
    }
    const steps = items.slice(1).map((s, i) => s.at_us - items[i].at_us).sort((a, b) => a - b);
    const median = steps[steps.length >> 1];
    assert.ok(Math.abs(median - 20000) < 2000, `${median} us between samples`);

    const lines = (await (await fetch(`${base}${location}/samples.csv`)).text()).trimEnd().split('\n');
    assert.equal(lines.length, items.length + 1);
    assert.equal(lines[0].split(',').length, 25);
    lines.slice(1).forEach((line, i) => assert.equal(line, [items[i].at_us, ...items[i].counts].join(',')));
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a box that goes away in the middle leaves a gap, and the reader connects again', async () => {
  const box = new Box(await freePort());
  await box.start();
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const location = await record(4);
    await sleep(1000);
    await box.stop();
    await sleep(800);
    await box.start();
    const recording = await ended(location);
    assert.equal(recording.state, 'succeeded');
    const { items } = await get(`${location}/samples?limit=5000`);
    const gap = Math.max(...items.slice(1).map((s, i) => s.at_us - items[i].at_us)) / 1e6;
    assert.ok(gap > 0.7 && gap < 2.5, `the longest gap is ${gap} s`);
    assert.ok(items.length > 60 && items.length < 170, `${items.length} samples`);
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a Modbus exception is named and does not cost the connection', async () => {
  const box = new Box(await freePort());
  await box.start();
  box.broken = true;
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    const state = await until('the exception', async () => {
      const now = await get('/v1/rig');
      return /refuses registers 0 to 23/.test(now.text) && now;
    });
    assert.equal(state.status, 'connected');
    box.broken = false;
    await until('samples', async () => (await get('/v1/rig')).text === '');
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a box that accepts and never answers is a gap, and no recording is made up from it', async () => {
  const silent = createServer((socket) => socket.on('error', () => {}));
  await new Promise((resolve) => silent.listen(0, '127.0.0.1', resolve));
  const rig = startRig(`tcp://127.0.0.1:${silent.address().port}`);
  try {
    await until('the problem', async () => /no answer/.test((await get('/v1/rig')).text));
    const recording = await ended(await record(0.5));
    assert.equal(recording.state, 'failed');
    assert.match(JSON.stringify(recording), /rig-no-samples/);
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    silent.close();
  }
});

test('a rig process that is killed in the middle goes on with the same recording', async () => {
  const box = new Box(await freePort());
  await box.start();
  let rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const location = await record(14);
    await sleep(1500);
    rig.kill('SIGKILL');
    await gone(rig);
    rig = startRig(`tcp://127.0.0.1:${box.port}`);
    const recording = await until('the end', async () => {
      const it = await get(location);
      return it.state === 'succeeded' && it;
    }, 25);
    assert.equal(recording.state, 'succeeded');
    const { items } = await get(`${location}/samples?limit=5000`);
    const times = items.map((s) => s.at_us);
    assert.deepEqual(times, [...new Set(times)].sort((a, b) => a - b), 'no sample is doubled or out of order');
    assert.ok((times.at(-1) - times[0]) / 1e6 > 12, 'it reaches the end that was asked for');
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a wrong device is refused on the command line with the reason', async () => {
  for (const device of ['udp://127.0.0.1:502', 'tcp://127.0.0.1', 'tcp://127.0.0.1:70000', 'rtu:', 'rtu:/dev/ttyUSB0?baud=9']) {
    const child = spawn(binary, ['rig', '--device', device, '--store', store], { stdio: ['ignore', 'ignore', 'pipe'] });
    let text = '';
    child.stderr.on('data', (part) => (text += part));
    await gone(child);
    assert.equal(child.exitCode, 2, device);
    assert.match(text, /device must be/);
    assert.equal(text.trim().split('\n').length, 1);
  }
});
