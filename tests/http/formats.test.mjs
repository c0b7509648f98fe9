// Every way in which a file can be bad, for every format that is read: a problem that names the kind and the place, and a
// service that goes on as if nothing had been. The files are written here, by code that knows nothing of the readers.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Service, run, temporaryFolder } from './service.mjs';

const folder = temporaryFolder();
const wait = { prefer: 'wait=30' };
let service, workers, mesh;

// --- a sheet of 4 by 4 vertices, 100 mm apart, a little curved as worn ---

const SIDE = 4, VERTICES = SIDE * SIDE;
const sheet = () => {
  const vertices = [], faces = [];
  for (let i = 0; i < VERTICES; i++) {
    const x = 100 * (i % SIDE), y = 100 * Math.floor(i / SIDE);
    vertices.push([x, y, 0.0005 * x * x + 0.125 * i]);
  }
  for (let i = 0; i + SIDE < VERTICES; i++)
    if (i % SIDE < SIDE - 1) faces.push([i, i + 1, i + SIDE + 1], [i, i + SIDE + 1, i + SIDE]);
  return { vertices, faces };
};
const flat = ({ vertices, faces }) => ({ vertices: vertices.map(([x, y]) => [x, y, 0]), faces });

// --- writers: bytes of a mesh; `claim` replaces the number of faces in the header ---

const numbers = (kind, list, big = false) => {
  const sizes = { u8: 1, u16: 2, i32: 4, u32: 4, f32: 4 };
  const bytes = Buffer.alloc(sizes[kind] * list.length);
  const end = big ? 'BE' : 'LE';
  const write = { u8: 'writeUInt8', u16: `writeUInt16${end}`, i32: `writeInt32${end}`, u32: `writeUInt32${end}`, f32: `writeFloat${end}` };
  list.forEach((value, i) => bytes[write[kind]](value, i * sizes[kind]));
  return bytes;
};
const lines = (...all) => Buffer.from(all.flat().join('\n') + '\n');
const row = (list) => list.map((value) => (value === Infinity ? 'inf' : String(value).toLowerCase())).join(' ');

const plyHeader = (format, mesh, claim) => [
  'ply', `format ${format} 1.0`, `element vertex ${mesh.vertices.length}`,
  ...['x', 'y', 'z'].map((axis) => `property float ${axis}`),
  `element face ${claim ?? mesh.faces.length}`, 'property list uchar int vertex_indices', 'end_header',
];
const binaryPly = (big) => (mesh, claim) =>
  Buffer.concat([
    lines(plyHeader(big ? 'binary_big_endian' : 'binary_little_endian', mesh, claim)),
    ...mesh.vertices.map((v) => numbers('f32', v, big)),
    ...mesh.faces.map((face) => Buffer.concat([numbers('u8', [face.length]), numbers('i32', face, big)])),
  ]);
const triangles = (mesh) => mesh.faces.map((face) => face.map((v) => mesh.vertices[v]));

const meshFormats = {
  obj: { write: (mesh) => lines(mesh.vertices.map((v) => `v ${row(v)}`), mesh.faces.map((f) => `f ${row(f.map((v) => v + 1))}`)) },
  ply: {
    counts: true,
    write: (mesh, claim) => lines(plyHeader('ascii', mesh, claim), mesh.vertices.map(row), mesh.faces.map((f) => `${f.length} ${row(f)}`)),
  },
  'little-endian ply': { name: 'bad.ply', counts: true, write: binaryPly(false) },
  'big-endian ply': { name: 'bad.ply', counts: true, write: binaryPly(true) },
  off: {
    counts: true,
    write: (mesh, claim) =>
      lines('OFF', `${mesh.vertices.length} ${claim ?? mesh.faces.length} 0`, mesh.vertices.map(row), mesh.faces.map((f) => `${f.length} ${row(f)}`)),
  },
  stl: {
    corners: true,
    write: (mesh) =>
      lines('solid sheet', triangles(mesh).map((t) => ['facet normal 0 0 1', 'outer loop', ...t.map((v) => `vertex ${row(v)}`), 'endloop', 'endfacet'].join('\n')), 'endsolid sheet'),
  },
  'binary stl': {
    name: 'bad.stl', corners: true, counts: true,
    write: (mesh, claim) =>
      Buffer.concat([
        Buffer.alloc(80), numbers('u32', [claim ?? mesh.faces.length]),
        ...triangles(mesh).map((t) => Buffer.concat([numbers('f32', [0, 0, 1, ...t.flat()]), numbers('u16', [0])])),
      ]),
  },
};

