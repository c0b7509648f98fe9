// The disk becomes full while jobs wait. Nothing that was accepted is given up, new requests get 507, /livez answers; when space
// comes back, work goes on by itself. A small tmpfs where this may mount one; else a limit on the size of files (RLIMIT_FSIZE),
// which looks the same to who writes, and can be raised again.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { closeSync, mkdirSync, openSync, rmSync, statSync, writeSync } from 'node:fs';
import { join } from 'node:path';
import { childrenOf, Service, sleep, temporaryFolder, until } from '../http/service.mjs';
import { allEnded, Client, listAll, prepareLayouts, Probe } from './kit.mjs';

export const RESERVE = 4 << 20;

// A disk of 96 MiB that is filled by a file.
class SmallDisk {
  constructor(folder) {
    this.path = join(folder, 'disk');
    mkdirSync(this.path);
    execFileSync('mount', ['-t', 'tmpfs', '-o', 'size=96m', 'tmpfs', this.path], { stdio: 'ignore' });
  }
  name = 'tmpfs';
  fill() {
    const file = openSync(join(this.path, 'filler'), 'w');
    const block = Buffer.alloc(1 << 16);
    try {
      for (;;) writeSync(file, block);
    } catch (error) {
      assert.equal(error.code, 'ENOSPC');
    } finally {
      closeSync(file);
    }
  }
  free() {
    rmSync(join(this.path, 'filler'));
  }
  remove() {
    spawnSync('umount', ['-l', this.path]);
  }
}

// Files may not grow beyond what the store has now.
class SizeLimit {
  constructor(folder) {
    this.path = folder;
  }
  name = 'RLIMIT_FSIZE';
  set(service, bytes) {
    for (const pid of [service.process.pid, ...childrenOf(service.process.pid)])
      execFileSync('prlimit', ['--pid', String(pid), `--fsize=${bytes}:unlimited`]);
  }
  fill(service, store) {
    this.set(service, Math.max(...['', '-wal'].map((end) => statSync(store + end, { throwIfNoEntry: false })?.size ?? 0)));
  }
  free(service) {
    this.set(service, 'unlimited');
  }
  remove() {}
}

export function makeDisk(folder) {
  try {
    return new SmallDisk(folder);
  } catch {
    return new SizeLimit(folder);
  }
}

export async function disk(seconds, { jobs = 60 } = {}) {
  const folder = temporaryFolder();
  const place = makeDisk(folder.path);
  const store = join(place.path, 'store.db');
  let service, probe;
  try {
    service = await Service.start({ store: `sqlite:${store}?reserve_bytes=${RESERVE}`, workers: 1, 'worker-threads': 1, 'log-level': 'error' });
    const layoutOf = await prepareLayouts(service, folder.path);
    const client = new Client(service.url, 4);
    const accepted = [];
    for (let i = 0; i < jobs; i++) {
      const { status, json } = await client.post('/v1/layouts', layoutOf(i));
      assert.equal(status, 202);
      accepted.push(json.href);
    }
    probe = new Probe(service.url);
    place.fill(service, store);
    let refused = 0;
    const end = Date.now() + 1000 * seconds;
    for (let i = 0; Date.now() < end; i++) {
      const { status, json } = await client.post('/v1/layouts', layoutOf(jobs + i));
      if (status === 202) accepted.push(json.href);
      else assert.equal(status, 507, JSON.stringify(json));
      refused += status === 507;
      await sleep(200);
    }
    assert.ok(refused > 0, 'a full disk is told');
    const burnt = (await listAll(client, '/v1/jobs?kind=compute_layout')).filter(({ state }) => state === 'failed');
    assert.deepEqual(burnt.map(({ failure, problem }) => (problem ?? failure)?.type), [], 'no job fails because the disk is full');
    place.free(service);
    const freed = Date.now();
    const layouts = () => client.get('/v1/jobs?kind=compute_layout&state=succeeded&limit=1000');
    const before = (await layouts()).json.items.length;
    await until('work goes on', async () => (await layouts()).json.items.length > before, 60);
    const first = (Date.now() - freed) / 1000;
    const ended = await allEnded(client, accepted, 120 + accepted.length);
    for (const [href, { state, problem }] of ended) assert.equal(state, 'succeeded', `${href} ${JSON.stringify(problem)}`);
    const livez = await probe.stop();
    probe = undefined;
    client.close();
    return {
      'full by': place.name,
      'jobs accepted': accepted.length,
      'jobs that ended well': ended.size,
      'requests refused with 507': refused,
      'seconds from space to the next result': first,
      '/livez p99 ms': livez.p99,
      '/livez max ms': livez.max,
    };
  } finally {
    await probe?.stop();
    await service?.stop();
    place.remove();
    folder.remove();
  }
}
