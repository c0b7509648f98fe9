// What a client can get wrong, and the clear problem that it gets back. No worker runs: nothing here needs one.
import assert from 'node:assert/strict';
import { connect } from 'node:net';
import { after, before, test } from 'node:test';
import { Service, openapi, sleep } from './service.mjs';

let service;
before(
  async () => (service = await Service.start({ 'upload-limit-mib': 64, 'cors-origin': 'https://studio.example' })),
);
after(() => service.stop());

const urn = (slug) => `urn:tightwire:problem:${slug}`;

async function refuses(promise, status, slug, place) {
  const answer = await promise;
  assert.equal(answer.status, status, answer.text);
  assert.equal(answer.json.type, urn(slug));
  assert.equal(answer.json.request_id, answer.headers.get('x-request-id'));
  if (place) assert.equal(answer.json.errors[0].pointer ?? answer.json.errors[0].place, place);
  return answer;
}

// Bytes to the socket as they are; what comes back until it closes.
async function raw(text, { end = true, seconds = 5 } = {}) {
  const { port } = new URL(service.url);
  const socket = connect(Number(port), '127.0.0.1');
  let back = '';
  socket.on('data', (bytes) => (back += bytes));
  socket.on('error', () => {});
  socket.write(text);
  const closed = new Promise((done) => socket.on('close', done));
  await Promise.race([closed, sleep(end ? 300 : seconds * 1000)]);
  socket.destroy();
  return back;
}

const mesh = (body) => service.post('/v1/meshes?name=a.obj', body, { 'content-type': 'model/obj' });
const someMesh = await (async () => 'v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n')();

test('unknown paths are 404, also with a slash too much', async () => {
  await refuses(service.get('/v1/nothing'), 404, 'no-such-path');
  await refuses(service.get('/v1/meshes/'), 404, 'no-such-path');
  await refuses(service.get('/'), 404, 'no-such-path');
  await refuses(service.get(`/v1/meshes/${'x'.repeat(500)}`), 404, 'no-such-path');
});

test('unknown ids are 404 on every resource', async () => {
  for (const path of [
    '/v1/meshes/mesh_x',
    '/v1/fields/field_x',
    '/v1/layouts/layout_x',
    '/v1/rig/recordings/x',
    '/v1/meshes/mesh_x/motions',
    '/v1/meshes/mesh_x/motions/m',
    '/v1/meshes/mesh_x/arrays/position',
    '/v1/layouts/layout_x/pattern.svg',
    '/v1/rig/recordings/x/samples.csv',
  ])
    await refuses(service.get(path), 404, 'no-such-resource');
  await refuses(service.get('/v1/jobs/job_x'), 404, 'no-such-job');
  await refuses(service.get('/v1/jobs/job_x/events'), 404, 'no-such-job');
  await refuses(service.delete('/v1/meshes/mesh_x'), 404, 'no-such-resource');
  await refuses(service.post('/v1/jobs/job_x/cancel'), 404, 'no-such-job');
});

test('a wrong method is 405 with Allow; an unknown one is 501', async () => {
  const answer = await refuses(service.request('PUT', '/v1/meshes'), 405, 'method-not-allowed');
  assert.equal(answer.headers.get('allow'), 'GET, HEAD, POST, OPTIONS');
  await refuses(service.request('DELETE', '/livez'), 405, 'method-not-allowed');
  assert.match(await raw('BREW /livez HTTP/1.1\r\nHost: localhost\r\n\r\n'), /^HTTP\/1.1 501 /);
});

test('what a client got wrong is no failure of the service in its log, whatever the status', async () => {
  const before = service.log.length;
  for (const [line, status] of [['BREW /livez HTTP/1.1', 501], ['GET /livez HTTP/2.0', 505], ['GET /nothing HTTP/1.1', 404]])
    assert.ok((await raw(`${line}\r\nHost: localhost\r\n\r\n`)).startsWith(`HTTP/1.1 ${status} `), line);
  assert.doesNotMatch(service.log.slice(before), /\bfailed\b/);
});

test('OPTIONS tells the methods, and what browsers of the allowed origin may send', async () => {
  const answer = await service.request('OPTIONS', '/v1/layouts/x');
  assert.equal(answer.status, 204);
  assert.equal(answer.headers.get('allow'), 'GET, HEAD, DELETE, OPTIONS');
  assert.equal(answer.headers.get('access-control-allow-origin'), 'https://studio.example');
  assert.match(answer.headers.get('access-control-allow-headers'), /Idempotency-Key/);
});

