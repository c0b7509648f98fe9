// Keys × tenants × scopes × objects × methods: every route of the service's own table, by every kind of key, on what is
// the key's own, what is another tenant's, and what does not exist. The oracle for what is another's is what does not
// exist: the two answers must be the same bytes.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { randomBytes } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { Agent, request as httpRequest } from 'node:http';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Service, build, checkContract, run, sleep, temporaryFolder } from './service.mjs';

const routes = JSON.parse(execFileSync(join(build, 'tests/tools/contract'))).routes;
const scopes = ['read', 'submit', 'rig', 'admin'];
const tenants = ['default', 'mill', 'weaver'];
const folder = temporaryFolder();
const agent = new Agent({ keepAlive: true });
let service;
const keys = {}; // tenant -> scope or "all" -> secret
const things = {}; // tenant -> ids of one of each
const made = []; // every id that anybody made: { id, tenant }

before(async () => {
  run('sample', '--out', join(folder.path, 'suit'), '--vertices', '3000');
  const store = `sqlite:${join(folder.path, 'store.db')}`;
  const make = (tenant, name, ...flags) =>
    run('key', 'create', '--store', store, '--tenant', tenant, '--name', name, '--json', ...flags);
  for (const tenant of tenants) {
    keys[tenant] = { all: JSON.parse(make(tenant, 'all', '--scopes', scopes.join())).secret };
    for (const scope of scopes) keys[tenant][scope] = JSON.parse(make(tenant, scope, '--scopes', scope)).secret;
  }
  keys.expired = JSON.parse(make('mill', 'expired', '--scopes', scopes.join(), '--expires', '1s')).secret;
  keys.revoked = JSON.parse(make('mill', 'revoked', '--scopes', scopes.join())).secret;
  run('key', 'revoke', '--store', store, '--tenant', 'mill', '--name', 'revoked');
  service = await Service.start({ store, workers: 2, 'worker-threads': 1, 'connections-per-address': 1000 });
  for (const tenant of tenants) things[tenant] = await makeThings(tenant);
  await sleep(1000); // the expired key has expired
});
after(async () => {
  agent.destroy();
  await service?.stop();
  folder.remove();
});

// From an address of its own where the key is wrong: wrong keys of one address are answered late.
let strangers = 0;
function ask(key, method, path, { body, headers = {}, stranger = false } = {}) {
  const isJson = body && Object.getPrototypeOf(body) === Object.prototype;
  const bytes = isJson ? JSON.stringify(body) : (body ?? '');
  const all = { 'x-request-id': 'same', ...headers };
  if (key) all.authorization = `Bearer ${key}`;
  if (isJson) all['content-type'] = 'application/json';
  if (bytes.length) all['content-length'] = Buffer.byteLength(bytes);
  const options = { method, headers: all, agent: stranger ? undefined : agent };
  if (stranger) {
    strangers++;
    options.localAddress = `127.7.${strangers >> 8}.${1 + (strangers & 127)}`;
  }
  return new Promise((done, fail) => {
    const sent = httpRequest(service.url + path, options, (response) => {
      const parts = [];
      response.on('data', (part) => parts.push(part));
      response.on('end', () => {
        const text = Buffer.concat(parts).toString();
        const type = response.headers['content-type']?.split(';')[0] ?? '';
        const json = /json$/.test(type) && text ? JSON.parse(text) : undefined;
        try {
          checkContract(method, path, response.statusCode, type, json);
        } catch (error) {
          fail(error);
        }
        done({ status: response.statusCode, headers: response.headers, text, json });
      });
      response.on('error', fail);
    });
    sent.on('error', fail);
    sent.end(bytes);
  });
}

const suit = (...parts) => readFileSync(join(folder.path, 'suit', ...parts));
const wait = { prefer: 'wait=60' };

async function created(tenant, path, body, headers = {}) {
  const answer = await ask(keys[tenant].all, 'POST', path, { body, headers });
  assert.ok([200, 201, 202].includes(answer.status), `${path}: ${answer.text}`);
  made.push({ id: answer.json.id, tenant });
  if (answer.json.job) made.push({ id: answer.json.job.id, tenant });
  return answer.json;
}

