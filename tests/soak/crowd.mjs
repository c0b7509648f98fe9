// Clients that cost: those that trickle a body without a key, and those that ask to be held and go away. They come from
// 127.0.0.2, /livez is asked from 127.0.0.1, so that a limit for each address is not what is measured.
import { spawnSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { connect } from 'node:net';
import { join } from 'node:path';
import { Service, sleep, temporaryFolder, tightwire } from '../http/service.mjs';
import { Client, Probe } from './kit.mjs';

function dial(url, onEnd) {
  const { hostname, port } = new URL(url);
  const socket = connect({ host: hostname, port, localAddress: '127.0.0.2' });
  socket.on('error', () => {});
  socket.on('close', onEnd);
  socket.resume();
  return socket;
}

async function withKeys(use) {
  const folder = temporaryFolder();
  const made = spawnSync(tightwire, ['key', 'studio'], { encoding: 'utf8' });
  writeFileSync(join(folder.path, 'keys'), made.stdout, { mode: 0o600 });
  const service = await Service.start({ 'key-file': join(folder.path, 'keys'), workers: 0, 'log-level': 'error' });
  try {
    return await use(service);
  } finally {
    await service.stop();
    folder.remove();
  }
}

export const tricklers = (seconds, { clients = 1040 } = {}) =>
  withKeys(async (service) => {
    const figures = { clients, 'connections made': 0, 'connections cut off': 0 };
    const sockets = new Set();
    let running = true;
    const open = () => {
      figures['connections made']++;
      const socket = dial(service.url, () => {
        sockets.delete(socket);
        if (!running) return;
        figures['connections cut off']++;
        setTimeout(() => running && open(), 100 + 900 * Math.random());
      });
      sockets.add(socket);
      socket.write('POST /v1/meshes HTTP/1.1\r\nHost: localhost\r\nContent-Type: model/obj\r\nContent-Length: 1000000\r\n\r\n');
    };
    for (let i = 0; i < clients; i++) open();
    const drip = setInterval(() => sockets.forEach((socket) => socket.write('v')), 1000);
    await sleep(200);
    const probe = new Probe(service.url);
    await sleep(1000 * seconds);
    const livez = await probe.stop();
    running = false;
    clearInterval(drip);
    sockets.forEach((socket) => socket.destroy());
    return { ...figures, '/livez p50 ms': livez.p50, '/livez p99 ms': livez.p99, '/livez max ms': livez.max };
  });

export async function aborts(seconds, { clients = 1100 } = {}) {
  const service = await Service.start({ workers: 0, 'log-level': 'error' });
  try {
    const { json } = await service.post('/v1/meshes?name=a.obj', 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n', { 'content-type': 'model/obj' });
    const client = new Client(service.url);
    const job = (await client.get('/v1/jobs?limit=1')).json.items[0];
    const held = [
      `GET ${json.href} HTTP/1.1\r\nHost: localhost\r\nPrefer: wait=60\r\n\r\n`,
      `GET /v1/jobs/${job.id}/events HTTP/1.1\r\nHost: localhost\r\nAccept: text/event-stream\r\n\r\n`,
    ];
    let aborted = 0;
    const probe = new Probe(service.url);
    for (const end = Date.now() + 1000 * seconds; Date.now() < end; ) {
      const sockets = Array.from({ length: clients }, (_, i) => {
        const socket = dial(service.url, () => {});
        socket.write(held[i % held.length]);
        return socket;
      });
      await sleep(200 + 300 * Math.random());
      sockets.forEach((socket, i) => (i % 3 ? socket.destroy() : socket.resetAndDestroy()));
      aborted += clients;
      await sleep(100);
    }
    const livez = await probe.stop();
    client.close();
    return { clients, 'requests aborted': aborted, '/livez p50 ms': livez.p50, '/livez p99 ms': livez.p99, '/livez max ms': livez.max };
  } finally {
    await service.stop();
  }
}