test('HEAD is GET without its body', async () => {
  const [get, head] = [await service.get('/v1/rig'), await service.request('HEAD', '/v1/rig')];
  assert.equal(head.bytes.length, 0);
  for (const name of ['content-length', 'content-type', 'etag'])
    assert.equal(head.headers.get(name), get.headers.get(name), name);
  assert.equal((await service.request('HEAD', '/v1/jobs/x')).status, 404);
});

test('what the client does not accept is 406', async () => {
  await refuses(service.get('/v1/jobs', { headers: { accept: 'text/html' } }), 406, 'not-acceptable', 'Accept');
  await refuses(
    service.get('/v1/jobs', { headers: { accept: 'application/json;q=0, text/html' } }),
    406,
    'not-acceptable',
  );
  for (const accept of ['*/*', 'application/*', 'text/html, application/json;q=0.1', 'text/html, */*;q=0.1'])
    assert.equal((await service.get('/v1/jobs', { headers: { accept } })).status, 200, accept);
});

test('a query parameter that is unknown, twice, broken or out of range is 400', async () => {
  await refuses(service.get('/v1/jobs?size=3'), 400, 'unknown-parameter', 'size');
  await refuses(service.get('/v1/jobs?limit=1&limit=2'), 400, 'malformed-query', 'limit');
  await refuses(service.get('/v1/jobs?limit=%zz'), 400, 'malformed-query');
  await refuses(service.get('/v1/jobs?limit=%00'), 400, 'malformed-query');
  for (const limit of ['0', '-1', '1001', '1e3', '', ' 5', '99999999999999999999'])
    await refuses(service.get(`/v1/jobs?limit=${encodeURIComponent(limit)}`), 400, 'invalid-parameter', 'limit');
  await refuses(service.get('/v1/jobs?state=done'), 400, 'invalid-parameter', 'state');
  await refuses(service.get('/v1/jobs?kind=cook'), 400, 'invalid-parameter', 'kind');
  await refuses(service.get('/v1/jobs?cursor=abc'), 400, 'invalid-parameter', 'cursor');
  await refuses(service.post('/v1/meshes?unit=ell', someMesh, { 'content-type': 'model/obj' }), 422, 'option-value');
  await refuses(
    service.post('/v1/meshes?unti=mm', someMesh, { 'content-type': 'model/obj' }),
    400,
    'unknown-parameter',
    'unti',
  );
  await refuses(service.get(`/v1/jobs?${'x'.repeat(6000)}`), 414, 'uri-too-long');
});

test('JSON that is malformed, no object, doubled, too deep or too large', async () => {
  const layout = (body, headers = { 'content-type': 'application/json' }) => service.post('/v1/layouts', body, headers);
  const field = (body) => service.post('/v1/fields', body, { 'content-type': 'application/json' });
  for (const post of [layout, field]) {
    for (const text of ['', '{', '{"a":1,}', '{"a":\x01}', 'nul', '{"a":1}{', '{"a":"\xff"}'])
      await refuses(post(Buffer.from(text, 'latin1')), 400, 'json-malformed');
    await refuses(post('[]'), 422, 'json-type');
    await refuses(post('{"mesh":"a","mesh":"b"}'), 400, 'json-malformed');
    await refuses(post(`{"a":${'['.repeat(100)}${']'.repeat(100)}}`), 400, 'json-too-deep');
    await refuses(post(`{"a":${'['.repeat(200000)}`), 400, 'json-too-deep');
    await refuses(post(`{"a":"${'x'.repeat(5 << 20)}"}`), 413, 'too-large');
  }
  assert.match((await field('')).json.detail, /the JSON is empty/);
  assert.match((await layout('')).json.detail, /the JSON is empty/);
  const plain = layout('{}', { 'content-type': 'text/plain' });
  const answer = await refuses(plain, 415, 'unsupported-media-type', 'Content-Type');
  assert.match(answer.json.detail, /text\/plain.*application\/json/);
});