const terminals = () => JSON.parse(suit('terminals', 'joints10.json'));
const newLayout = (tenant, field) => created(tenant, '/v1/layouts', { ...terminals(), field });
const newRecording = (tenant) => created(tenant, '/v1/rig/recordings', { duration_s: 1 });
const newUpload = (tenant) => created(tenant, '/v1/uploads?part=worn');
const newKey = (tenant) => created(tenant, '/v1/keys', { name: randomBytes(8).toString('hex'), scopes: ['read'] });

// The same content in every tenant.
async function makeThings(tenant) {
  const object = { 'content-type': 'model/obj', ...wait };
  const cache = { 'content-type': 'application/octet-stream', ...wait };
  const mesh = await created(tenant, '/v1/meshes?name=suit.obj', suit('suit.obj'), object);
  assert.equal(mesh.state, 'succeeded');
  const motion = await created(tenant, `/v1/meshes/${mesh.id}/motions?name=walk`, suit('motions/walk.pc2'), cache);
  const field = await created(tenant, '/v1/fields', { mesh: mesh.id, motions: [motion.id] }, wait);
  const layout = await created(tenant, '/v1/layouts', { ...terminals(), field: field.id }, wait);
  assert.equal(layout.state, 'succeeded', JSON.stringify(layout.problem));
  return {
    mesh: mesh.id,
    motion: motion.id,
    field: field.id,
    layout: layout.id,
    job: layout.job.id,
    recording: (await newRecording(tenant)).id,
    upload: (await newUpload(tenant)).id,
    key: (await newKey(tenant)).id,
  };
}

// Ids of the same form that nobody has. What there is is the same as with the thing itself.
const nowhere = (thing) =>
  Object.fromEntries(
    Object.entries(thing).map(([kind, id]) => [kind, id.replace(/_.*/, (tail) => `_${'z'.repeat(tail.length - 1)}`)]),
  );

// --- a row for every route --------------------------------------------------------------------------------------
// own: what a key that may answers on its own things (GET: 200). needs: scopes that do on these things, where the
// route's depend on the kind of job. fresh: things of which the request takes one away. body, headers, query of things.

