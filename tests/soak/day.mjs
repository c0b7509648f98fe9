// A day at a service that many share: two designers drag terminals, an MES orders, a batch lies in the queue. Who drags waits for
// no batch, no order is lost or doubled, the batch goes on; also while workers and the daemon are killed and stopped, and the
// disk is full for a while.
//   kills    ms between two attacks, on the average; 0: none
//   finish   wait for the whole batch; else what is left of it is cancelled in bulk
import assert from 'node:assert/strict';
import { randomUUID } from 'node:crypto';
import { join } from 'node:path';
import { Service, sleep, temporaryFolder, until } from '../http/service.mjs';
import { makeDisk, RESERVE } from './disk.mjs';
import { Client, isFinal, listAll, prepareLayouts, spread } from './kit.mjs';

const SQUARE = 'v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nvt 0 0\nvt 100 0\nvt 100 100\nvt 0 100\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n';
const DRAG_MS = 2000, STEP_MS = 50, REST_MS = 700, ORDER_MS = 400, FULL_MS = 1000;

export async function day(seconds, { batch = 100000, kills = 0, finish = false, workers = 2 } = {}) {
  const folder = temporaryFolder();
  const disk = kills ? makeDisk(folder.path) : { path: folder.path, remove() {} };
  const store = join(disk.path, 'store.db');
  const flags = { store: `sqlite:${store}?reserve_bytes=${RESERVE}`, workers, 'lease-s': 2, 'worker-threads': 1, 'drain-s': 2, 'log-level': 'error' };
  let service = await Service.start(flags);
  let running = true;
  const figures = {};
  const waits = {}; // of each class, in ms
  const count = (what) => (figures[what] = (figures[what] ?? 0) + 1);

  // As a careful client does it: with a key, again after a broken connection. What the service answers, it answers for good.
  class Careful {
    async insist(body, headers) {
      const key = { 'idempotency-key': randomUUID(), ...headers };
      for (;;) {
        this.client ??= new Client(service.url);
        try {
          const { status, json } = await this.client.post('/v1/layouts', body, key);
          if ([200, 202].includes(status)) return json;
          assert.ok([503, 507].includes(status), `${status} ${JSON.stringify(json)}`);
        } catch (error) {
          if (error instanceof assert.AssertionError) throw error;
          this.close();
        }
        await sleep(50);
      }
    }
    close() {
      this.client?.close();
      this.client = null;
    }
  }

  async function submitBatch(field) {
    const hrefs = [];
    let next = 0;
    const start = Date.now();
    await Promise.all(
      Array.from({ length: 16 }, async () => {
        const client = new Careful();
        while (next < batch) {
          const number = next++;
          const body = { field, terminals: [{ vertex: 0, name: `batch ${number}` }, { vertex: 2 }] };
          hrefs[number] = (await client.insist(body, { 'job-class': 'batch' })).href;
        }
        client.close();
      }),
    );
    figures['batch jobs submitted a second'] = Math.round((1000 * batch) / (Date.now() - start));
    return hrefs;
  }

  // Answers of positions that were computed, in ms; and of the last position of a drag, when the hand stops.
  async function design(layoutOf, name, answers, last) {
    let position = 0;
    while (running) {
      const drag = { supersedes: `drag-${name}`, session: name, prefer: 'wait=60, on_disconnect=cancel' };
      const sent = [];
      for (const end = Date.now() + DRAG_MS; Date.now() < end && running; await sleep(STEP_MS)) {
        const at = performance.now(), url = service.url;
        const client = new Client(url);
        const body = layoutOf(position++);
        const answer = client
          .post('/v1/layouts', body, drag)
          .then(({ json }) => {
            const ms = performance.now() - at;
            if (json.state === 'succeeded') answers.push(ms);
            assert.ok(json.state === 'succeeded' || json.state === 'cancelled' || kills || !running, JSON.stringify(json));
            return { ms, state: json.state };
          })
          .catch((error) => {
            if (error instanceof assert.AssertionError || !kills) throw error;
            return {}; // the daemon was killed
          })
          .finally(() => client.close());
        answer.catch(() => {}); // told below
        sent.push(answer);
      }
      const all = await Promise.all(sent);
      if (all.at(-1)?.state === 'succeeded') last.push(all.at(-1).ms);
      count('drags');
      await sleep(REST_MS);
    }
  }

  async function order(layoutOf, orders) {
    const client = new Careful();
    for (let number = 50000000; running; number++) {
      orders.push((await client.insist(layoutOf(number), {})).href);
      await sleep(ORDER_MS);
    }
    client.close();
  }

  async function attack() {
    while (running && kills) {
      await sleep(kills * (0.5 + Math.random()));
      if (!running) return;
      const dice = Math.random();
      if (dice < 0.2) {
        disk.fill(service, store);
        await sleep(FULL_MS);
        disk.free(service);
        count('times the disk was full');
        continue;
      }
      const [worker] = service.workers().sort(() => Math.random() - 0.5);
      if (dice < 0.55 && worker) {
        try {
          process.kill(worker, 'SIGKILL');
          count('workers killed');
        } catch {
          // It had just ended.
        }
      } else if (dice < 0.75) {
        service.process.kill('SIGKILL');
        await service.exited;
        count('daemons killed');
        service = await Service.start(flags);
      } else {
        service.process.kill('SIGTERM');
        await service.exited;
        count('daemons stopped');
        service = await Service.start(flags);
      }
    }
  }

  // How long jobs of each class waited until they were started, those that were.
  async function waitingTimes(client) {
    const jobs = (await listAll(client, '/v1/jobs?kind=compute_layout')).filter(({ started_at }) => started_at);
    for (const name of ['interactive', 'normal', 'batch']) {
      const ms = jobs.filter((job) => job.class === name).map((job) => Math.max(0, Date.parse(job.started_at) - Date.parse(job.created_at)));
      const { p50, p99, max, count } = spread(ms);
      figures[`${name}: wait p50 / p99 / max ms, started`] = `${p50} / ${p99} / ${max}, ${count}`;
      waits[name] = { p50, p99, max, count };
    }
  }

  try {
    const layoutOf = await prepareLayouts(service, folder.path);
    const wait = { prefer: 'wait=60' };
    const { json: mesh } = await service.post('/v1/meshes?name=square.obj', SQUARE, { 'content-type': 'model/obj', ...wait });
    const { json: field } = await service.post('/v1/fields', { mesh: mesh.id, motions: [] }, wait);
    assert.equal(field.state, 'succeeded', JSON.stringify(field.problem));
    const hrefs = await submitBatch(field.id);
    const orders = [], answers = [], last = [];
    const dayOver = sleep(1000 * seconds).then(() => (running = false));
    await Promise.all([
      dayOver,
      attack(),
      order(layoutOf, orders),
      design(layoutOf, 'ann', answers, last),
      design((n) => layoutOf(n + 1000000), 'ben', answers, last),
    ]);

    const client = new Client(service.url, 4);
    const atEvening = (await listAll(client, '/v1/jobs?kind=compute_layout&state=succeeded&class=batch')).length;
    figures['batch jobs done while all others worked'] = atEvening;
    assert.ok(atEvening > 0, 'the batch does not starve');
    // A job whose workers were all killed is taken for the cause; who knows better tries it anew.
    if (kills) await client.post('/v1/jobs/redrive?problem=attempts-exhausted');
    if (!finish) {
      for (let more = true; more; ) {
        const { json } = await client.post('/v1/jobs/cancel?class=batch');
        figures['batch jobs cancelled in bulk'] = (figures['batch jobs cancelled in bulk'] ?? 0) + json.cancelled;
        more = json.more;
      }
    }
    await until('all has ended', async () => (await client.get('/v1/jobs?state=queued,running&limit=1')).json.items.length === 0, 120 + batch / 20);
    await waitingTimes(client);
    for (const href of orders) {
      const { json } = await client.get(href);
      assert.equal(json.state, 'succeeded', `${href} ${JSON.stringify(json.problem)}`);
    }
    const layouts = await listAll(client, '/v1/layouts');
    assert.ok(layouts.every(({ state }) => isFinal(state)));
    const byHref = new Map(layouts.map((one) => [one.href, one]));
    assert.equal(new Set(hrefs).size, batch, 'each batch job was kept once');
    const states = {};
    for (const href of hrefs) states[byHref.get(href).state] = (states[byHref.get(href).state] ?? 0) + 1;
    assert.deepEqual(Object.keys(states).filter((state) => state !== 'succeeded' && (finish || state !== 'cancelled')), []);
    assert.equal(new Set(orders).size, orders.length, 'each order was kept once');
    client.close();
    const show = (ms) => `${Math.round(spread(ms).p50)} / ${Math.round(spread(ms).p99)} / ${Math.round(spread(ms).max)}, ${ms.length}`;
    figures['orders'] = orders.length;
    figures['a position that was computed: answer p50 / p99 / max ms, count'] = show(answers);
    figures['the last position of a drag: answer p50 / p99 / max ms, count'] = show(last);
    assert.ok(last.length > 0, 'a designer had the last answer of a drag');
    Object.defineProperty(figures, 'waits', { value: waits, enumerable: false });
    return figures;
  } finally {
    running = false;
    await service.stop();
    disk.remove();
    folder.remove();
  }
}
