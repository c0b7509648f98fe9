// Uploads that are cut off and continued.
import { test } from 'node:test';
import assert from 'node:assert/strict';
import { request } from 'node:http';
import { Service, until } from './service.mjs';

const MIB = 1 << 20;

// A square as OBJ, made large by comments.
const large = () => {
  const lines = ['v 0 0 0', 'v 100 0 0', 'v 100 100 0', 'v 0 100 0', 'vt 0 0', 'vt 100 0', 'vt 100 100', 'vt 0 100'];
  for (let i = 0; i < 60000; i++) lines.push(`# line ${i} of what a garment program likes to remark on its files`);
  return Buffer.from([...lines, 'f 1/1 2/2 3/3', 'f 1/1 3/3 4/4', ''].join('\n'));
};

// Sends `bytes` of an announced longer body, then breaks the connection.
const breakOff = (service, path, offset, bytes, announced) =>
  new Promise((done) => {
    const { hostname, port } = new URL(service.url);
    const call = request({ hostname, port, path, method: 'PATCH', headers: { 'upload-offset': offset, 'content-length': announced } });
    call.on('error', () => done());
    call.write(bytes, () => setTimeout(() => { call.destroy(); done(); }, 200));
  });

test('an upload that was cut off goes on where it was, and is the same mesh', async () => {
  const service = await Service.start();
  try {
    const bytes = large();
    assert.ok(bytes.length > 3 * MIB);
    const whole = await service.request('POST', '/v1/meshes?name=square.obj', { body: bytes, headers: { 'content-type': 'model/obj' } });
    assert.equal(whole.status, 202);

    const begun = await service.request('POST', '/v1/uploads?part=worn&name=square.obj');
    assert.equal(begun.status, 201);
    const path = begun.headers.get('location');
    await breakOff(service, path, 0, bytes.subarray(0, 2 * MIB + 5000), bytes.length);
    const state = await until('two chunks are kept', async () => {
      const answer = await service.request('GET', path);
      return answer.json.received_bytes === 2 * MIB && answer;
    });
    assert.equal(state.json.complete, false);
    assert.equal(state.headers.get('upload-offset'), String(2 * MIB));

    const patch = (offset, body, headers) => service.request('PATCH', path, { body, headers: { 'upload-offset': String(offset), 'content-type': 'application/octet-stream', ...headers } });
    const wrong = await patch(MIB, bytes.subarray(MIB));
    assert.equal(wrong.status, 409);
    assert.match(wrong.json.type, /upload-offset$/);
    assert.match(wrong.json.detail, new RegExp(String(2 * MIB)));
    const early = await service.request('POST', `/v1/meshes?worn=${begun.json.id}`);
    assert.match(early.json.type, /upload-not-sealed$/);

    const more = await patch(2 * MIB, bytes.subarray(2 * MIB, 3 * MIB));
    assert.deepEqual([more.status, more.json.received_bytes, more.json.complete], [200, 3 * MIB, false]);
    const last = await patch(3 * MIB, bytes.subarray(3 * MIB), { 'upload-complete': '?1' });
    assert.deepEqual([last.status, last.json.received_bytes, last.json.complete], [200, bytes.length, true]);
    assert.equal((await patch(bytes.length, 'x')).status, 409);

    const misused = await service.request('POST', `/v1/meshes/${whole.json.id}/motions?motion=${begun.json.id}`);
    assert.match(misused.json.type, /upload-part$/);
    const mesh = await service.request('POST', `/v1/meshes?worn=${begun.json.id}&name=square.obj`);
    assert.equal(mesh.json.id, whole.json.id);
    assert.equal((await service.request('GET', path)).status, 404);
  } finally {
    await service.stop();
  }
});

test('an upload is refused without its part, without an offset, and when it is not there', async () => {
  const service = await Service.start();
  try {
    assert.match((await service.request('POST', '/v1/uploads')).json.type, /unknown-part$/);
    assert.match((await service.request('POST', '/v1/uploads?part=trousers')).json.type, /unknown-part$/);
    assert.equal((await service.request('GET', '/v1/uploads/upload_none')).status, 404);
    const { headers } = await service.request('POST', '/v1/uploads?part=motion&name=walk.pc2');
    const path = headers.get('location');
    for (const headers of [{}, { 'upload-offset': '-1' }, { 'upload-offset': '0', 'upload-complete': 'yes' }])
      assert.match((await service.request('PATCH', path, { body: 'x', headers })).json.type, /malformed-header$/);
    assert.equal((await service.request('DELETE', path)).status, 204);
    assert.equal((await service.request('DELETE', path)).status, 404);
    const gone = await service.request('POST', '/v1/meshes?worn=upload_none');
    assert.match(gone.json.type, /no-such-upload$/);
  } finally {
    await service.stop();
  }
});