test('JSON that is fine but cannot be taken is not called invalid, and bytes that are not UTF-8 are told so', async () => {
  const field = (body, type = 'application/json') => service.post('/v1/fields', body, { 'content-type': type });
  for (const [text, words] of [
    ['{"mesh":"a\\u0000b"}', /NUL/],
    ['{"a\\u0000b":1}', /NUL/],
    ['{"mesh":99999999999999999999}', /number is too large/],
    ['{"mesh":1e400}', /number is too large/],
  ]) {
    const { json } = await refuses(field(text), 422, 'json-value');
    assert.match(json.detail, words);
    assert.doesNotMatch(json.detail, /not valid/);
    assert.match(json.errors[0].place, /^line 1 column \d+$/);
  }
  const little = Buffer.from('\ufeff{"mesh":"a"}', 'utf16le');
  for (const body of [little, little.subarray(2), Buffer.from(little).swap16(), Buffer.from('{"a":"\xe4"}', 'latin1')]) {
    const { json } = await refuses(field(body), 400, 'json-malformed');
    assert.match(json.detail, /send UTF-8/);
    assert.ok(json.errors[0].place);
  }
  for (const charset of ['latin1', 'utf-16', '"iso-8859-1"']) {
    const type = `application/json; charset=${charset}`;
    await refuses(field('{"mesh":"m"}', type), 415, 'unsupported-media-type', 'Content-Type');
  }
  for (const charset of ['utf-8', 'UTF-8', '"Utf-8"'])
    await refuses(field('[]', `application/json; charset=${charset}`), 422, 'json-type');
});

test('a body that would be ignored is refused, whatever it is', async () => {
  const mesh = '/v1/meshes/mesh_x';
  const bodiless = [
    ['POST', '/v1/jobs/redrive'],
    ['POST', '/v1/jobs/job_x/cancel'],
    ['POST', '/v1/jobs/job_x/redrive'],
    ['POST', '/v1/layouts/layout_x/renew'],
    ['POST', '/v1/uploads?part=worn'],
    ['DELETE', mesh],
    ['DELETE', `${mesh}/motions/motion_x`],
    ['DELETE', '/v1/uploads/upload_x'],
  ];
  for (const [method, path] of bodiless) {
    const plain = { body: 'kind=layout', headers: { 'content-type': 'text/plain' } };
    await refuses(service.request(method, path, plain), 400, 'body-not-allowed');
    await refuses(service.request(method, path, { body: {} }), 400, 'body-not-allowed');
    const head = `${method} ${path} HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n`;
    assert.match(await raw(`${head}2\r\n{}\r\n0\r\n\r\n`), /^HTTP\/1.1 400 [^]*body-not-allowed/);
    assert.doesNotMatch(await raw(`${head}0\r\n\r\n`), /body-not-allowed/);
  }
  assert.equal((await service.post('/v1/jobs/redrive', '')).status, 200);
});

test('one rule for names: at most 200 bytes, no control characters', async () => {
  const long = 'x'.repeat(201);
  const queries = ['%1b', 'a%0ab', '%7f', long, 'x'.repeat(3000)];
  for (const name of queries) {
    const raw = { 'content-type': 'model/obj' };
    await refuses(service.post(`/v1/meshes?name=${name}`, someMesh, raw), 400, 'invalid-parameter', 'name');
    await refuses(service.post(`/v1/meshes/m/motions?name=${name}`, someMesh, raw), 400, 'invalid-parameter', 'name');
    await refuses(service.post(`/v1/uploads?part=worn&name=${name}`), 400, 'invalid-parameter', 'name');
  }
  for (const name of ['a\nb', '\u001b', long]) {
    await refuses(service.post('/v1/fields', { mesh: 'm', name }), 422, 'json-value', '/name');
    await refuses(service.post('/v1/rig/recordings', { duration_s: 1, name }), 422, 'json-value', '/name');
    const terminals = [{ vertex: 0, name }];
    await refuses(service.post('/v1/layouts', { field: 'f', terminals }), 422, 'json-value', '/terminals/0/name');
  }
  const { json } = await refuses(service.get('/v1/jobs?kind=a%00'), 400, 'malformed-query', 'kind');
  assert.match(json.detail, /NUL/);
  const made = await service.post(`/v1/meshes?name=${'%C3%A4'.repeat(98)}.obj`, someMesh, { 'content-type': 'model/obj' });
  assert.equal(made.json.name, `${'ä'.repeat(98)}.obj`, made.text);
});

