// The daemon as a process: settings, keys, workers that die, clients that dawdle, memory, and its own end.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { connect } from 'node:net';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { Service, run, sleep, temporaryFolder, tightwire, until } from './service.mjs';

async function withService(flags, claim, environment) {
  const service = await Service.start(flags, environment);
  try {
    await claim(service);
  } finally {
    await service.stop();
  }
}

const serve = (...flags) => spawnSync(tightwire, ['serve', ...flags], { encoding: 'utf8', timeout: 10000 });

test('it refuses to listen beyond this machine without a key file', () => {
  for (const listen of ['0.0.0.0:0', '[::]:0', ':0']) {
    const { status, stderr } = serve('--listen', listen, '--store', 'sqlite::memory:');
    assert.equal(status, 1, listen);
    assert.match(stderr, /can be reached from other machines; make a key with tightwire key create, give --key-file/);
    assert.equal(stderr.trim().split('\n').length, 1);
  }
});

test('a port that no socket has is refused, not another one taken', () => {
  for (const listen of ['localhost:99999', '127.0.0.1:65536', '[::1]:4294967376', 'localhost:']) {
    const { status, stderr } = serve('--listen', listen, '--store', 'sqlite::memory:');
    assert.equal(status, 1, listen);
    assert.match(stderr, /is no address; write HOST:PORT/);
  }
});

test('every command explains itself, and refuses what it does not know with one line', () => {
  const usage = spawnSync(tightwire, ['--help'], { encoding: 'utf8' }).stdout;
  const commands = [...usage.matchAll(/^ {2}(\w+) /gm)].map(([, name]) => name);
  assert.ok(commands.length >= 10);
  for (const command of commands) {
    const help = spawnSync(tightwire, [command, '--help'], { encoding: 'utf8' });
    assert.equal(help.status, 0, command);
    assert.match(help.stdout, new RegExp(`^usage: tightwire ${command} `));
    if (!['key', 'serve'].includes(command))
      assert.equal(spawnSync(tightwire, [command, '-h'], { encoding: 'utf8' }).stdout, help.stdout);
    const wrong = spawnSync(tightwire, [command, '--nonsense'], { encoding: 'utf8' });
    assert.equal(wrong.status, 2, command);
    assert.equal(wrong.stdout, '');
    assert.equal(wrong.stderr.trim().split('\n').length, 1, wrong.stderr);
  }
});

test('a flag that is given twice, a folder that cannot be written and a bad pattern are named before any work', () => {
  const folder = temporaryFolder();
  const at = (name) => join(folder.path, name);
  writeFileSync(at('worn.obj'), 'v 0 0 0\nv 900 0 0\nv 0 900 0\nvt 0 0\nvt 900 0\nvt 0 900\nf 1/1 2/2 3/3\n');
  writeFileSync(at('flat.obj'), 'v 0 zero 0\n');
  const field = (...more) => spawnSync(tightwire, ['field', '--worn', at('worn.obj'), ...more], { encoding: 'utf8' });
  for (const [run, status, words] of [
    [field('--out', at('a'), '--out', at('b')), 2, /--out is given twice/],
    [field('--out', at('a'), '--eta-mpa=1', '--eta_mpa', '2'), 2, /--eta.mpa is given twice/],
    [field('--out', at('a'), '--motion', 'x.pc2', '--motion=x.pc2'), 2, /--motion: x\.pc2 is given twice/],
    [field('--out', at('a'), '--json', 'false'), 2, /--json=false/],
    [field('--out', at('a'), '--pattern', at('flat.obj')), 1, /flat\.obj: line 1: /],
    [field('--out', at('worn.obj'), '--motion', 'none.pc2'), 1, /worn\.obj: cannot write into it: Not a directory/],
    [field('--out', at('a')), 0, /^warning: no motion shapes this field/],
  ]) {
    assert.equal(run.status, status, run.stderr);
    assert.match(run.stderr, words);
    assert.equal(run.stderr.trim().split('\n').length, 1, run.stderr);
  }
  folder.remove();
});