const octets = { 'content-type': 'application/octet-stream' };
const rows = {
  'GET /livez': {},
  'GET /readyz': {},
  'GET /metrics': {},
  'GET /openapi.yaml': {},
  'POST /v1/uploads': { query: () => '?part=worn', own: [201] },
  'GET /v1/uploads/{upload}': {},
  'PATCH /v1/uploads/{upload}': { headers: { ...octets, 'upload-offset': '0' }, body: () => 'v 0 0 0\n', own: [200] },
  'DELETE /v1/uploads/{upload}': { own: [204], fresh: async (tenant) => ({ upload: (await newUpload(tenant)).id }) },
  'GET /v1/meshes': {},
  'POST /v1/meshes': { headers: { 'content-type': 'model/obj' }, body: () => 'v 0 0 0\n', own: [200, 202] },
  'GET /v1/meshes/{mesh}': {},
  'DELETE /v1/meshes/{mesh}': { own: [409] },
  'GET /v1/meshes/{mesh}/arrays/{array}': { array: 'position' },
  'GET /v1/meshes/{mesh}/motions': {},
  'POST /v1/meshes/{mesh}/motions': { headers: octets, body: () => 'no motion', own: [200, 202] },
  'GET /v1/meshes/{mesh}/motions/{motion}': {},
  'DELETE /v1/meshes/{mesh}/motions/{motion}': { own: [409] },
  'GET /v1/meshes/{mesh}/motions/{motion}/arrays/{array}': { array: 'nothing', own: [404], type: 'no-such-blob' },
  'GET /v1/fields': {},
  'POST /v1/fields': { body: ({ mesh, motion }) => ({ mesh, motions: [motion] }), own: [200, 202], foreign: 422 },
  'GET /v1/fields/{field}': {},
  'DELETE /v1/fields/{field}': { own: [409] },
  'GET /v1/fields/{field}/arrays/{array}': { array: 'weight' },
  'GET /v1/layouts': {},
  'POST /v1/layouts': { body: ({ field }) => ({ ...terminals(), field }), own: [202], foreign: 422 },
  'GET /v1/layouts/{layout}': {},
  'DELETE /v1/layouts/{layout}': {
    own: [204],
    fresh: async (tenant) => ({ layout: (await newLayout(tenant, things[tenant].field)).id }),
  },
  'POST /v1/layouts/{layout}/renew': { own: [200] },
  'GET /v1/layouts/{layout}/{artifact}': { artifact: 'pattern.svg' },
  'GET /v1/jobs': {},
  'POST /v1/jobs/cancel': { query: () => '?older_than=366d', own: [200] },
  'POST /v1/jobs/redrive': { own: [200] },
  'GET /v1/jobs/{job}': {},
  'GET /v1/jobs/{job}/events': {},
  'POST /v1/jobs/{job}/cancel': { own: [409], needs: ['submit'] },
  'POST /v1/jobs/{job}/redrive': { own: [409], needs: ['submit'] },
  'GET /v1/rig': {},
  'GET /v1/rig/recordings': {},
  'POST /v1/rig/recordings': { body: () => ({ duration_s: 1 }), own: [202] },
  'GET /v1/rig/recordings/{recording}': {},
  'DELETE /v1/rig/recordings/{recording}': {
    own: [204],
    fresh: async (tenant) => ({ recording: (await newRecording(tenant)).id }),
  },
  'GET /v1/rig/recordings/{recording}/samples': {},
  'GET /v1/rig/recordings/{recording}/samples.csv': {},
  'GET /v1/tenant': {},
  'DELETE /v1/tenant': { own: [400] }, // not confirmed; the deletion itself is below
  'GET /v1/keys': {},
  'POST /v1/keys': { body: () => ({ name: randomBytes(8).toString('hex'), scopes: ['admin'] }), own: [201] },
  'GET /v1/keys/{key}': {},
  'DELETE /v1/keys/{key}': { own: [204], fresh: async (tenant) => ({ key: (await newKey(tenant)).id }) },
  // Who has the scope admin alone may not take over a key that may more.
  'POST /v1/keys/{key}/rotate': { own: [200], needs: [] },
};

const nameOf = (route) => `${route.method} ${route.path}`;
const urnOf = (type) => `urn:tightwire:problem:${type}`;

function fill(route, row, of) {
  const values = { ...of, array: row.array, artifact: row.artifact };
  return route.path.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? assert.fail(`what is {${name}}?`)) + (row.query?.(of) ?? '');
}

const send = (key, route, row, of, more = {}) =>
  ask(key, route.method, fill(route, row, of), { headers: { ...row.headers }, body: row.body?.(of), ...more });