test('fields of a request that are unknown, missing or of the wrong type are named', async () => {
  const field = (body) => service.post('/v1/fields', body);
  await refuses(field({ mesh: 'm', motions: [], colour: 1 }), 422, 'json-unknown-field', '/colour');
  await refuses(field({ motions: [] }), 422, 'json-missing-field', '/mesh');
  await refuses(field({ mesh: 7, motions: [] }), 422, 'json-type', '/mesh');
  await refuses(field({ mesh: 'm', motions: 'all' }), 422, 'json-type', '/motions');
  await refuses(field({ mesh: 'm', motions: ['a', 3] }), 422, 'json-type', '/motions/1');
  await refuses(field({ mesh: 'm', motions: ['a', 'a'] }), 422, 'motion-twice', '/motions/1');
  await refuses(field({ mesh: 'm', motions: [], options: { eta_mpa: -1 } }), 422, 'option-value', '/options/eta_mpa');
  await refuses(field({ mesh: 'm', motions: [], options: { etta: 1 } }), 422, 'json-unknown-field', '/options/etta');
  await refuses(field({ mesh: 'm', motions: [] }), 422, 'no-such-mesh', '/mesh');
  const layout = (body) => service.post('/v1/layouts', body);
  await refuses(layout({ field: 'f' }), 422, 'json-missing-field', '/terminals');
  await refuses(layout({ terminals: [{ vertex: 1 }] }), 422, 'json-missing-field', '/field');
  await refuses(layout({ field: 'f', terminals: [{ vertex: -1 }] }), 422, 'json-type', '/terminals/0/vertex');
  await refuses(layout({ field: 'f', terminals: [{ vertex: 1 }] }), 422, 'no-such-field', '/field');
  await refuses(layout({ field: 'f', terminals: [{ vertex: 1 }], x: 1 }), 422, 'json-unknown-field', '/x');
  await refuses(service.post('/v1/rig/recordings', { duration_s: 0 }), 422, 'option-value', '/duration_s');
  await refuses(service.post('/v1/rig/recordings', { name: 3 }), 422, 'json-type', '/name');
});

test('an upload that is empty, of a wrong type or too large', async () => {
  await refuses(mesh(''), 422, 'upload-empty');
  await refuses(
    service.post('/v1/meshes', '{}', { 'content-type': 'application/json' }),
    415,
    'unsupported-media-type',
  );
  await refuses(service.post('/v1/meshes', 'x', { 'content-type': 'obj' }), 400, 'malformed-header');
  await refuses(mesh(Buffer.alloc(65 << 20)), 413, 'too-large', 'Content-Length').catch((error) => {
    // The service may close before all is sent; the client library then sees only that.
    if (error.cause?.code !== 'EPIPE' && error.cause?.code !== 'ECONNRESET') throw error;
  });
});

test('a body that claims 5 GB is refused before it is sent', async () => {
  for (const [path, type] of [
    ['/v1/meshes', 'model/obj'],
    ['/v1/meshes/x/motions', 'application/octet-stream'],
    ['/v1/layouts', 'application/json'],
  ])
    assert.match(
      await raw(`POST ${path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: ${type}\r\nContent-Length: 5368709120\r\n\r\n`),
      /^HTTP\/1.1 413 [^]*"type":"urn:tightwire:problem:too-large"/,
    );
  const back = await raw('POST /v1/meshes HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999999\r\n\r\n');
  assert.match(back, /^HTTP\/1.1 (400|413) /);
});

test('a head that says twice where its body ends is refused, and its connection closed', async () => {
  for (const framing of [
    'Content-Length: 5\r\nContent-Length: 7',
    'Content-Length: 5\r\nContent-Length: 5',
    'Transfer-Encoding: chunked\r\nContent-Length: 5',
    'Content-Length: 5\r\nTransfer-Encoding: chunked',
    'Transfer-Encoding: gzip, chunked',
    'Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked',
  ]) {
    const hidden = 'GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n';
    const back = await raw(`POST /v1/layouts HTTP/1.1\r\nHost: localhost\r\n${framing}\r\n\r\n${hidden}`);
    assert.match(back, /^HTTP\/1.1 400 [^]*Connection: close[^]*"urn:tightwire:problem:malformed-header"/, framing);
    assert.equal(back.match(/HTTP\/1.1 /g).length, 1, framing);
  }
});

test('names are text: a query that is not UTF-8 is refused, a file name that is not is replaced', async () => {
  const named = service.post('/v1/meshes?name=%FF%FE', someMesh, { 'content-type': 'model/obj' });
  await refuses(named, 400, 'malformed-query');
  const form = Buffer.concat([
    Buffer.from('--b\r\nContent-Disposition: form-data; name="worn"; filename="M'),
    Buffer.from([0xe4]),
    Buffer.from(`ntel.obj"\r\n\r\n${someMesh}\r\n--b--\r\n`),
  ]);
  const made = await service.post('/v1/meshes', form, { 'content-type': 'multipart/form-data; boundary=b' });
  assert.equal(made.status, 202, made.text);
  assert.equal(made.json.name, 'M?ntel.obj');
});

