// Numbers in a request are the uploaded file's: through sewing, quads and refinement. The oracle is the file, read here.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Service, temporaryFolder, tightwire } from './service.mjs';

const folder = temporaryFolder();
const path = (...parts) => join(folder.path, ...parts);
const run = (...args) => spawnSync(tightwire, args, { encoding: 'utf8' });
const save = (name, content) => (writeFileSync(path(name), typeof content === 'string' ? content : JSON.stringify(content)), path(name));
const close = (a, b, slack) => a.every((x, i) => Math.abs(x - b[i]) <= slack);

function layout(worn, request, ...args) {
  const { status, stderr } = run('layout', '--worn', worn, '--terminals', save('request.json', request), '--out', path('out'), ...args);
  return { status, stderr, document: status === 0 ? JSON.parse(readFileSync(path('out', 'layout.json'))) : null };
}
const accepted = (...args) => {
  const { status, stderr, document } = layout(...args);
  assert.equal(status, 0, stderr);
  return document;
};

// --- the sample's suit, and the same as a tool writes it that knows one pattern position a vertex ---

let suit;
function readObj(text) {
  const positions = [], coords = [], faces = [];
  for (const line of text.split('\n')) {
    const [word, ...rest] = line.trim().split(/\s+/);
    if (word === 'v') positions.push(rest.map(Number));
    else if (word === 'vt') coords.push(rest.map(Number));
    else if (word === 'f') faces.push(rest.map((corner) => corner.split('/').map((n) => Number(n) - 1)));
  }
  return { positions, coords, faces };
}
const motions = () => ['--motion', path('suit', 'motions', 'squat.pc2')];

// Vertex k of the torn file is pattern position k of the suit, in another order; its faces stand the other way round.
function tear({ positions, coords, faces }) {
  const vertexOf = [];
  for (const corner of faces.flat()) vertexOf[corner[1]] = corner[0];
  const order = coords.map((_, k) => k).sort((a, b) => ((a * 7919) % 10007) - ((b * 7919) % 10007) || a - b);
  const number = [];
  order.forEach((coord, k) => (number[coord] = k));
  const text = [
    ...order.map((coord) => `v ${positions[vertexOf[coord]].join(' ')}`),
    ...order.map((coord) => `vt ${coords[coord].join(' ')}`),
    ...[...faces].reverse().map((face) => `f ${face.map(([, coord]) => `${number[coord] + 1}/${number[coord] + 1}`).join(' ')}`),
  ].join('\n');
  return { text, number, order, vertexOf };
}

before(() => {
  const { status, stderr } = run('sample', '--out', path('suit'), '--vertices', '3000');
  assert.equal(status, 0, stderr);
  suit = readObj(readFileSync(path('suit', 'suit.obj'), 'utf8'));
});
after(() => folder.remove());

const sampleTerminals = () => {
  const sets = path('suit', 'terminals');
  return JSON.parse(readFileSync(join(sets, readdirSync(sets).find((name) => name.includes('10'))))).terminals;
};
const asVertices = () => sampleTerminals().map(({ name, vertex, face, barycentric }) => ({
  name, vertex: vertex ?? suit.faces[face][barycentric.indexOf(Math.max(...barycentric))][0],
}));