const hasTerminals = spawnSync('script', ['--version']).status === 0;
test('progress is shown on a terminal, and nowhere else', { skip: !hasTerminals }, () => {
  const folder = temporaryFolder();
  const sample = `${tightwire} sample --out suit --vertices 3000`;
  const field = `${tightwire} field --worn suit/suit.obj --motion suit/motions/walk.pc2 --out field`;
  const command = `cd ${folder.path} && ${sample} && ${field}`;
  const plain = spawnSync('sh', ['-c', command], { encoding: 'utf8' });
  assert.equal(plain.status, 0);
  assert.equal(plain.stderr, '');
  const shown = spawnSync('script', ['-qec', command, '/dev/null'], { encoding: 'utf8' });
  assert.match(shown.stdout, /\r\x1b\[Kreading .*suit\.obj/);
  folder.remove();
});

test('wrong settings are a usage error that names its place', () => {
  const folder = temporaryFolder();
  const file = join(folder.path, 'conf');
  writeFileSync(file, '# a comment\n\nworkers = 2\nwrokers = 3\n');
  for (const [flags, words] of [
    [['--wrokers', '3'], /no flag "--wrokers"; did you mean --workers\? There are: --listen, /],
    [['--wrokers=3'], /no flag "--wrokers"; did you mean --workers\?/],
    [['--config', folder.path], /cannot be read: Is a directory/],
    [['--workers'], /--workers: the flag needs a value/],
    [['--workers=many'], /workers is an integer from 0 to 256/],
    [['--log-level', 'loud'], /log-level is one of error\|warning\|info\|debug/],
    [['--config', file], /line 4: no setting "wrokers"; did you mean workers\?/],
    [['--config', '/does/not/exist'], /cannot be read/],
  ]) {
    const { status, stderr } = serve(...flags);
    assert.equal(status, 2, flags.join(' '));
    assert.match(stderr, words);
  }
  folder.remove();
});

test('a port that is taken, and a store that is none, are failures with one line', async () => {
  await withService({}, (service) => {
    const { status, stderr } = serve('--listen', service.url.slice(7), '--store', service.store);
    assert.equal(status, 1);
    assert.match(stderr, /cannot listen/);
  });
  const { status, stderr } = serve('--listen', '127.0.0.1:0', '--store', 'sqlite:/does/not/exist/store.db');
  assert.equal(status, 1);
  assert.equal(stderr.trim().split('\n').length, 1);
});

test('a flag goes before the environment, that before the file, that before the default', async () => {
  const folder = temporaryFolder();
  const file = join(folder.path, 'conf');
  writeFileSync(file, 'wait-limit-s = 2\nupload-limit-mib = 2\nidle-timeout-s = 2\n');
  const limit = async (service) => {
    const { headers } = await service.post('/v1/rig/recordings', { name: 'x' }, { prefer: 'wait=9' });
    return headers.get('preference-applied');
  };
  await withService({ config: file }, async (service) => assert.equal(await limit(service), 'wait=2'));
  await withService({ config: file }, async (service) => assert.equal(await limit(service), 'wait=1'), {
    TIGHTWIRE_WAIT_LIMIT_S: '1',
  });
  await withService({ config: file, 'wait-limit-s': 0 }, async (service) => assert.equal(await limit(service), null), {
    TIGHTWIRE_WAIT_LIMIT_S: '1',
  });
  folder.remove();
});

test('help lists every setting', () => {
  const help = run('serve', '--help');
  for (const name of ['listen', 'store', 'workers', 'config', 'key-file', 'upload-limit-mib', 'drain-s'])
    assert.ok(help.includes(`--${name}`), name);
});

test('the sample configuration names every setting with its default', async () => {
  const text = readFileSync(new URL('../../deploy/tightwire.conf', import.meta.url), 'utf8');
  const named = Object.fromEntries([...text.matchAll(/^#?([a-z-]+) = ?(.*)$/gm)].map((match) => match.slice(1)));
  const help = [...run('serve', '--help').matchAll(/^ {2}--(\S+) .*default (.*?)(?:; reloads)?\)$/gm)].map((match) => match.slice(1));
  assert.deepEqual(Object.keys(named).sort(), help.map(([name]) => name).sort());
  for (const [name, fallback] of help)
    if (!['store', 'key-file'].includes(name)) assert.equal(named[name] || 'none', fallback, name);
  const folder = temporaryFolder();
  const file = join(folder.path, 'tightwire.conf');
  writeFileSync(file, text);
  await withService({ config: file }, async (service) => assert.equal((await service.get('/livez')).status, 200));
  folder.remove();
});

test('with a key file only its keys are let in, save to what must be open', async () => {
  const folder = temporaryFolder();
  const file = join(folder.path, 'keys');
  const made = spawnSync(tightwire, ['key', 'studio'], { encoding: 'utf8' });
  const key = made.stderr.trim();
  assert.match(made.stdout, /^studio [0-9a-f]{64}\n$/);
  assert.ok(!made.stdout.includes(key));
  writeFileSync(file, made.stdout, { mode: 0o600 });
  await withService({ listen: '0.0.0.0:0', 'key-file': file }, async (service) => {
    service.url = service.url.replace('0.0.0.0', '127.0.0.1');
    for (const headers of [
      {},
      { authorization: `Bearer ${key}x` },
      { authorization: `Basic ${key}` },
      { authorization: 'Bearer' },
    ]) {
      const answer = await service.get('/v1/jobs', { headers });
      assert.equal(answer.status, 401);
      assert.equal(answer.json.type, 'urn:tightwire:problem:unauthorized');
      assert.match(answer.headers.get('www-authenticate'), /^Bearer/);
    }
    assert.equal((await service.get('/v1/jobs', { headers: { authorization: `Bearer ${key}` } })).status, 200);
    for (const path of ['/livez', '/readyz', '/openapi.yaml']) assert.equal((await service.get(path)).status, 200);
    assert.equal((await service.get('/metrics')).status, 401);
  });
  writeFileSync(file, 'studio nothex\n');
  assert.match(
    serve('--key-file', file, '--store', `sqlite:${folder.path}/s.db`, '--listen', '127.0.0.1:0').stderr,
    /\/keys, line 1: /,
  );
  folder.remove();
});

test('a worker that is killed is replaced, and again, after pauses', async () => {
  await withService({ workers: 2 }, async (service) => {
    for (let round = 0; round < 3; round++) {
      const before = await until('two workers', () => service.workers().length === 2 && service.workers());
      process.kill(before[0], 'SIGKILL');
      await until('a new worker', () => service.workers().length === 2 && !service.workers().includes(before[0]));
    }
    assert.match(service.log, /worker-ended pid=\d+ signal=9/);
    await until('the figures say so', async () => {
      const { text } = await service.get('/metrics');
      return /tightwire_worker_restarts_total 3\n/.test(text) && /tightwire_workers 2\n/.test(text);
    });
  });
});

test('workers that die at once do not make the daemon spin', async () => {
  await withService({ workers: 1 }, async (service) => {
    for (const end = Date.now() + 1500; Date.now() < end; await sleep(5))
      service.workers().forEach((pid) => process.kill(pid, 'SIGKILL'));
    const starts = service.log.match(/worker-started/g).length;
    assert.ok(starts >= 2 && starts <= 6, `${starts} starts`);
    assert.equal((await service.get('/livez')).status, 200);
  });
});

test('workers end when their daemon is killed', async () => {
  await withService({ workers: 2 }, async (service) => {
    const workers = await until('two workers', () => service.workers().length === 2 && service.workers());
    await sleep(200);
    service.process.kill('SIGKILL');
    const lives = (pid) => {
      try {
        return process.kill(pid, 0);
      } catch {
        return false;
      }
    };
    await until('both are gone', () => !workers.some(lives), 10);
  });
});

test('SIGTERM drains: held requests are answered, workers end, exit code 0', async () => {
  const service = await Service.start({ workers: 2 });
  const held = service.post('/v1/rig/recordings', { name: 'held' }, { prefer: 'wait=30' });
  const watched = service.get(
    (await service.post('/v1/rig/recordings', { name: 'watched' })).json.job.id.replace(/^/, '/v1/jobs/') + '/events',
  );
  await sleep(300);
  const workers = service.workers();
  const start = Date.now();
  const end = service.stop();
  const answer = await held;
  assert.equal(answer.status, 202);
  assert.equal(answer.headers.get('connection'), 'close');
  assert.match((await watched).text, /event: job/);
  assert.deepEqual(await end, { code: 0, signal: null });
  assert.ok(Date.now() - start < 5000);
  for (const pid of workers) assert.throws(() => process.kill(pid, 0));
  await assert.rejects(fetch(service.url + '/livez'));
});

test('SIGHUP reads keys and settings again, and takes nothing of what is wrong', async () => {
  const folder = temporaryFolder();
  const [keys, conf] = [join(folder.path, 'keys'), join(folder.path, 'conf')];
  const makeKey = (name) => {
    const { stdout, stderr } = spawnSync(tightwire, ['key', name], { encoding: 'utf8' });
    return { line: stdout, bearer: { authorization: `Bearer ${stderr.trim()}` } };
  };
  const [first, second] = [makeKey('first'), makeKey('second')];
  const settings = (more) => writeFileSync(conf, `key-file = ${keys}\nlog-level = warning\n${more}`);
  writeFileSync(keys, first.line, { mode: 0o600 });
  settings('wait-limit-s = 1\n');
  await withService({ config: conf }, async (service) => {
    const reload = async (words) => {
      const before = service.log.length;
      service.process.kill('SIGHUP');
      await until('it has read them again', () => words.test(service.log.slice(before)));
    };
    const jobs = async (key) => (await service.get('/v1/jobs', { headers: key.bearer })).status;
    assert.equal(await jobs(first), 200);
    assert.equal(await jobs(second), 401);
    writeFileSync(keys, second.line);
    settings('wait-limit-s = 0\nlog-level = info\nhttp-threads = 7\n');
    service.process.kill('SIGHUP');
    await until('the second key is in', async () => (await jobs(second)) === 200);
    assert.equal(await jobs(first), 401);
    const held = await service.post('/v1/rig/recordings', {}, { prefer: 'wait=5', ...second.bearer });
    assert.equal(held.headers.get('preference-applied'), null);
    await reload(/ reloaded restart_for="http-threads"/);
    assert.equal(service.workers().length, 0);
    writeFileSync(keys, 'no key\n');
    await reload(/ error reload .*line 1/);
    assert.equal(await jobs(second), 200);
    writeFileSync(keys, second.line);
    settings('wrokers = 1\n');
    await reload(/ error reload .*did you mean workers/);
    assert.equal(await jobs(second), 200);
  });
  folder.remove();
});

test('a shell that ignores signals passes nothing of it on', async () => {
  const service = await Service.start({ workers: 1 }, {}, 'CHLD HUP TERM INT');
  const [before] = await until('a worker', () => service.workers().length && service.workers());
  process.kill(before, 'SIGKILL');
  await until('another worker', () => service.workers().some((pid) => pid !== before));
  assert.match(service.log, /worker-ended pid=\d+ signal=9/);
  const [worker] = service.workers();
  service.process.kill('SIGHUP');
  await until('it has read its settings', () => / reloaded /.test(service.log));
  assert.equal(service.workers()[0], worker);
  process.kill(worker, 'SIGHUP'); // of a terminal that closes: the daemon's business
  await sleep(200);
  assert.equal(service.workers()[0], worker);
  assert.deepEqual(await service.stop(), { code: 0, signal: null });
});

test('a client that sends its head byte by byte is cut off, and idle connections too', async () => {
  await withService({ 'idle-timeout-s': 1, 'head-timeout-s': 2, connections: 16 }, async (service) => {
    const port = Number(new URL(service.url).port);
    const closed = [];
    const drip = Array.from({ length: 12 }, (_, i) => {
      const socket = connect(port, '127.0.0.1');
      socket.on('error', () => {});
      closed.push(new Promise((done) => socket.on('close', done)));
      if (i % 2) socket.write('GET /livez HTTP/1.1\r\nHost: localhost\r\nX-Slow: ');
      const timer = i % 2 && setInterval(() => socket.write('y'), 100);
      socket.on('close', () => clearInterval(timer));
      return socket;
    });
    const start = Date.now();
    await Promise.all(closed);
    assert.ok(Date.now() - start < 6000);
    assert.equal((await service.get('/livez')).status, 200);
    drip.forEach((socket) => socket.destroy());
  });
});

test('more connections than the limit wait, and are served when others leave', async () => {
  await withService({ connections: 8, 'idle-timeout-s': 1 }, async (service) => {
    const port = Number(new URL(service.url).port);
    const idle = Array.from({ length: 20 }, () => connect(port, '127.0.0.1').on('error', () => {}));
    assert.equal((await service.get('/livez')).status, 200);
    idle.forEach((socket) => socket.destroy());
  });
});

test('a thousand connections are held, also where a shell allows fewer files', async () => {
  await withService({ 'connections-per-address': 1024 }, async (service) => {
    const limits = readFileSync(`/proc/${service.process.pid}/limits`, 'utf8');
    assert.ok(Number(limits.match(/Max open files +(\d+)/)[1]) >= 1024 + 256);
    const port = Number(new URL(service.url).port);
    const idle = Array.from({ length: 900 }, () => connect(port, '127.0.0.1').on('error', () => {}));
    await until('all are there', async () => {
      const { text } = await service.get('/metrics');
      return Number(text.match(/^tightwire_http_connections (\d+)/m)[1]) > 900;
    });
    idle.forEach((socket) => socket.destroy());
  });
});

// Instrumented builds keep what was freed, so their size says nothing.
const isInstrumented = /sanitize|thread/.test(tightwire);
test('a large upload does not make the daemon grow', { skip: isInstrumented }, async () => {
  await withService({ workers: 0 }, async (service) => {
    await service.get('/v1/meshes');
    const before = service.residentBytes();
    let most = 0;
    const line = Buffer.from('v 0.123456 0.654321 0.111111\n'.repeat(40000));
    let left = Math.ceil((150 << 20) / line.length);
    const body = new ReadableStream({
      pull(controller) {
        most = Math.max(most, service.residentBytes());
        left-- > 0 ? controller.enqueue(line) : controller.close();
      },
    });
    const answer = await service.post(
      '/v1/meshes?name=big.obj',
      body,
      { 'content-type': 'model/obj' },
      { duplex: 'half' },
    );
    assert.equal(answer.status, 202);
    most = Math.max(most, service.residentBytes());
    assert.ok(most - before < 32 << 20, `grew by ${(most - before) >> 20} MiB`);
    const { json } = await service.get(answer.json.href);
    assert.equal(json.uploads[0].size_bytes, Math.ceil((150 << 20) / line.length) * line.length);
  });
});

test('a motion larger than any process may become goes through upload, strain and packing', { skip: isInstrumented }, async () => {
  const limit = 64 << 20, size = 2 * limit;
  const folder = temporaryFolder();
  run('sample', '--out', folder.path, '--vertices', '3000');
  const walk = readFileSync(join(folder.path, 'motions', 'walk.pc2'));
  const frames = walk.subarray(32), points = walk.readInt32LE(16);
  const rounds = Math.ceil(size / frames.length);
  const header = Buffer.from(walk.subarray(0, 32));
  header.writeInt32LE(rounds * walk.readInt32LE(28), 28);
  await withService({ workers: 1 }, async (service) => {
    const suit = readFileSync(join(folder.path, 'suit.obj'));
    const mesh = (await service.post('/v1/meshes?name=suit.obj', suit, { 'content-type': 'model/obj', prefer: 'wait=30' })).json;
    let left = rounds;
    const body = new ReadableStream({
      start: (controller) => controller.enqueue(header),
      pull: (controller) => (left-- > 0 ? controller.enqueue(frames) : controller.close()),
    });
    const type = { 'content-type': 'application/octet-stream' };
    const { json } = await service.post(`/v1/meshes/${mesh.id}/motions?name=long`, body, type, { duplex: 'half' });
    const motion = await service.finished(json.href);
    assert.equal(motion.state, 'succeeded', JSON.stringify(motion.problem));
    assert.equal(motion.summary.frames, header.readInt32LE(28));
    assert.equal(motion.summary.points, points);
    assert.ok(motion.uploads[0].size_bytes < size / 3, 'the frames are packed');
    for (const pid of [service.process.pid, ...service.workers()]) {
      const peak = service.peakBytes(pid);
      assert.ok(peak < limit, `${pid} took ${peak >> 20} MiB`);
    }
  });
  folder.remove();
});

test('uploads that break off, early or late, leave nothing behind', async () => {
  await withService({}, async (service) => {
    for (let i = 0; i < 20; i++) {
      const socket = connect(Number(new URL(service.url).port), '127.0.0.1').on('error', () => {});
      socket.write('POST /v1/meshes HTTP/1.1\r\nHost: localhost\r\nContent-Type: model/obj\r\nContent-Length: 5000000\r\n\r\n');
      socket.write(Buffer.alloc(3000000, 'v'));
      await sleep([200, 20, 5, 0][i % 4]);
      socket.destroy();
    }
    // Long before the idle timeout; the one connection is that of the question.
    await until(
      'only we are connected',
      async () => (await service.get('/metrics')).text.includes('tightwire_http_connections 1\n'),
      10,
    );
    assert.match(service.log, /aborted=true/);
    assert.deepEqual((await service.get('/v1/meshes')).json.items, []);
    assert.equal((await service.get('/readyz')).status, 200);
  });
});

test('a full store is 507, and the service goes on', async () => {
  const folder = temporaryFolder();
  await withService({ store: `sqlite:${folder.path}/small.db?limit_bytes=3000000` }, async (service) => {
    const answer = await service.post('/v1/meshes?name=a.obj', Buffer.alloc(8 << 20, 'v 1 2 3\n'), {
      'content-type': 'model/obj',
    });
    assert.equal(answer.status, 507);
    assert.equal(answer.json.type, 'urn:tightwire:problem:store-full');
    assert.deepEqual((await service.get('/v1/meshes')).json.items, []);
    assert.equal(
      (await service.post('/v1/meshes?name=a.obj', 'v 1 2 3\n', { 'content-type': 'model/obj' })).status,
      202,
    );
  });
  folder.remove();
});