test('a pointer escapes what a member is called', async () => {
  const body = { field: 'f', terminals: [{ vertex: 1 }], 'a/b~c': 1 };
  await refuses(service.post('/v1/layouts', body), 422, 'json-unknown-field', '/a~1b~0c');
  const field = { mesh: 'm', motions: [], options: { 'x/y': 1 } };
  await refuses(service.post('/v1/fields', field), 422, 'json-unknown-field', '/options/x~1y');
});

test('a client that asks before it sends gets the answer at once', async () => {
  const expect = 'Host: localhost\r\nExpect: 100-continue\r\n';
  assert.match(await raw(`POST /v1/meshes HTTP/1.1\r\n${expect}Content-Length: 5368709120\r\n\r\n`), /^HTTP\/1.1 413 /);
  assert.match(await raw(`POST /v1/nothing HTTP/1.1\r\n${expect}Content-Length: 10\r\n\r\n`), /^HTTP\/1.1 404 /);
  assert.match(
    await raw(`POST /v1/fields HTTP/1.1\r\n${expect}Content-Type: application/json\r\nContent-Length: 10\r\n\r\n`),
    /^HTTP\/1.1 100 /,
  );
});

test('a chunked upload above the limit is refused, one below is taken', async () => {
  const chunks = (count, size = 1 << 20) =>
    new ReadableStream({
      pull: (controller) => (count-- > 0 ? controller.enqueue(new Uint8Array(size).fill(65)) : controller.close()),
    });
  const post = (body) =>
    service.post('/v1/meshes?name=b.obj', body, { 'content-type': 'model/obj' }, { duplex: 'half' });
  await refuses(post(chunks(70)), 413, 'upload-too-large');
  assert.equal((await post(chunks(3))).status, 202);
});

test('forms: parts that are unknown, twice or missing; bodies that are cut', async () => {
  const form = (parts) => {
    const data = new FormData();
    for (const [name, text] of parts) data.append(name, new Blob([text]), `${name}.obj`);
    return service.post('/v1/meshes', data);
  };
  await refuses(
    form([
      ['worn', someMesh],
      ['hat', someMesh],
    ]),
    422,
    'unknown-part',
    'hat',
  );
  await refuses(
    form([
      ['worn', someMesh],
      ['worn', someMesh],
    ]),
    422,
    'part-twice',
    'worn',
  );
  await refuses(form([['pattern', someMesh]]), 422, 'missing-part', 'worn');
  await refuses(form([['worn', '']]), 422, 'upload-empty', 'part worn');
  const cut = (body, type = 'multipart/form-data; boundary=b') =>
    service.post('/v1/meshes', body, { 'content-type': type });
  await refuses(cut('--b\r\nContent-Disposition: form-data; name="worn"\r\n\r\nv 0'), 400, 'malformed-multipart');
  await refuses(cut('hello'), 400, 'malformed-multipart');
  await refuses(cut(`--b\r\nX: ${'y'.repeat(5000)}`), 400, 'malformed-multipart');
  await refuses(cut('x', 'multipart/form-data'), 400, 'malformed-header');
  const good = await form([
    ['worn', someMesh],
    ['pattern', someMesh],
  ]);
  assert.equal(good.status, 202);
  assert.equal(good.json.name, 'worn.obj');
  const { json } = await service.get(good.headers.get('location'));
  assert.deepEqual(
    json.uploads.map((upload) => [upload.name, upload.file_name, upload.size_bytes]),
    [
      ['worn', 'worn.obj', someMesh.length],
      ['pattern', 'pattern.obj', someMesh.length],
    ],
  );
});

test('equal uploads are the same mesh; other options make another', async () => {
  const first = await mesh(someMesh + '# 1\n');
  const again = await mesh(someMesh + '# 1\n');
  assert.equal(again.json.id, first.json.id);
  const inches = await service.post('/v1/meshes?name=a.obj&unit=cm', someMesh + '# 1\n', {
    'content-type': 'model/obj',
  });
  assert.notEqual(inches.json.id, first.json.id);
  assert.equal(inches.json.options.unit, 'cm');
  assert.equal(first.headers.get('location'), `/v1/meshes/${first.json.id}`);
});

