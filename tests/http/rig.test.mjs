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
import { build, checkContract } from './service.mjs';

const binary = process.env.TIGHTWIRE;
const folder = mkdtempSync(join(tmpdir(), 'tightwire-rig-'));
const store = `sqlite:${join(folder, 'store.db')}`;
let daemon, base;

// A box whose channel c reads (scans + 10 c) mod 1024, or an exception when it is told so.
class Box {
  constructor(port, unit = 1) {
    this.port = port;
    this.unit = unit;
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
    this.server = new modbus.ServerTCP(vector, { host: '127.0.0.1', port: this.port, unitID: this.unit });
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

async function until(what, check, seconds = 40) {
  const end = Date.now() + seconds * 1000;
  while (Date.now() < end) {
    const value = await check();
    if (value) return value;
    await sleep(50);
  }
  assert.fail(`waited ${seconds} s for ${what}`);
}

async function get(path) {
  const response = await fetch(base + path);
  const json = await response.json();
  checkContract('GET', path, response.status, response.headers.get('content-type').split(';')[0], json);
  return json;
}

// A machine that is busy misses slots; where a test is not about that, it does not matter.
const whatever = { tolerance: 1 };

async function record(duration_s, more = {}) {
  const response = await fetch(`${base}/v1/rig/recordings`, {
    method: 'POST',
    headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify({ duration_s, ...more }),
  });
  assert.equal(response.status, 202);
  return response.headers.get('location');
}

const ended = (location) =>
  until('the recording to end', async () => {
    const it = await get(location);
    return ['succeeded', 'failed', 'cancelled', 'incomplete'].includes(it.state) && it;
  });

function startRig(device, ...more) {
  return spawn(binary, ['rig', '--device', device, '--store', store, ...(more.includes('--timeout-ms') ? [] : ['--timeout-ms', '2000']), ...more], { stdio: 'inherit' });
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
    const location = await record(2, { name: 'two seconds', ...whatever });
    const recording = await ended(location);
    assert.equal(recording.state, 'succeeded');
    assert.equal(recording.name, 'two seconds');

    const { items } = await get(`${location}/samples?limit=5000`);
    // A busy machine may miss slots, which are gaps.
    assert.ok(items.length >= 10 && items.length <= 100, `${items.length} samples in 2 s at 50 Hz`);
    const { summary } = recording;
    assert.equal(summary.expected_count, 100);
    assert.equal(summary.sample_count, items.length);
    assert.equal(summary.missing_count, 100 - items.length);
    assert.equal(summary.rate_hz, 50);
    assert.equal(summary.duration_s, 2);
    for (let i = 1; i < items.length; i++) {
      const step = (items[i].counts[0] - items[i - 1].counts[0] + 1024) % 1024;
      assert.equal(step, 1, 'no sample of the box is missing or doubled');
      assert.ok(items[i].at_us > items[i - 1].at_us);
    }
    const steps = items.slice(1).map((s, i) => s.at_us - items[i].at_us).sort((a, b) => a - b);
    const median = steps[steps.length >> 1];
    // Where hardly any is missing, they are a fiftieth of a second apart.
    if (summary.missing_count < 10) assert.ok(Math.abs(median - 20000) < 5000, `${median} us between samples`);

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

test('a box that goes away leaves a gap that the summary tells; what misses more than its tolerance is incomplete', async () => {
  const box = new Box(await freePort());
  await box.start();
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    for (const [more, state] of [
      [{}, 'incomplete'],
      [whatever, 'succeeded'],
    ]) {
      await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
      const before = await get('/v1/rig');
      const location = await record(4, more);
      await until('its start', async () => (await get(location)).state === 'running');
      await sleep(1000);
      await box.stop();
      await sleep(800);
      await box.start();
      const recording = await ended(location);
      assert.equal(recording.state, state);
      const { summary } = recording;
      const { items } = await get(`${location}/samples?limit=5000`);
      const gap = Math.max(...items.slice(1).map((s, i) => s.at_us - items[i].at_us)) / 1e6;
      assert.ok(gap > 0.7 && gap < 3.5, `the longest gap is ${gap} s`);
      // A stamp is that of the answer, which may come late.
      assert.ok(Math.abs(summary.longest_gap_s - gap) < 1, `${summary.longest_gap_s} s in the summary, ${gap} s by the stamps`);
      assert.equal(summary.sample_count, items.length);
      assert.equal(summary.sample_count + summary.missing_count, 200);
      assert.ok(Math.abs(summary.missing_share - summary.missing_count / 200) < 1e-9);
      assert.ok(summary.missing_count >= 35, `${summary.missing_count} missing`);
      // The state is written a few times a second.
      await until('the rig to count the gaps too', async () => {
        const after = await get('/v1/rig');
        return after.gaps - before.gaps >= summary.missing_count && after.connects > before.connects;
      });
    }
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('exceptions of a device are counted in the state and in the recording', async () => {
  const box = new Box(await freePort());
  await box.start();
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const location = await record(3);
    await until('its start', async () => (await get(location)).state === 'running');
    await sleep(500);
    box.broken = true;
    await sleep(1000);
    box.broken = false;
    const recording = await ended(location);
    assert.equal(recording.state, 'incomplete');
    const { exceptions, missing_count, dropped } = recording.summary;
    assert.ok(exceptions > 0 && exceptions <= missing_count, `${exceptions} exceptions, ${missing_count} missing`);
    assert.equal(dropped, 0);
    const state = await until('the rig to count them too', async () => {
      const now = await get('/v1/rig');
      return now.exceptions >= exceptions && now;
    });
    assert.ok(state.gaps >= state.exceptions);
    assert.equal(state.rate_hz, 50);
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

test('stderr says once that there are no samples, and when they come', async () => {
  const port = await freePort();
  const rig = spawn(binary, ['rig', '--device', `tcp://127.0.0.1:${port}`, '--store', store], { stdio: ['ignore', 'ignore', 'pipe'] });
  let text = '';
  rig.stderr.on('data', (part) => (text += part));
  const box = new Box(port);
  try {
    await until('the word', () => /no-samples text="cannot connect to .*; trying again"/.test(text));
    await box.start();
    await until('the connection', () => /info connected device=/.test(text), 15);
    assert.equal(text.trim().split('\n').length, 2, text);
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a box that accepts and never answers is a gap, and no recording is made up from it', async () => {
  const silent = createServer((socket) => socket.on('error', () => {}));
  await new Promise((resolve) => silent.listen(0, '127.0.0.1', resolve));
  const rig = startRig(`tcp://127.0.0.1:${silent.address().port}`, '--timeout-ms', '300');
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

test('a rig process that is killed is followed by the next one at once, with the same recording', async () => {
  const box = new Box(await freePort());
  await box.start();
  let rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const location = await record(8, whatever);
    await until('its first samples', async () => (await get(`${location}/samples`)).items.length);
    rig.kill('SIGKILL');
    await gone(rig);
    const had = (await get(`${location}/samples?limit=5000`)).items.length;
    rig = startRig(`tcp://127.0.0.1:${box.port}`);
    // Sooner than its lease of ten seconds would have run out.
    await until('more samples', async () => (await get(`${location}/samples?limit=5000`)).items.length > had, 8);
    const recording = await ended(location);
    assert.equal(recording.state, 'succeeded');
    const { items } = await get(`${location}/samples?limit=5000`);
    const times = items.map((s) => s.at_us);
    assert.deepEqual(times, [...new Set(times)].sort((a, b) => a - b), 'no sample is doubled or out of order');
    assert.ok((times.at(-1) - times[0]) / 1e6 > 4, 'it reaches the end that was asked for');
    assert.equal(recording.summary.sample_count + recording.summary.missing_count, 400);
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a recording whose rig process was killed for good is ended by the daemon', async () => {
  const box = new Box(await freePort());
  await box.start();
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const location = await record(3);
    await until('its first samples', async () => (await get(`${location}/samples`)).items.length);
    rig.kill('SIGKILL');
    await gone(rig);
    const recording = await ended(location);
    assert.equal(recording.state, 'incomplete');
    assert.equal(recording.summary.sample_count + recording.summary.missing_count, 150);
    assert.ok(recording.summary.longest_gap_s > 1, `${recording.summary.longest_gap_s} s`);
  } finally {
    await box.stop();
  }
});

test('a rig process that comes back at another rate ends the recording with what there is', async () => {
  const box = new Box(await freePort());
  await box.start();
  let rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const location = await record(60);
    await until('its first samples', async () => (await get(`${location}/samples`)).items.length);
    rig.kill('SIGKILL');
    await gone(rig);
    rig = startRig(`tcp://127.0.0.1:${box.port}`, '--rate-hz', '20');
    const recording = await ended(location);
    assert.equal(recording.state, 'incomplete');
    assert.equal(recording.summary.rate_hz, 50);
    assert.equal(recording.summary.expected_count, 3000);
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a second rig process on a store is refused, and the first one goes on', async () => {
  const box = new Box(await freePort());
  await box.start();
  const rig = startRig(`tcp://127.0.0.1:${box.port}`);
  try {
    await until('the connection', async () => (await get('/v1/rig')).status === 'connected');
    const second = await refusal(`tcp://127.0.0.1:${box.port}`);
    assert.equal(second.code, 1);
    assert.match(second.text, /another tightwire rig/);
    assert.equal((await get('/v1/rig')).status, 'connected');
  } finally {
    rig.kill('SIGTERM');
    await gone(rig);
    await box.stop();
  }
});

test('a serial line is set as the URL says, and read', async () => {
  for (const [settings, line, unit] of [
    ['?baud=57600&parity=odd&stop=2', '57600 2 1', 1],
    ['?baud=9600&parity=none', '9600 1 0', 247],
    ['', '115200 1 0', 17],
  ]) {
    const box = spawn(join(build, 'tests/tools/rtu_box'), [unit], { stdio: ['pipe', 'pipe', 'inherit'] });
    let out = '';
    box.stdout.on('data', (text) => (out += text));
    const path = await until('a line', () => out.includes('\n') && out.split('\n')[0]);
    const rig = startRig(`rtu:${path}${settings}`, '--unit', unit, '--rate-hz', '5');
    try {
      await until('three requests', () => out.trim().split('\n').length > 3);
      const { latest } = await until('a sample', async () => {
        const state = await get('/v1/rig');
        return state.scans > 0 && state.device === `rtu:${path}${settings}` && state;
      });
      for (let c = 0; c < 24; c++) assert.equal(latest.counts[c], (latest.counts[0] + 10 * c) % 1024);
      assert.equal(out.trim().split('\n').at(-1), line);
    } finally {
      rig.kill('SIGTERM');
      await gone(rig);
      box.stdin.end();
      await gone(box);
    }
  }
});

test('0 and 255 are the TCP device itself', async () => {
  for (const unit of [0, 255]) {
    const box = new Box(await freePort(), 255);
    await box.start();
    const rig = startRig(`tcp://127.0.0.1:${box.port}`, '--unit', unit);
    try {
      await until('the connection', async () => {
        const state = await get('/v1/rig');
        return state.device.endsWith(`:${box.port}`) && state.status === 'connected';
      });
    } finally {
      rig.kill('SIGTERM');
      await gone(rig);
      await box.stop();
    }
  }
});

async function refusal(device, ...more) {
  const child = spawn(binary, ['rig', '--device', device, '--store', store, ...more], { stdio: ['ignore', 'ignore', 'pipe'] });
  let text = '';
  child.stderr.on('data', (part) => (text += part));
  await gone(child);
  assert.equal(text.trim().split('\n').length, 1);
  return { code: child.exitCode, text };
}

test('a wrong device is refused on the command line with the reason', async () => {
  for (const device of [
    'udp://127.0.0.1:502',
    'tcp://127.0.0.1',
    'tcp://127.0.0.1:70000',
    'rtu:',
    'rtu:/dev/ttyUSB0?baud=9',
    'rtu:/dev/ttyUSB0?baud=12345',
    'rtu:/dev/ttyUSB0?parity=some',
    'rtu:/dev/ttyUSB0?data=9',
    'rtu:/dev/ttyUSB0?stop=0',
  ]) {
    const { code, text } = await refusal(device);
    assert.equal(code, 2, device);
    assert.match(text, /device must be/);
  }
});

test('a unit that no device has is refused', async () => {
  for (const [device, unit] of [
    ['tcp://127.0.0.1:502', 248],
    ['tcp://127.0.0.1:502', 254],
    ['tcp://127.0.0.1:502', 256],
    ['rtu:/dev/ttyUSB0', 0],
    ['rtu:/dev/ttyUSB0', 248],
    ['rtu:/dev/ttyUSB0', 255],
  ]) {
    const { code, text } = await refusal(device, '--unit', unit);
    assert.equal(code, 2, `${device} ${unit}`);
    assert.match(text, /unit/);
  }
});