// What makes a good mesh bad: the problem's type, and where it must point. STL has no numbers of vertices.
const meshRows = [
  ['a coordinate that is not a number', ({ vertices }) => (vertices[5][1] = NaN), /^mesh-not-a-number$/, /line|vertex|face/],
  ['a coordinate that is infinite', ({ vertices }) => (vertices[5][2] = Infinity), /^mesh-not-a-number$/, /line|vertex|face/],
  ['an index beyond the last vertex', ({ faces }) => (faces[3][1] = 999), /^mesh-bad-index$/, /line|face/, 'indexed'],
  ['an index below the first vertex', ({ faces }) => (faces[3][1] = -1), /^mesh-bad-index$/, /line|face/, 'indexed'],
  ['a face that has a vertex twice', ({ faces }) => (faces[3][1] = faces[3][0]), /^mesh-degenerate-face$/, /line|face/],
  ['three faces on an edge', ({ faces }) => faces.push([0, 5, 14]), /^mesh-non-manifold-edge$/, /line|face/, 'in both'],
  ['a face the wrong way round', ({ faces }) => faces[3].reverse(), /^mesh-flipped-face$/, /line|face/, 'in both'],
  ['no faces', (mesh) => (mesh.faces = []), /^mesh-(empty|truncated|bad-header)$/, null],
];

async function outcomeOf(answer) {
  const { status, json } = await answer;
  if (status >= 400) return json;
  assert.equal(status, 200);
  assert.equal(json.state, 'failed', `it was taken: ${JSON.stringify(json.summary)}`);
  assert.equal(json.summary, null);
  return json.problem;
}

async function isRefused(what, answer, type, place) {
  const problem = await outcomeOf(answer);
  const slug = problem.type.replace('urn:tightwire:problem:', '');
  assert.match(slug, type, `${what}: ${slug}: ${problem.detail}`);
  assert.ok(problem.status >= 400 && problem.status < 500, `${what}: ${problem.status}`);
  if (place) assert.match(JSON.stringify(problem.errors ?? []), place, `${what}: ${problem.detail}`);
  assert.ok(problem.detail.length > 20, what);
}

const uploadMesh = (format, worn, pattern = meshFormats[format].write(flat(sheet()))) => {
  const name = meshFormats[format].name ?? `bad.${format}`;
  const form = new FormData();
  form.append('worn', new Blob([worn]), name);
  form.append('pattern', new Blob([pattern]), name);
  return service.post('/v1/meshes', form, wait);
};

before(async () => {
  service = await Service.start({ workers: 1 });
  const { json } = await uploadMesh('obj', meshFormats.obj.write(sheet()));
  assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
  mesh = json;
  workers = service.workers();
});
after(async () => {
  await service.stop();
  folder.remove();
});

for (const [format, { write, counts, corners }] of Object.entries(meshFormats)) {
  test(`a garment as ${format}: good as it is, refused however it is bad`, async () => {
    const good = write(sheet());
    const { json } = await uploadMesh(format, good);
    assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
    assert.deepEqual([json.summary.vertices, json.summary.faces], [VERTICES, sheet().faces.length]);
    for (const [what, change, type, place, needs] of meshRows) {
      if (needs === 'indexed' && corners) continue;
      const bad = sheet();
      change(bad);
      await isRefused(what, uploadMesh(format, write(bad), needs === 'in both' ? write(flat(bad)) : undefined), type, place);
    }
    for (const share of [0.1, 0.4, 0.6, 0.9])
      await isRefused(`cut off at ${share}`, uploadMesh(format, good.subarray(0, share * good.length)), /./, null);
    await isRefused('empty', uploadMesh(format, Buffer.alloc(0)), /empty/, null);
    await isRefused('something else', uploadMesh(format, Buffer.from('\x89PNG\r\n\x1a\n'.repeat(20), 'latin1')), /^mesh-/, null);
    if (!counts) return;
    await isRefused('a hundred million faces in 1 KB', uploadMesh(format, write(sheet(), 1e8)), /^mesh-(truncated|too-large)$/, null);
    await isRefused('a face too many', uploadMesh(format, write(sheet(), sheet().faces.length + 1)), /^mesh-truncated$/, null);
    await isRefused('a face too few', uploadMesh(format, write(sheet(), sheet().faces.length - 1)), format === 'binary stl' ? /^mesh-truncated$/ : /^mesh-trailing-bytes$/, null);
  });
}