test('results of an unfinished mesh are a conflict, and a used mesh is not deleted by accident', async () => {
  const { json } = await mesh(someMesh + '# 2\n');
  await refuses(service.get(`/v1/meshes/${json.id}/arrays/position`), 409, 'not-computed');
  const motion = await service.post(`/v1/meshes/${json.id}/motions?name=walk.pc2`, 'POINTCACHE2', {
    'content-type': 'application/octet-stream',
  });
  assert.equal(motion.json.mesh, json.id);
  const other = await mesh(someMesh + '# 3\n');
  await refuses(service.get(`/v1/meshes/${other.json.id}/motions/${motion.json.id}`), 404, 'no-such-resource');
  await refuses(
    service.post('/v1/fields', { mesh: other.json.id, motions: [motion.json.id] }),
    422,
    'no-such-motion',
    '/motions/0',
  );
  await refuses(service.delete(`/v1/meshes/${json.id}`), 409, 'resource-in-use');
  await refuses(service.delete(`/v1/meshes/${json.id}?dependents=maybe`), 400, 'invalid-parameter');
  assert.equal((await service.delete(`/v1/meshes/${json.id}?dependents=true`)).status, 204);
  await refuses(service.get(`/v1/meshes/${json.id}`), 404, 'no-such-resource');
  await refuses(service.get(`/v1/meshes/${other.json.id}/motions/${motion.json.id}`), 404, 'no-such-resource');
});

test('a list pages by cursor and Link, and does not shift when something is added', async () => {
  const seen = [];
  for (let i = 0; i < 7; i++) await service.post('/v1/rig/recordings', { name: `page ${i}` });
  let path = '/v1/rig/recordings?limit=3&state=queued,running';
  while (path) {
    const { json, headers } = await service.get(path);
    assert.ok(json.items.length <= 3);
    seen.push(...json.items.map((item) => item.name));
    assert.equal(headers.get('link'), json.next && `<${json.next}>; rel="next"`);
    path = json.next;
    if (seen.length === 3) await service.post('/v1/rig/recordings', { name: 'late' });
  }
  assert.deepEqual(
    seen,
    [6, 5, 4, 3, 2, 1, 0].map((i) => `page ${i}`),
  );
});

test('Prefer: wait holds the connection for so long and no longer', async () => {
  const start = Date.now();
  const answer = await service.post(
    '/v1/rig/recordings',
    { name: 'nobody records' },
    { prefer: 'respond-async, wait=1' },
  );
  assert.equal(answer.status, 202);
  assert.equal(answer.headers.get('preference-applied'), 'wait=1');
  assert.ok(Date.now() - start >= 950 && Date.now() - start < 3000);
});

test('a held connection is answered as soon as its job has ended', async () => {
  const held = service.post('/v1/rig/recordings', { name: 'to be cancelled' }, { prefer: 'wait=20' });
  await sleep(200);
  const { json } = await service.get('/v1/rig/recordings?limit=1');
  const start = Date.now();
  const cancelled = await service.post(`/v1/jobs/${json.items[0].job.id}/cancel`);
  assert.equal(cancelled.json.state, 'cancelled');
  const answer = await held;
  assert.equal(answer.status, 200);
  assert.equal(answer.json.state, 'cancelled');
  assert.ok(Date.now() - start < 1000);
  await refuses(service.post(`/v1/jobs/${json.items[0].job.id}/cancel`), 409, 'job-finished');
  const redriven = await service.post(`/v1/jobs/${json.items[0].job.id}/redrive`);
  assert.equal(redriven.json.state, 'queued');
  await refuses(service.post(`/v1/jobs/${json.items[0].job.id}/redrive`), 409, 'job-not-failed');
});

test('jobs are redriven in bulk by kind, state and problem', async () => {
  const ids = [];
  for (let i = 0; i < 5; i++) {
    const { json } = await service.post('/v1/rig/recordings', { name: `bulk ${i}` });
    await service.post(`/v1/jobs/${json.job.id}/cancel`);
    ids.push(json.job.id);
  }
  const redrive = (query) => service.post(`/v1/jobs/redrive${query}`);
  const stateOf = async (id) => (await service.get(`/v1/jobs/${id}`)).json.state;
  // Cancelled jobs only where it says so; a kind and a problem that none of them has find none.
  for (const query of ['?kind=record', '?state=cancelled&kind=compute_field', '?state=cancelled&problem=store-full']) {
    const { status, json } = await redrive(query);
    assert.equal(status, 200);
    assert.deepEqual(json, { redriven: 0, more: false });
  }
  for (const id of ids) assert.equal(await stateOf(id), 'cancelled');
  const listed = await service.get('/v1/jobs?problem=urn:tightwire:problem:store-full');
  assert.deepEqual(listed.json.items, []);
  const { json } = await redrive('?state=failed,cancelled&kind=record');
  assert.ok(json.redriven >= 5);
  assert.equal(json.more, false);
  for (const id of ids) assert.equal(await stateOf(id), 'queued');
  await refuses(redrive('?state=queued'), 400, 'invalid-parameter');
  await refuses(redrive('?state=failed,running'), 400, 'invalid-parameter');
  const paint = await redrive('?kind=compute_lay');
  assert.equal(paint.status, 400);
  assert.match(paint.json.detail, /did you mean compute_layout\?.*import_mesh, import_motion, compute_field/);
  const lost = await service.get('/v1/jobs?state=queued,faild');
  assert.equal(lost.status, 400);
  assert.match(lost.json.detail, /no state "faild"; did you mean failed\?.*incomplete/);
  await refuses(redrive('?limit=3'), 400, 'unknown-parameter');
});

