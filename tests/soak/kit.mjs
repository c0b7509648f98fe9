// What the attacks share: a client that keeps its connections, a probe, figures, a small garment with its field.
import { Agent, request as httpRequest } from 'node:http';
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { Worker } from 'node:worker_threads';
import { run, until } from '../http/service.mjs';

export const digits = (number) => String(number).padStart(8, '0');

export const quantile = (values, share) =>
  values.length ? [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(share * values.length))] : NaN;

export const spread = (ms) => ({
  p50: quantile(ms, 0.5),
  p99: quantile(ms, 0.99),
  max: ms.length ? Math.max(...ms) : NaN,
  count: ms.length,
});

export class Probe {
  constructor(url, { everyMs = 20, giveUpMs = 10000 } = {}) {
    this.worker = new Worker(new URL('./probe.mjs', import.meta.url), { workerData: { url, everyMs, giveUpMs } });
  }
  turnTo(url) {
    this.worker.postMessage({ url });
  }
  async stop() {
    const taken = new Promise((done) => this.worker.once('message', done));
    this.worker.postMessage({});
    return spread(await taken);
  }
}

// Keeps up to `connections` open. A request's answer is {status, json, ms}; what breaks the connection is thrown.
export class Client {
  constructor(url, connections = 1) {
    this.url = url;
    this.agent = new Agent({ keepAlive: true, maxSockets: connections });
  }
  request(method, path, { body, headers = {} } = {}) {
    const start = performance.now();
    const bytes = body === undefined ? undefined : Buffer.isBuffer(body) ? body : JSON.stringify(body);
    if (bytes !== undefined && !Buffer.isBuffer(body)) headers = { 'content-type': 'application/json', ...headers };
    return new Promise((done, fail) => {
      const asked = httpRequest(
        this.url + path,
        { method, agent: this.agent, headers: bytes === undefined ? headers : { ...headers, 'content-length': Buffer.byteLength(bytes) } },
        (answer) => {
          const parts = [];
          answer.on('data', (part) => parts.push(part));
          answer.on('error', fail);
          answer.on('end', () => {
            const all = Buffer.concat(parts);
            const isJson = /json/.test(answer.headers['content-type'] ?? '');
            done({ status: answer.statusCode, bytes: all, json: isJson ? JSON.parse(all) : undefined, ms: performance.now() - start });
          });
        },
      );
      asked.on('error', fail);
      asked.end(bytes);
    });
  }
  get = (path, headers) => this.request('GET', path, { headers });
  post = (path, body, headers) => this.request('POST', path, { body, headers });
  close() {
    this.agent.destroy();
  }
}

// A garment, two motions and their field in a running service, and requests for layouts that differ by the name of one
// terminal only: eight digits of the number that is given.
export async function prepareLayouts(service, folder) {
  const suit = (...parts) => join(folder, 'suit', ...parts);
  run('sample', '--out', suit(), '--vertices', '2500');
  const wait = { prefer: 'wait=60' };
  const post = async (path, body, type) => {
    const { json, status } = await service.post(path, body, { 'content-type': type, ...wait });
    if (json.state !== 'succeeded') throw new Error(`${path} answered ${status} ${JSON.stringify(json)}`);
    return json;
  };
  const mesh = await post('/v1/meshes?name=soak.obj', readFileSync(suit('suit.obj')), 'model/obj');
  const motions = [];
  for (const name of readdirSync(suit('motions')).slice(0, 2))
    motions.push((await post(`/v1/meshes/${mesh.id}/motions?name=${name}`, readFileSync(suit('motions', name)), 'application/octet-stream')).id);
  const field = await post('/v1/fields', JSON.stringify({ mesh: mesh.id, motions }), 'application/json');
  const set = readdirSync(suit('terminals')).find((name) => name.includes('10'));
  const terminals = JSON.parse(readFileSync(suit('terminals', set))).terminals.slice(0, 4);
  return (number) => ({ field: field.id, terminals: [{ ...terminals[0], name: digits(number) }, ...terminals.slice(1)] });
}

// Every resource of a list, page by page.
export async function listAll(client, path) {
  const items = [];
  for (let next = `${path}${path.includes('?') ? '&' : '?'}limit=1000`; next; ) {
    const { json } = await client.get(next);
    items.push(...json.items);
    next = json.next && (json.next.startsWith('/') ? json.next : `${path}?limit=1000&cursor=${json.next}`);
  }
  return items;
}

export const isFinal = (state) => ['succeeded', 'failed', 'cancelled', 'incomplete'].includes(state);

export async function allEnded(client, hrefs, seconds) {
  const left = new Set(hrefs);
  const ended = new Map();
  await until(
    `${left.size} jobs have ended`,
    async () => {
      for (const href of [...left].slice(0, 200)) {
        const { json } = await client.get(href);
        if (!isFinal(json.state)) return false;
        ended.set(href, json);
        left.delete(href);
      }
      return left.size === 0;
    },
    seconds,
  );
  return ended;
}
