// Submits, each durable when it is answered, beside workers that are busy: a client that sends 200 a second, alone and beside 32
// that send as fast as they are answered.
import assert from 'node:assert/strict';
import { Service, temporaryFolder } from '../http/service.mjs';
import { Client, prepareLayouts, Probe, spread } from './kit.mjs';

export async function load(seconds, { clients = 32, perSecond = 200 } = {}) {
  const folder = temporaryFolder();
  const service = await Service.start({ workers: 1, 'worker-threads': 1, 'log-level': 'error' });
  try {
    const layoutOf = await prepareLayouts(service, folder.path);
    let numbers = 0;
    const submit = async (client) => {
      const { status, json, ms } = await client.post('/v1/layouts', layoutOf(numbers++));
      assert.equal(status, 202, JSON.stringify(json));
      return ms;
    };
    async function paced(forMs) {
      const client = new Client(service.url, 64);
      const start = performance.now();
      const answers = [];
      for (let i = 0; (i * 1000) / perSecond < forMs; i++) {
        const due = start + (i * 1000) / perSecond;
        const early = due - performance.now();
        if (early > 1) await new Promise((done) => setTimeout(done, early));
        answers.push(submit(client));
        answers.at(-1).catch(() => {}); // told by Promise.all
      }
      const ms = spread(await Promise.all(answers));
      client.close();
      return ms;
    }
    async function flatOut(forMs) {
      const until = performance.now() + forMs;
      const counts = await Promise.all(
        Array.from({ length: clients }, async () => {
          const client = new Client(service.url);
          let count = 0;
          for (; performance.now() < until; count++) await submit(client);
          client.close();
          return count;
        }),
      );
      return counts.reduce((sum, count) => sum + count, 0) / (forMs / 1000);
    }
    const forMs = (1000 * seconds) / 3;
    const alone = await paced(forMs);
    const rate = await flatOut(forMs);
    const probe = new Probe(service.url);
    const [beside, rateBeside] = await Promise.all([paced(forMs), flatOut(forMs)]);
    const livez = await probe.stop();
    return {
      [`p99 ms at ${perSecond}/s alone`]: alone.p99,
      [`submits/s of ${clients} clients flat out`]: rate,
      [`p99 ms at ${perSecond}/s beside them`]: beside.p99,
      'submits/s of those meanwhile': rateBeside,
      '/livez p99 ms meanwhile': livez.p99,
    };
  } finally {
    await service.stop();
    folder.remove();
  }
}