test('a hundred held connections leave the service free for others', async () => {
  const held = Array.from({ length: 100 }, (_, i) =>
    service.post('/v1/rig/recordings', { name: `held ${i}` }, { prefer: 'wait=3' }),
  );
  await sleep(500);
  const start = Date.now();
  for (let i = 0; i < 20; i++) await service.get('/livez');
  assert.ok(Date.now() - start < 1500);
  for (const answer of await Promise.all(held)) assert.equal(answer.status, 202);
});

test('events: the state now, then each change, to the end', async () => {
  const { json } = await service.post('/v1/rig/recordings', { name: 'watched' });
  const response = await fetch(`${service.url}/v1/jobs/${json.job.id}/events`);
  assert.equal(response.headers.get('content-type'), 'text/event-stream');
  const text = response.text();
  await sleep(300);
  await service.post(`/v1/jobs/${json.job.id}/cancel`);
  const events = (await text)
    .trim()
    .split('\n\n')
    .map((event) => Object.fromEntries(event.split('\n').map((line) => line.split(/: (.*)/s))));
  assert.deepEqual(
    events.map((event) => JSON.parse(event.data).state),
    ['queued', 'cancelled'],
  );
  for (const { id } of events) assert.match(id, /^[0-9a-f]{16}$/); // tells nothing of what others do
  assert.equal(new Set(events.map(({ id }) => id)).size, events.length);
});

test('a request id of the client is kept, a forged one is not', async () => {
  assert.equal(
    (await service.get('/livez', { headers: { 'x-request-id': 'order-17.3' } })).headers.get('x-request-id'),
    'order-17.3',
  );
  const made = (await service.get('/livez', { headers: { 'x-request-id': 'a b"c' } })).headers.get('x-request-id');
  assert.match(made, /^[0-9a-f]{16}$/);
});

test('If-None-Match saves the body of what has not changed', async () => {
  const { headers } = await service.get('/v1/rig');
  const again = await service.get('/v1/rig', { headers: { 'if-none-match': `"x", W/${headers.get('etag')}` } });
  assert.equal(again.status, 304);
  assert.equal((await service.get('/v1/rig', { headers: { 'if-none-match': '"x"' } })).status, 200);
});

test('an order of a recording reads as JSON and as CSV from the start', async () => {
  const { json } = await service.post('/v1/rig/recordings', { name: 'empty', duration_s: 2.5 });
  assert.equal(json.options.duration_s, 2.5);
  assert.deepEqual((await service.get(`${json.href}/samples`)).json, { items: [], next: null });
  const csv = await service.get(`${json.href}/samples.csv`);
  assert.equal(csv.text.split('\n')[0].split(',').length, 25);
});

test('a name that is none gets the one that was meant, and all there are', async () => {
  const terminals = [{ vertex: 1 }];
  for (const [promise, words] of [
    [service.post('/v1/layouts', { field: 'f', terminals, options: { time_limit: 1 } }), /^no option "time_limit"; did you mean time_limit_s\? There are: /],
    [service.post('/v1/layouts', { field: 'f', terminal: terminals }), /did you mean terminals\? There are: field, terminals, options and constraints$/],
    [service.post('/v1/layouts', { field: 'f', terminals: [{ vertx: 1 }] }), /did you mean vertex\?/],
    [service.post('/v1/layouts', { field: 'f', terminals, constraints: { keepout: [] } }), /did you mean keep_out\?/],
    [service.post('/v1/fields', { mesh: 'm', motion: [] }), /did you mean motions\? There are: mesh, motions, name and options$/],
    [service.post('/v1/fields', { mesh: 'm', motions: [], options: { strip_width: 9 } }), /did you mean strip_width_mm\?/],
    [service.post('/v1/meshes?units=cm', someMesh, { 'content-type': 'model/obj' }), /^no query parameter "units"; did you mean unit\?/],
    [service.get('/v1/jobs?stat=queued'), /did you mean state\? There are: /],
    [service.get('/v1/rig?x=1'), /^no query parameter "x"; there is none here; leave it out$/],
    [service.request('POST', '/v1/uploads?part=warn'), /did you mean worn\? There are: worn, pattern and motion$/],
  ]) {
    const { json, status } = await promise;
    assert.ok(status === 400 || status === 422, JSON.stringify(json));
    assert.match(json.detail, words);
  }
});