test('a suit that is sewn on import has its terminals where the file has them, and the same tree', () => {
  const torn = tear(suit), worn = save('torn.obj', torn.text);
  const terminals = asVertices();
  const options = { relaxation: 'none' }; // so that the tree's path is one of edges
  const sewn = accepted(path('suit', 'suit.obj'), { terminals, options });
  for (let copy = 0; copy < 2; copy++) {
    // each copy of a vertex that the tearing made means the same place
    const numbers = terminals.map(({ name, vertex }) => {
      const copies = torn.vertexOf.flatMap((v, coord) => (v === vertex ? [torn.number[coord]] : []));
      return { name, vertex: copies[copy % copies.length] };
    });
    const document = accepted(worn, { terminals: numbers, options }, '--weld-mm', '0.001');
    document.terminals.forEach((terminal, i) => {
      assert.ok(close(terminal.point_mm, suit.positions[terminals[i].vertex], 1e-3), JSON.stringify(terminal));
      assert.equal(terminal.vertex, numbers[i].vertex);
    });
    // the mesh's numbers are those of the arrays
    assert.equal(run('field', '--worn', worn, '--weld-mm', '0.001', '--out', path('arrays')).status, 0);
    const [fileVertex, meshVertex, fileFace] = ['file_vertex', 'mesh_vertex', 'file_face'].map((name) => {
      const bytes = readFileSync(path('arrays', `${name}.u32`));
      return new Uint32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
    });
    for (const { vertex, mesh_vertex: mesh, face, mesh_face: meshFace } of document.terminals) {
      assert.equal(meshVertex[vertex], mesh);
      assert.equal(fileFace[meshFace], face);
    }
    for (const { tree_vertices: inFile, tree_mesh_vertices: inMesh } of document.layout.branches)
      inMesh.forEach((mesh, i) => assert.equal(fileVertex[mesh], inFile[i]));
    const [a, b] = [sewn, document].map((d) => Number(d.layout.weight_mpa_mm2));
    assert.ok(Math.abs(a / b - 1) < 1e-5, `${a} ${b}`);
    // every vertex of the tree, in the file's numbers, is one that the edges of the file join
    const joined = new Set(readObj(torn.text).faces.flatMap((face) => face.map(([v], k) => [v, face[(k + 1) % 3][0]].map((n) =>
      suit.positions[torn.vertexOf[torn.order[n]]].join()).sort().join('|'))));
    for (const { tree_vertices: tree } of document.layout.branches)
      for (let i = 1; i < tree.length; i++) {
        const ends = [tree[i - 1], tree[i]].map((n) => suit.positions[torn.vertexOf[torn.order[n]]].join()).sort();
        assert.ok(joined.has(ends.join('|')), `no edge of the file joins ${tree[i - 1]} and ${tree[i]}`);
      }
  }
});

test('a terminal on a seam is given on every piece that meets there', () => {
  const pieces = new Map();
  for (const face of suit.faces) for (const [vertex, coord] of face) pieces.set(vertex, (pieces.get(vertex) ?? new Set()).add(coord));
  const onSeams = [...pieces].filter(([, coords]) => coords.size > 1).slice(0, 40);
  assert.ok(onSeams.length > 10);
  const { terminals } = accepted(path('suit', 'suit.obj'), { terminals: onSeams.map(([vertex]) => ({ vertex })), options: { baseline: 'none', time_limit_s: 1 } });
  onSeams.forEach(([, coords], i) => {
    const given = terminals[i].on_pattern.map(({ uv_mm }) => uv_mm);
    assert.deepEqual(given[0], terminals[i].uv_mm);
    assert.equal(given.length, coords.size);
    for (const coord of coords) assert.ok(given.some((uv) => close(uv, suit.coords[coord], 1e-3)));
  });
});

// --- a sheet of quads and triangles in two pieces ---

const COLUMNS = 5, ROWS = 4;
const vertex = (x, y) => y * COLUMNS + x;
function sheet(quads) {
  const lines = [];
  for (let y = 0; y < ROWS; y++) for (let x = 0; x < COLUMNS; x++) lines.push(`v ${100 * x} ${100 * y} ${0.0005 * (100 * x) ** 2}`);
  for (let y = 0; y < ROWS; y++) for (let x = 0; x < COLUMNS; x++) lines.push(`vt ${100 * x} ${100 * y}`);
  const faces = [];
  for (let y = 0; y + 1 < ROWS; y++)
    for (let x = 0; x + 1 < COLUMNS; x++) {
      const [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x + 1, y + 1), vertex(x, y + 1)];
      faces.push(...(quads && (x + y) % 2 === 0 ? [[a, b, c, d]] : [[a, b, c], [a, c, d]]));
    }
  lines.push(...faces.map((face) => `f ${face.map((v) => `${v + 1}/${v + 1}`).join(' ')}`));
  return { worn: save(quads ? 'quads.obj' : 'triangles.obj', lines.join('\n')), faces };
}
const refinements = [[], ['--refinement', 'midpoint'], ['--refinement', 'midpoint', '--refine-levels', '2'], ['--refinement', 'centroid'], ['--refinement', 'centroid', '--refine-levels', '3']];
const corners = [{ vertex: vertex(0, 0) }, { vertex: vertex(COLUMNS - 1, 0) }];