// Whether the request names somebody's things.
const names = (route, row) => /\{/.test(route.path) || row.foreign;

// All that a client can see, but for the ids that it has sent itself.
function seen(answer, of) {
  const { date, ...headers } = answer.headers;
  const blank = (text) => Object.values(of).reduce((all, id) => all.replaceAll(id, 'ID'), text);
  return { status: answer.status, headers: JSON.parse(blank(JSON.stringify(headers))), text: blank(answer.text) };
}

test('every route has a row in this matrix', () => {
  assert.deepEqual(Object.keys(rows).sort(), routes.map(nameOf).sort());
});

const mayUse = (route, row, scope) => scope === 'all' || (row.needs ?? route.scopes).includes(scope);

for (const route of routes) {
  const row = rows[nameOf(route)] ?? {};

  test(`${nameOf(route)}: whoever has no good key is told nothing`, async () => {
    const open = !route.scopes.length;
    const wrong = [undefined, 'x', keys.mill.all.slice(0, -1), keys.expired, keys.revoked];
    for (const key of wrong) {
      const answer = await send(key, route, row, things.mill, { stranger: key !== undefined });
      if (open) assert.equal(answer.status, 200);
      else assert.equal(answer.json.type, urnOf('unauthorized'));
      if (open) continue;
      assert.equal(answer.status, 401);
      const none = await send(key, route, row, nowhere(things.mill), { stranger: key !== undefined });
      assert.deepEqual(seen(answer, things.mill), seen(none, nowhere(things.mill)));
    }
  });

  if (!route.scopes.length) continue;

  test(`${nameOf(route)}: own things, by scope`, async () => {
    for (const tenant of tenants)
      for (const scope of [...scopes, 'all']) {
        const of = { ...things[tenant], ...(mayUse(route, row, scope) ? await row.fresh?.(tenant) : {}) };
        const answer = await send(keys[tenant][scope], route, row, of);
        const what = `${tenant} ${scope}: ${answer.status} ${answer.text.slice(0, 200)}`;
        if (!mayUse(route, row, scope)) {
          assert.equal(answer.status, 403, what);
          assert.equal(answer.json.type, urnOf('missing-scope'));
          const needed = route.path.endsWith('rotate') && scope === 'admin' ? ['read'] : (row.needs ?? route.scopes);
          for (const word of needed) assert.ok(answer.json.detail.includes(word), what);
        } else if (route.operator && tenant !== 'default') {
          assert.equal(answer.status, 403, what);
          assert.equal(answer.json.type, urnOf('operators-only'));
        } else {
          assert.ok((row.own ?? [200]).includes(answer.status), what);
          if (row.type) assert.equal(answer.json.type, urnOf(row.type));
          if (answer.json?.id) made.push({ id: answer.json.id, tenant });
        }
      }
  });

  if (!names(route, row)) continue;

  test(`${nameOf(route)}: what is another tenant's is as what does not exist`, async () => {
    for (const mine of tenants)
      for (const theirs of tenants.filter((tenant) => tenant !== mine))
        for (const scope of [...scopes, 'all']) {
          const key = keys[mine][scope];
          const answer = await send(key, route, row, things[theirs]);
          const none = await send(key, route, row, nowhere(things[theirs]));
          assert.deepEqual(seen(answer, things[theirs]), seen(none, nowhere(things[theirs])));
          // A key of a tenant that is not the thing's is stopped by its scope before anything is looked up.
          const reached = scope === 'all' || route.scopes.includes(scope);
          assert.equal(answer.status, reached ? (row.foreign ?? 404) : 403, `${mine} ${scope} ${answer.text}`);
        }
  });
}

// --- what lists, bodies, hashes and cursors tell ----------------------------------------------------------------

test('HEAD tells what GET tells', async () => {
  for (const route of routes.filter(({ method, path }) => method === 'GET' && !path.endsWith('events'))) {
    const row = rows[nameOf(route)];
    for (const of of [things.mill, things.weaver]) {
      const get = await send(keys.mill.all, route, row, of);
      const head = await send(keys.mill.all, { ...route, method: 'HEAD' }, row, of);
      assert.equal(head.status, get.status, nameOf(route));
      assert.equal(head.text, '');
    }
  }
});

async function pages(key, path, limit) {
  const items = [];
  for (let at = `${path}${path.includes('?') ? '&' : '?'}limit=${limit}`; at; ) {
    const { json, status, text } = await ask(key, 'GET', at);
    assert.equal(status, 200, text);
    items.push(...json.items);
    at = json.next;
  }
  return items;
}

test('lists show all of the own things and nothing else', async () => {
  const lists = ['/v1/meshes', '/v1/fields', '/v1/layouts', '/v1/jobs', '/v1/rig/recordings', '/v1/keys'];
  const all = {};
  for (const tenant of tenants) {
    all[tenant] = new Set();
    for (const list of lists)
      for (const limit of [7, 1000])
        for (const { id } of await pages(keys[tenant].all, list, limit)) all[tenant].add(id);
    for (const { id } of await pages(keys[tenant].all, `/v1/meshes/${things[tenant].mesh}/motions`, 100)) all[tenant].add(id);
  }
  for (const tenant of tenants) {
    for (const kind of ['mesh', 'motion', 'field', 'layout', 'recording', 'job', 'key'])
      assert.ok(all[tenant].has(things[tenant][kind]), `${tenant} ${kind}`);
    for (const { id, tenant: owner } of made)
      if (owner !== tenant) assert.ok(!all[tenant].has(id), `${tenant} sees ${id} of ${owner}`);
  }
});

test('a filter by what is another tenant’s finds as much as one by what does not exist', async () => {
  for (const [list, kind] of [
    ['/v1/fields?mesh=', 'mesh'],
    ['/v1/layouts?field=', 'field'],
  ]) {
    assert.ok((await ask(keys.mill.all, 'GET', list + things.mill[kind])).json.items.length > 0);
    const theirs = await ask(keys.mill.all, 'GET', list + things.weaver[kind]);
    assert.deepEqual(theirs.json, { items: [], next: null });
    const none = await ask(keys.mill.all, 'GET', list + nowhere(things.weaver)[kind]);
    assert.deepEqual(seen(theirs, things.weaver), seen(none, nowhere(things.weaver)));
  }
});

test('uploads, motions and needs of another tenant cannot be made use of', async () => {
  const upload = await newUpload('weaver');
  const sealed = { ...octets, 'upload-offset': '0', 'upload-complete': '?1' };
  const patched = await ask(keys.weaver.all, 'PATCH', `/v1/uploads/${upload.id}`, { body: 'v 1 0 0\n', headers: sealed });
  assert.equal(patched.json.complete, true);
  const none = nowhere({ upload: upload.id }).upload;
  const answers = [];
  for (const id of [upload.id, none]) answers.push(await ask(keys.mill.all, 'POST', `/v1/meshes?worn=${id}`));
  assert.equal(answers[0].status, 422);
  assert.deepEqual(seen(answers[0], { id: upload.id }), seen(answers[1], { id: none }));
  assert.ok([200, 202].includes((await ask(keys.weaver.all, 'POST', `/v1/meshes?worn=${upload.id}`)).status));

  const { mesh, motion } = things.mill;
  const mixed = [];
  for (const other of [things.weaver.motion, nowhere(things.weaver).motion])
    mixed.push(await ask(keys.mill.all, 'POST', '/v1/fields', { body: { mesh, motions: [motion, other] } }));
  assert.equal(mixed[0].json.type, urnOf('no-such-motion'));
  assert.deepEqual(mixed[0].json, mixed[1].json);
});

test('equal content of two tenants is two things, and new to each', async () => {
  const content = `# ${randomBytes(8).toString('hex')}\nv 0 0 0\n`;
  const post = (tenant) => ask(keys[tenant].submit, 'POST', '/v1/meshes', { body: content, headers: { 'content-type': 'model/obj' } });
  const ids = new Set();
  for (const tenant of tenants) {
    const first = await post(tenant);
    assert.equal(first.status, 202);
    assert.equal((await post(tenant)).json.id, first.json.id);
    ids.add(first.json.id);
  }
  assert.equal(ids.size, tenants.length);
});

test('an idempotency key is the tenant’s own', async () => {
  const ids = new Set();
  for (const tenant of tenants) {
    const body = { ...terminals(), field: things[tenant].field };
    const headers = { 'idempotency-key': 'order-17' };
    const first = await ask(keys[tenant].submit, 'POST', '/v1/layouts', { body, headers });
    assert.equal(first.status, 202, first.text);
    const again = await ask(keys[tenant].submit, 'POST', '/v1/layouts', { body, headers });
    assert.equal(again.json.id, first.json.id);
    ids.add(first.json.id);
  }
  assert.equal(ids.size, tenants.length);
});

test('cursors do not count what others do', async () => {
  const cursorOf = async () => {
    const { json } = await ask(keys.mill.all, 'GET', '/v1/layouts?limit=1');
    return json.next.match(/cursor=([0-9a-f]{16})\b/)[1];
  };
  for (let i = 0; i < 2; i++) await newLayout('mill', things.mill.field);
  const before = await cursorOf();
  assert.equal(await cursorOf(), before);
  // One more row moves a number by one, and a cursor by anything.
  await newLayout('mill', things.mill.field);
  const distance = BigInt(`0x${before}`) - BigInt(`0x${await cursorOf()}`);
  assert.ok(distance > 1000n || distance < -1000n, String(distance));
  // Another tenant's cursor is none.
  const theirs = (await ask(keys.weaver.all, 'GET', '/v1/jobs?limit=1')).json.next.match(/cursor=(\w+)/)[1];
  const refused = [];
  for (let i = 0; i < 10; i++) {
    const guess = i ? randomBytes(8).toString('hex') : theirs;
    refused.push((await ask(keys.mill.all, 'GET', `/v1/jobs?cursor=${guess}`)).status);
  }
  assert.ok(refused.filter((status) => status === 400).length >= 9, String(refused)); // one in 2,000 passes for a number
});

// --- the operator, and the end ----------------------------------------------------------------------------------

test('only keys of the tenant default see figures of the whole, and make keys of others', async () => {
  assert.equal((await ask(keys.default.read, 'GET', '/metrics')).status, 200);
  const body = (tenant) => ({ tenant, name: randomBytes(8).toString('hex'), scopes: ['admin'] });
  const foreign = await ask(keys.mill.admin, 'POST', '/v1/keys', { body: body('weaver') });
  const none = await ask(keys.mill.admin, 'POST', '/v1/keys', { body: body('nobody') });
  assert.equal(foreign.status, 404);
  assert.deepEqual(seen(foreign, { id: 'weaver' }), seen(none, { id: 'nobody' }));
  assert.equal((await ask(keys.mill.admin, 'POST', '/v1/keys', { body: body('mill') })).status, 201);
  const made = await ask(keys.default.admin, 'POST', '/v1/keys', { body: body('weaver') });
  assert.equal(made.status, 201);
  assert.equal(made.json.tenant, 'weaver');
  for (const tenant of ['weaver', 'nobody'])
    assert.equal((await ask(keys.mill.admin, 'GET', `/v1/keys?tenant=${tenant}`)).status, 404);
  assert.ok((await ask(keys.default.admin, 'GET', '/v1/keys?tenant=weaver&limit=1000')).json.items.some(({ id }) => id === made.json.id));
  assert.equal((await ask(keys.default.admin, 'GET', `/v1/keys/${made.json.id}`)).status, 404);
  assert.equal((await ask(keys.default.admin, 'GET', `/v1/keys/${made.json.id}?tenant=weaver`)).status, 200);
});

test('nobody gives a key more than he has', async () => {
  const body = (...list) => ({ name: randomBytes(8).toString('hex'), scopes: list });
  const refused = await ask(keys.mill.admin, 'POST', '/v1/keys', { body: body('admin', 'read') });
  assert.equal(refused.status, 403);
  assert.equal(refused.json.type, urnOf('missing-scope'));
  assert.equal(refused.json.errors[0].pointer, '/scopes/1');
  assert.equal((await ask(keys.mill.all, 'POST', '/v1/keys', { body: body('read', 'admin') })).status, 201);
});

test('a tenant is deleted whole, and nobody else misses anything', async () => {
  const headers = { 'confirm-delete': 'weaver' };
  assert.equal((await ask(keys.mill.all, 'DELETE', '/v1/tenant', { headers })).json.type, urnOf('not-confirmed'));
  const others = await pages(keys.mill.all, '/v1/jobs', 1000);
  const answer = await ask(keys.weaver.admin, 'DELETE', '/v1/tenant', { headers });
  assert.equal(answer.status, 202);
  for (let i = 0; (await ask(keys.weaver.all, 'GET', '/v1/jobs', { stranger: true })).status !== 401; i++) {
    assert.ok(i < 100, 'its keys are still good');
    await sleep(20);
  }
  const list = () => run('tenant', 'list', '--store', service.store);
  for (let i = 0; list().includes('being deleted'); i++) {
    assert.ok(i < 300, 'it is still being deleted');
    await sleep(100);
  }
  assert.match(list(), /^mill /m);
  assert.doesNotMatch(list(), /weaver/);
  assert.deepEqual((await pages(keys.mill.all, '/v1/jobs', 1000)).map(({ id }) => id), others.map(({ id }) => id));
  assert.equal((await ask(keys.mill.all, 'GET', `/v1/layouts/${things.mill.layout}/pattern.svg`)).status, 200);
});