test('5.0 is the integer 5, and a byte order mark is skipped', async () => {
  const json = { 'content-type': 'application/json' };
  const field = await service.post('/v1/layouts', '\uFEFF{"field":"f","terminals":[{"vertex":5.0},{"face":1e0,"barycentric":[1,0,0]}]}', json);
  await refuses(Promise.resolve(field), 422, 'no-such-field');
  await refuses(service.post('/v1/layouts', '{"field":"f","terminals":[{"vertex":5.5}]}', json), 422, 'json-type', '/terminals/0/vertex');
});

// What a browser would send for a page: with Origin, and with a Host of the page's own where its name resolves to us.
test('a page of another origin drives nothing, whatever it asks', async () => {
  const port = new URL(service.url).port;
  const before = (await service.get('/v1/jobs?limit=1000')).json.items.length;
  for (const [path, methods] of Object.entries(openapi.paths))
    for (const method of Object.keys(methods)) {
      const line = `${method.toUpperCase()} ${path.replace(/\{\w+\}/g, 'x')} HTTP/1.1\r\n`;
      const body = 'Content-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}';
      const evil = await raw(`${line}Host: localhost:${port}\r\nOrigin: https://evil.example\r\n${body}`);
      assert.match(evil, /^HTTP\/1.1 403 [^]*problem:foreign-origin/, line);
      assert.doesNotMatch(evil, /Access-Control-Allow-Origin: https:\/\/evil/);
      const rebound = await raw(`${line}Host: evil.example:${port}\r\nOrigin: http://evil.example:${port}\r\n${body}`);
      assert.match(rebound, /^HTTP\/1.1 421 [^]*problem:unknown-host/, line);
    }
  const preflight = await raw(`OPTIONS /v1/layouts HTTP/1.1\r\nHost: localhost\r\nOrigin: https://evil.example\r\nConnection: close\r\n\r\n`);
  assert.match(preflight, /^HTTP\/1.1 403 /);
  const own = `POST /v1/rig/recordings HTTP/1.1\r\nHost: localhost:${port}\r\nContent-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n`;
  assert.equal((await service.get('/v1/jobs?limit=1000')).json.items.length, before);
  assert.match(await raw(`${own}Origin: http://localhost:${port}\r\n\r\n{}`), /^HTTP\/1.1 202 /);
  assert.match(await raw(`${own}Origin: https://studio.example\r\n\r\n{}`), /^HTTP\/1.1 202 /);
});

test('rubbish on the socket does no harm', async () => {
  for (const text of [
    '\0\0\0\0',
    'GET',
    'GET / HTTP/9.9\r\n\r\n',
    'GET /livez HTTP/1.1\r\nHost: localhost\r\nBad Header\r\n\r\n',
    `GET /livez HTTP/1.1\r\nHost: localhost\r\nX: ${'y'.repeat(100000)}\r\n\r\n`,
    'POST /v1/fields HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n',
    `GET /${'a'.repeat(100000)} HTTP/1.1\r\n\r\n`,
  ])
    await raw(text);
  assert.equal((await service.get('/livez')).status, 200);
});

test('metrics are Prometheus text that counts what was asked', async () => {
  const { text, headers } = await service.get('/metrics');
  assert.match(headers.get('content-type'), /^text\/plain; version=0\.0\.4/);
  for (const line of text.trim().split('\n'))
    assert.match(line, /^(# (HELP|TYPE) tightwire_\w+ .+|tightwire_\w+(\{.*\})? [0-9.e+-]+)$/);
  assert.match(text, /tightwire_http_requests_total\{method="POST",route="\/v1\/fields",status="4xx"\} \d+/);
  assert.match(text, /tightwire_jobs\{state="queued"\} \d+/);
});