test('a face of more than three corners has no weights, and says so', () => {
  const { worn, faces } = sheet(true);
  const quad = faces.findIndex((face) => face.length === 4), triangle = faces.findIndex((face) => face.length === 3);
  for (const refinement of refinements) {
    const { status, stderr } = layout(worn, { terminals: [corners[0], { face: quad, barycentric: [0.2, 0.3, 0.5] }] }, ...refinement);
    assert.equal(status, 1);
    assert.match(stderr, /terminals\/1\/face.*more than three corners/);
    const { terminals } = accepted(worn, { terminals: [corners[0], { face: triangle, barycentric: [0.2, 0.3, 0.5] }] }, ...refinement);
    assert.equal(terminals[1].face, triangle);
    assert.ok(close(terminals[1].barycentric, [0.2, 0.3, 0.5], 1e-7));
    const { status: beyond, stderr: text } = layout(worn, { terminals: [corners[0], { face: faces.length, barycentric: [1, 0, 0] }] }, ...refinement);
    assert.equal(beyond, 1);
    assert.match(text, new RegExp(`there is no face ${faces.length}: the garment's file has ${faces.length} faces`));
  }
});

test('free edges, multipliers and keep-outs of the file hold for all their parts', () => {
  for (const quads of [false, true]) {
    const { worn, faces } = sheet(quads);
    const request = (constraints) => ({ terminals: corners, constraints, options: { baseline: 'none' } });
    const hem = Array.from({ length: COLUMNS - 1 }, (_, x) => [vertex(x + 1, 0), vertex(x, 0)]);
    for (const refinement of refinements) {
      const weight = (constraints) => Number(accepted(worn, request(constraints), ...refinement).layout.weight_mpa_mm2);
      // a free way between the two is free, whatever its edges were cut into
      assert.equal(weight({ free_edges: hem }), 0);
      // all fabric for twice the price, by every face of the file
      const plain = weight({}), twice = weight({ face_multipliers: [{ faces: faces.map((_, i) => i), factor: 2 }] });
      assert.ok(Math.abs(twice / plain - 2) < 1e-6, `${twice} ${plain}`);
      // a wall across the sheet
      const wall = faces.flatMap((face, i) => (face.every((v) => [1, 2].includes(v % COLUMNS)) ? [i] : []));
      const { status, stderr } = layout(worn, request({ keep_out: [{ faces: wall }] }), ...refinement);
      assert.equal(status, 1, 'a wire goes through what is kept out');
      assert.match(stderr, /no wire can join/);
      const { status: unknown, stderr: text } = layout(worn, request({ free_edges: [[vertex(0, 0), vertex(3, 3)]] }), ...refinement);
      assert.equal(unknown, 1);
      assert.match(text, /free_edges\/0.*no edge of the garment's file joins vertices 0 and 18/);
    }
  }
});

test('the path of the tree has both numberings, and the terminals within faces', () => {
  const { worn } = sheet(false);
  const terminals = [{ face: 0, barycentric: [0.2, 0.5, 0.3] }, { vertex: vertex(3, 2) }];
  for (const refinement of refinements) {
    const { layout: tree, garment } = accepted(worn, { terminals }, ...refinement);
    const [{ from, to, tree_vertices: inFile, tree_mesh_vertices: inMesh }] = tree.branches;
    assert.equal(inFile.length, inMesh.length);
    const ends = [[from, inFile.at(0), inMesh.at(0)], [to, inFile.at(-1), inMesh.at(-1)]];
    for (const [{ terminal }, file, mesh] of ends) {
      if (terminal === 0) assert.deepEqual([file, mesh], [{ terminal: 0 }, { terminal: 0 }]);
      else assert.equal(file, vertex(3, 2));
    }
    assert.deepEqual([garment.file_vertices, garment.file_faces], [COLUMNS * ROWS, 2 * (COLUMNS - 1) * (ROWS - 1)]);
    inMesh.forEach((mesh, i) => assert.ok(typeof mesh === 'object' || inFile[i] === null || inFile[i] === mesh));
  }
});

// --- what the service gives to programs ---

test('the arrays of a mesh lead from the file to the mesh and its edges', async () => {
  const service = await Service.start({ workers: 1 });
  try {
    const { worn, faces } = sheet(true);
    const upload = await service.post('/v1/meshes?refinement=midpoint', readFileSync(worn), { prefer: 'wait=30', 'content-type': 'model/obj' });
    assert.equal(upload.json.state, 'succeeded', JSON.stringify(upload.json.problem));
    const { summary, href } = upload.json;
    assert.deepEqual([summary.file_vertices, summary.file_faces], [COLUMNS * ROWS, faces.length]);
    const arrays = {};
    for (const { name, href: at, type } of (await service.get(href)).json.arrays)
      if (['u32', 'f64'].includes(type)) {
        const bytes = await (await fetch(service.url + at)).arrayBuffer();
        arrays[name] = type === 'u32' ? new Uint32Array(bytes) : new Float64Array(bytes);
      }
    assert.equal(arrays.edge_vertex.length, 2 * summary.edges);
    assert.equal(arrays.mesh_vertex.length, COLUMNS * ROWS);
    arrays.mesh_vertex.forEach((mesh, v) => {
      assert.equal(arrays.file_vertex[mesh], v);
      assert.deepEqual([...arrays.position.slice(3 * mesh, 3 * mesh + 2)], [100 * (v % COLUMNS), 100 * Math.floor(v / COLUMNS)]);
    });
    assert.equal(arrays.file_vertex.filter((v) => v !== 0xffffffff).length, COLUMNS * ROWS);
    // each side of each face is an edge, and each edge a side
    const sides = new Set(), edges = new Set();
    for (let i = 0; i < arrays.face_vertex.length; i++)
      sides.add([arrays.face_vertex[i], arrays.face_vertex[i % 3 === 2 ? i - 2 : i + 1]].sort((a, b) => a - b).join());
    for (let e = 0; e < summary.edges; e++) edges.add([...arrays.edge_vertex.slice(2 * e, 2 * e + 2)].join());
    assert.deepEqual([...edges].sort(), [...sides].sort());
    // parts of a face lie within its corners
    arrays.file_face.forEach((file, f) => {
      const box = faces[file].map((v) => [100 * (v % COLUMNS), 100 * Math.floor(v / COLUMNS)]);
      for (let k = 0; k < 3; k++)
        for (const axis of [0, 1]) {
          const at = arrays.position[3 * arrays.face_vertex[3 * f + k] + axis], range = box.map((p) => p[axis]);
          assert.ok(at >= Math.min(...range) && at <= Math.max(...range));
        }
    });
    const field = await service.post('/v1/fields', { mesh: upload.json.id, motions: [] }, { prefer: 'wait=30' });
    assert.equal(field.json.summary.edges, summary.edges);
    assert.equal(field.json.summary.warnings[0].type, 'field-without-motions');
    const lay = await service.post('/v1/layouts', { field: field.json.id, terminals: [{ vertex: 3 }, { vertex: 3 }] }, { prefer: 'wait=30' });
    assert.deepEqual(lay.json.summary.warnings.map(({ type, places }) => [type, places]),
      [['terminals-doubled', [1]], ['one-terminal', []], ['field-without-motions', []]]);
  } finally {
    await service.stop();
  }
});

test('the command line says what the service says', () => {
  const { worn } = sheet(true);
  const { status, stderr, document } = layout(worn, { terminals: [{ vertex: 3 }, { vertex: 3 }] });
  assert.equal(status, 0, stderr);
  for (const [text, type] of [[/cut into triangles/], [/at the place of another/, 'terminals-doubled'], [/nothing is to be wired/, 'one-terminal'], [/no motion shapes/, 'field-without-motions']]) {
    assert.match(stderr, text);
    if (type) assert.ok(document.warnings.some((warning) => warning.type === type));
  }
});
