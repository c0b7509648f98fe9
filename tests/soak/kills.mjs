// Workers and the daemon are killed at random while clients submit, each as a careful client does: with an idempotency key,
// again after a broken connection. What was acknowledged ends, once, with the same bytes as ever.
import assert from 'node:assert/strict';
import { createHash, randomUUID } from 'node:crypto';
import { join } from 'node:path';
import { Service, sleep, temporaryFolder } from '../http/service.mjs';
import { allEnded, Client, digits, isFinal, listAll, prepareLayouts } from './kit.mjs';

export async function kills(seconds, { clients = 4, everyMs = 700, inFlight = 40 } = {}) {
  const folder = temporaryFolder();
  const flags = { store: `sqlite:${join(folder.path, 'store.db')}`, workers: 2, 'lease-s': 2, 'worker-threads': 1, 'log-level': 'error' };
  let service = await Service.start(flags);
  const figures = { 'workers killed': 0, 'daemons killed': 0, 'layouts acknowledged': 0, 'submits repeated': 0 };
  const acknowledged = new Map(); // number -> href
  let numbers = 0;
  let running = true;
  try {
    const layoutOf = await prepareLayouts(service, folder.path);
    const until = Date.now() + 1000 * seconds;

    async function submit() {
      while (running) {
        const number = numbers++;
        const key = randomUUID();
        for (let tries = 0; ; tries++) {
          const client = new Client(service.url);
          try {
            const { status, json } = await client.post('/v1/layouts', layoutOf(number), { 'idempotency-key': key });
            assert.ok([200, 202].includes(status), `${status} ${JSON.stringify(json)}`);
            acknowledged.set(number, json.href);
            break;
          } catch (error) {
            if (error instanceof assert.AssertionError) throw error;
            figures['submits repeated']++;
            await sleep(50);
          } finally {
            client.close();
          }
        }
        // No more than what two workers can do in the end.
        while (running && acknowledged.size - endedCount > inFlight) await sleep(20);
      }
    }
    let endedCount = 0;
    async function watch() {
      while (running) {
        const client = new Client(service.url);
        try {
          const { json } = await client.get('/v1/jobs?kind=compute_layout&state=succeeded&limit=1000');
          endedCount = Math.max(endedCount, json.items.length);
        } catch {
          // The daemon is being killed.
        } finally {
          client.close();
        }
        await sleep(100);
      }
    }
    async function kill() {
      while (Date.now() < until) {
        await sleep(everyMs * (0.5 + Math.random()));
        if (Math.random() < 0.6) {
          const workers = service.workers();
          if (!workers.length) continue;
          try {
            process.kill(workers[Math.floor(Math.random() * workers.length)], 'SIGKILL');
            figures['workers killed']++;
          } catch {
            // It had just ended.
          }
        } else {
          service.process.kill('SIGKILL');
          await service.exited;
          service.folder.remove();
          figures['daemons killed']++;
          service = await Service.start(flags);
        }
      }
      running = false;
    }
    await Promise.all([kill(), watch(), ...Array.from({ length: clients }, submit)]);

    figures['layouts acknowledged'] = acknowledged.size;
    const client = new Client(service.url, 4);
    const start = Date.now();
    let ended = await allEnded(client, acknowledged.values(), 120 + acknowledged.size);
    // A job whose workers die again and again is taken for the cause, and ends; who knows better tries it anew.
    const exhausted = [...ended.values()].filter(({ problem }) => problem?.type === 'urn:tightwire:problem:attempts-exhausted');
    assert.ok(exhausted.length * 3 <= figures['workers killed'], `${exhausted.length} jobs given up`);
    figures['jobs redriven whose workers were all killed'] = exhausted.length;
    for (const { job } of exhausted) assert.equal((await client.post(`/v1/jobs/${job.id}/redrive`)).status, 200);
    ended = await allEnded(client, acknowledged.values(), 120 + acknowledged.size);
    figures['seconds until all had ended'] = (Date.now() - start) / 1000;
    const lost = [...ended.values()].filter(({ state }) => state !== 'succeeded');
    assert.deepEqual(lost.map(({ href, state, problem }) => [href, state, problem]), [], 'what was acknowledged succeeds');
    const all = await listAll(client, '/v1/layouts');
    assert.equal(all.length, acknowledged.size, 'each was kept once');
    assert.ok(all.every(({ state }) => isFinal(state)));
    const drawings = new Set();
    for (const [number, href] of [...acknowledged].slice(0, 50)) {
      const drawing = String((await client.get(`${href}/pattern.svg`)).bytes).replaceAll(digits(number), digits(0));
      drawings.add(createHash('sha256').update(drawing).digest('hex'));
    }
    assert.equal(drawings.size, 1, 'equal requests have equal drawings, whoever was killed');
    client.close();
    assert.ok(figures['workers killed'] + figures['daemons killed'] > 0 && acknowledged.size > 0);
    return figures;
  } finally {
    running = false;
    await service.stop();
    folder.remove();
  }
}
