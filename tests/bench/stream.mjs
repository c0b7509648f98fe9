// stream.mjs: a motion set as large as the paper's, 248 sequences with 40,108 frames of 23,500 vertices, 11 GB of positions,
// through a running service: resumable uploads (one connection is dropped and the upload goes on where it was), strain,
// packing, storage, and one field of them all. The motions are made while they are sent, from those of the sample suit, each
// one different; no process may take more than 256 MiB.
//   SEQUENCES  how many (248)      TIGHTWIRE  the binary      STORE_FOLDER  where the store goes (the system's temporary one)
// Prints lines like the other benches; exit 1 when a goal is missed.
import { request } from 'node:http';
import { mkdtempSync, readFileSync, readdirSync, rmSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { tmpdir } from 'node:os';
import { Service, childrenOf, run, sleep } from '../http/service.mjs';

const SEQUENCES = Number(process.env.SEQUENCES ?? 248);
const FRAMES = Math.round((SEQUENCES * 40108) / 248);
const LIMIT_MIB = 256;
const HEADER_BYTES = 32;
const WORKERS = 2, AHEAD = 4; // uploads that may wait for a worker

const folder = mkdtempSync(join(process.env.STORE_FOLDER ?? tmpdir(), 'tightwire-stream-'));
const suit = join(folder, 'suit');
let missed = 0;

function line(name, value, unit, goal) {
  const ok = goal === undefined || (goal < 0 ? value >= -goal : value <= goal);
  const shown = goal === undefined ? '' : goal < 0 ? `>= ${-goal}` : `<= ${goal}`;
  missed += !ok;
  console.log(
    `${name.padEnd(36)} ${String(Number.isInteger(value) ? value : Number(value.toPrecision(4))).padStart(12)} ${unit.padEnd(6)} ${shown.padEnd(10)} ` +
      (goal === undefined ? '' : ok ? 'ok' : 'MISSED'),
  );
}

// --- motions that exist only while they are sent ---

const caches = [];
let floats; // in a frame

function loadSample() {
  run('sample', '--out', suit);
  for (const name of readdirSync(join(suit, 'motions')).sort()) {
    const file = readFileSync(join(suit, 'motions', name));
    const positions = new Float32Array(file.buffer.slice(file.byteOffset + HEADER_BYTES, file.byteOffset + file.length));
    floats = 3 * file.readInt32LE(16);
    caches.push({ name: name.replace('.pc2', ''), header: file.subarray(0, HEADER_BYTES), positions, count: file.readInt32LE(28) });
  }
}

const framesOf = (sequence) => Math.floor(((sequence + 1) * FRAMES) / SEQUENCES) - Math.floor((sequence * FRAMES) / SEQUENCES);

// The sequence's motion over and over, a little larger or smaller from frame to frame: as a wearer breathes.
function frameOf(sequence, number) {
  const { positions, count } = caches[sequence % caches.length];
  const from = ((number + sequence) % count) * floats;
  const scale = 1 + 0.004 * Math.sin(0.2 * number + sequence);
  const frame = new Float32Array(floats);
  for (let i = 0; i < floats; i++) frame[i] = positions[from + i] * scale;
  return Buffer.from(frame.buffer);
}

function headerOf(sequence) {
  const header = Buffer.from(caches[sequence % caches.length].header);
  header.writeInt32LE(framesOf(sequence), 28);
  return header;
}

// The file's bytes from `offset` on, a frame at a time.
function* bytesFrom(sequence, offset) {
  let at = 0;
  const part = (bytes) => {
    const begin = Math.max(0, offset - at);
    at += bytes.length;
    return bytes.subarray(Math.min(begin, bytes.length));
  };
  yield part(headerOf(sequence));
  for (let j = 0; j < framesOf(sequence); j++) {
    if (at + 4 * floats <= offset) at += 4 * floats;
    else yield part(frameOf(sequence, j));
  }
}

// --- the client ---

// Sends the rest of a file; cuts the connection once `most` bytes are out. Gives the answer, or nothing where it was cut.
function send(service, path, sequence, offset, total, most = Infinity) {
  const { hostname, port } = new URL(service.url);
  const headers = {
    'upload-offset': offset,
    'upload-complete': '?1',
    'content-type': 'application/octet-stream',
    'content-length': total - offset,
  };
  return new Promise((done, fail) => {
    let cut = false;
    const call = request({ hostname, port, path, method: 'PATCH', headers }, (response) => {
      const parts = [];
      response.on('data', (bytes) => parts.push(bytes));
      response.on('end', () => done({ status: response.statusCode, json: JSON.parse(Buffer.concat(parts)) }));
    });
    call.on('error', (error) => (cut ? done() : fail(error)));
    (async () => {
      let sent = 0;
      for (const bytes of bytesFrom(sequence, offset)) {
        if (!call.write(bytes)) await new Promise((drained) => call.once('drain', drained));
        sent += bytes.length;
        if (sent >= most) {
          cut = true;
          call.destroy();
          return;
        }
      }
      call.end();
    })().catch(fail);
  });
}

async function upload(service, sequence, drop) {
  const total = HEADER_BYTES + framesOf(sequence) * 4 * floats;
  const { headers } = await service.request('POST', `/v1/uploads?part=motion&name=${sequence}.pc2`);
  const path = headers.get('location');
  let offset = 0;
  if (drop) {
    await send(service, path, sequence, 0, total, total / 2);
    await sleep(500);
    offset = (await service.get(path)).json.received_bytes;
    if (!(offset > 0 && offset < total)) throw new Error(`${offset} of ${total} bytes had arrived`);
    console.log(`connection dropped: goes on at byte ${offset} of ${total}`);
  }
  const { status, json } = await send(service, path, sequence, offset, total);
  if (status !== 200 || !json.complete) throw new Error(`upload ${sequence}: ${status} ${JSON.stringify(json)}`);
  return { id: json.id, total };
}

// --- the run ---

// The peak of every process that ever was, MiB.
const peaks = new Map();
function watchMemory(service) {
  for (const pid of [service.process.pid, ...childrenOf(service.process.pid)]) {
    try {
      peaks.set(pid, service.peakBytes(pid) / (1 << 20));
    } catch {
      // it has ended
    }
  }
}

const ended = (state) => ['succeeded', 'failed', 'cancelled'].includes(state);

async function main() {
  loadSample();
  const store = join(folder, 'store.db');
  const service = await Service.start({ workers: WORKERS, store: `sqlite:${store}`, 'log-level': 'error' });
  const watch = setInterval(() => watchMemory(service), 200);
  try {
    const start = Date.now();
    const body = readFileSync(join(suit, 'suit.obj'));
    const mesh = (await service.post('/v1/meshes?name=suit.obj', body, { 'content-type': 'model/obj', prefer: 'wait=60' })).json;
    const running = new Map(); // path of a motion -> when it was sent
    const motions = [];
    let bytes = 0, frames = 0, progressSeen = false;
    const settle = async (most) => {
      while (running.size > most) {
        for (const path of [...running.keys()]) {
          const { json } = await service.get(path);
          const { json: job } = await service.get(`/v1/jobs/${json.job.id}`);
          progressSeen ||= job.progress > 0 && job.progress < 1;
          if (!ended(json.state)) continue;
          if (json.state !== 'succeeded') throw new Error(JSON.stringify(json.problem));
          running.delete(path);
          motions.push(json.id);
          frames += json.summary.frames;
        }
        if (running.size > most) await sleep(50);
      }
    };
    for (let sequence = 0; sequence < SEQUENCES; sequence++) {
      const { id, total } = await upload(service, sequence, sequence === 1);
      bytes += total;
      const name = `${caches[sequence % caches.length].name}-${sequence}`;
      const { json } = await service.request('POST', `/v1/meshes/${mesh.id}/motions?motion=${id}&name=${name}`);
      running.set(json.href, Date.now());
      await settle(AHEAD);
      if (sequence % 20 === 19) console.log(`${sequence + 1} sequences sent, ${motions.length} imported, ${Math.round((Date.now() - start) / 1000)} s`);
    }
    await settle(0);
    const imported = (Date.now() - start) / 1000;
    const { json: asked } = await service.post('/v1/fields', { mesh: mesh.id, motions });
    const field = await service.finished(asked.href, 600);
    if (field.state !== 'succeeded') throw new Error(JSON.stringify(field.problem));
    watchMemory(service);
    const daemon = peaks.get(service.process.pid);
    const workers = [...peaks].filter(([pid]) => pid !== service.process.pid).map(([, mib]) => mib);
    line('stream.sequences', motions.length, '', -SEQUENCES);
    line('stream.frames', frames, '', -FRAMES);
    line('stream.positions', bytes / 1e9, 'GB');
    line('stream.seconds', imported, 's');
    line('stream.rate', bytes / 1e6 / imported, 'MB/s');
    line('stream.progress_seen', Number(progressSeen), '', -1);
    line('stream.field_of_all_motions', field.summary.motions, '', -SEQUENCES);
    line('stream.daemon_peak', daemon, 'MiB', LIMIT_MIB);
    line('stream.worker_peak', Math.max(...workers), 'MiB', LIMIT_MIB);
    line('stream.store_over_positions', statSync(store).size / bytes, 'x', SEQUENCES < 100 ? undefined : 0.4); // room for uploads in hand counts
  } finally {
    clearInterval(watch);
    await service.stop();
    rmSync(folder, { recursive: true, force: true });
  }
}

await main();
process.exitCode = missed ? 1 : 0;