test('worn mesh and pattern that do not belong together are refused', async () => {
  const { write } = meshFormats.obj;
  const fewer = flat(sheet());
  fewer.faces.pop();
  const turned = flat(sheet());
  turned.faces.forEach((face) => face.reverse());
  const small = flat(sheet());
  small.vertices.forEach((v) => v.forEach((_, k) => (v[k] /= 1000)));
  for (const [what, pattern] of [['fewer faces', fewer], ['wrong side up', turned], ['in metres', small]])
    await isRefused(what, uploadMesh('obj', write(sheet()), write(pattern)), /^pattern-/, null);
});

// --- motions ---

const FRAMES = 4;
const frames = () =>
  Array.from({ length: FRAMES }, (_, j) => sheet().vertices.map(([x, y, z]) => [x * (1 + 0.01 * j), y, z + j]));

function tar(files) {
  const blocks = files.flatMap(([name, bytes]) => {
    const header = Buffer.alloc(512);
    header.write(name, 0);
    header.write('0000644\0', 100);
    header.write(bytes.length.toString(8).padStart(11, '0') + '\0', 124);
    header.write('00000000000\0', 136);
    header.write('        0', 148);
    header.write('ustar\x0000', 257);
    const sum = header.reduce((total, byte) => total + byte, 0);
    header.write(sum.toString(8).padStart(6, '0') + '\0 ', 148);
    return [header, bytes, Buffer.alloc((512 - (bytes.length % 512)) % 512)];
  });
  return Buffer.concat([...blocks, Buffer.alloc(1024)]);
}

const motionFormats = {
  pc2: (list, { points = list[0].length, count = list.length } = {}) =>
    Buffer.concat([Buffer.from('POINTCACHE2\0'), numbers('i32', [1, points]), numbers('f32', [0, 1]), numbers('i32', [count]), ...list.map((frame) => numbers('f32', frame.flat()))]),
  mdd: (list, { points = list[0].length, count = list.length } = {}) =>
    Buffer.concat([numbers('i32', [count, points], true), numbers('f32', list.map((_, j) => j / 25), true), ...list.map((frame) => numbers('f32', frame.flat(), true))]),
  tar: (list) => tar(list.map((vertices, j) => [`frame${j}.obj`, meshFormats.obj.write({ vertices, faces: sheet().faces })])),
  packed: (list) => {
    writeFileSync(join(folder.path, 'motion.pc2'), motionFormats.pc2(list));
    run('pack', join(folder.path, 'motion.pc2'), '--out', join(folder.path, 'motion.twm'));
    return readFileSync(join(folder.path, 'motion.twm'));
  },
};
const uploadMotion = (bytes) =>
  service.post(`${mesh.href}/motions?name=bad`, bytes, { 'content-type': 'application/octet-stream', ...wait });
const changed = (bytes, change) => {
  const copy = Buffer.from(bytes);
  change(copy);
  return copy;
};

for (const [format, write] of Object.entries(motionFormats)) {
  test(`a motion as ${format}: good as it is, refused however it is bad`, async () => {
    const good = write(frames());
    const { json } = await uploadMotion(good);
    assert.equal(json.state, 'succeeded', JSON.stringify(json.problem));
    assert.deepEqual([json.summary.frames, json.summary.points], [FRAMES, VERTICES]);
    const bad = (change) => {
      const list = frames();
      change(list);
      return uploadMotion(write(list));
    };
    if (format !== 'packed') {
      await isRefused('not a number', bad((list) => (list[2][5][1] = NaN)), /not-a-number$/, /frame 2/);
      await isRefused('infinite', bad((list) => (list[2][5][1] = Infinity)), /not-a-number$/, /frame 2/);
    }
    await isRefused('a vertex more', bad((list) => list.forEach((frame) => frame.push([0, 0, 0]))), /^motion-(vertex-count|unknown-format)$/, null);
    await isRefused('in metres', bad((list) => list.forEach((frame) => frame.forEach((v) => v.forEach((_, k) => (v[k] /= 1000))))), /^motion-does-not-fit$/, null);
    await isRefused('all in one point', bad((list) => list[0].forEach((v) => v.fill(1))), /^motion-does-not-fit$/, null);
    for (const share of [0.05, 0.3, 0.6, 0.8])
      await isRefused(`cut off at ${share}`, uploadMotion(good.subarray(0, share * good.length)), /^motion-(truncated|bad-tar|unknown-format)$/, null);
    await isRefused('empty', uploadMotion(Buffer.alloc(0)), /empty/, null);
    await isRefused('something else', uploadMotion(Buffer.from('MZ'.repeat(400))), /^motion-unknown-format$/, /byte 0/);
    if (format !== 'tar') await isRefused('more behind the end', uploadMotion(Buffer.concat([good, Buffer.alloc(12)])), /^motion-trailing-bytes$/, null);
    if (format === 'pc2' || format === 'mdd') {
      for (const claim of [{ count: 2e9 }, { points: VERTICES, count: 1e6 }, { count: 0 }, { count: -1 }, { points: 0 }, { points: 2 ** 31 - 1 }, { count: FRAMES + 1 }, { count: FRAMES - 1 }])
        await isRefused(JSON.stringify(claim), uploadMotion(write(frames(), claim)), /^motion-(truncated|too-large|empty|vertex-count|unknown-format|trailing-bytes)$/, null);
    }
  });
}

test('a tar of frames that do not belong together is refused with the frame', async () => {
  const write = (change) => {
    const files = frames().map((vertices, j) => [`frame${j}.obj`, { vertices, faces: sheet().faces }]);
    change(files);
    return uploadMotion(tar(files.map(([name, mesh]) => [name, meshFormats.obj.write(mesh)])));
  };
  await isRefused('faces in another order', write((files) => files[2][1].faces.reverse()), /^motion-vertex-order$/, /frame 2/);
  await isRefused('an index out of range', write((files) => (files[2][1].faces[0][0] = 99)), /^mesh-bad-index$/, /frame 2/);
  await isRefused('a vertex fewer', write((files) => files[3][1].vertices.push([0, 0, 0])), /^motion-vertex-count$/, /frame 3/);
  await isRefused('two frames of one number', write((files) => (files[2][0] = 'frame01.obj')), /^motion-frame-order$/, /frame 2/);
  await isRefused('no frame', write((files) => files.forEach((file) => (file[0] = file[0].replace('obj', 'txt')))), /^motion-empty$/, null);
  const broken = changed(motionFormats.tar(frames()), (bytes) => (bytes[150] ^= 1));
  await isRefused('a wrong checksum', uploadMotion(broken), /^motion-bad-tar$/, /frame 0/);
});

test('a packed motion that is damaged is refused with the frame', async () => {
  const good = motionFormats.packed(frames());
  const second = 24 + 4 + good.readUInt32LE(24);
  await isRefused('the mark of a frame', uploadMotion(changed(good, (bytes) => (bytes[second + 4] ^= 0xff))), /^motion-damaged$/, /frame 1/);
  await isRefused('the size of a frame', uploadMotion(changed(good, (bytes) => bytes.writeUInt32LE(0xffffffff, second))), /^motion-damaged$/, /frame 1/);
  await isRefused('the rate', uploadMotion(changed(good, (bytes) => bytes.writeFloatLE(NaN, 16))), /^motion-bad-header$/, /byte 16/);
  await isRefused('the points', uploadMotion(changed(good, (bytes) => bytes.writeUInt32LE(4e9, 8))), /^motion-(vertex-count|too-large)$/, null);
});

test('after all that the same processes are at work', async () => {
  assert.equal((await service.get('/livez')).status, 200);
  assert.deepEqual(service.workers(), workers);
  const { json } = await uploadMotion(motionFormats.pc2(frames().slice(0, 3)));
  assert.equal(json.state, 'succeeded');
});
