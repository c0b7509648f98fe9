// What a client may say about how its jobs are queued, and what comes of it. Jobs that nobody can do (recordings without a rig)
// show what becomes of queued ones; a suit and real workers the rest. What is asked of time leaves a busy machine a wide margin.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { connect } from 'node:net';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Service, run, sleep, temporaryFolder, tightwire, until } from './service.mjs';

const folder = temporaryFolder();
const suit = (...parts) => join(folder.path, 'suit', ...parts);
const terminalsOf = (set) => JSON.parse(readFileSync(suit('terminals', `${set}.json`))).terminals;
const isFinal = (state) => ['succeeded', 'failed', 'cancelled', 'incomplete'].includes(state);

before(() => run('sample', '--out', suit(), '--vertices', '6000'));
after(() => folder.remove());

async function serve(t, flags = {}) {
  const service = await Service.start({ 'worker-threads': 1, 'log-level': 'warning', ...flags });
  t.after(() => service.stop());
  return service;
}

const record = (service, name, headers) => service.post('/v1/rig/recordings', { name }, headers);
const jobOf = async (service, resource) => (await service.get(`/v1/jobs/${resource.job.id}`)).json;
const stateBecomes = (service, resource, state, seconds = 10) =>
  until(`${resource.name} is ${state}`, async () => (await jobOf(service, resource)).state === state, seconds);

// A worker of the service's store that the test starts and ends itself.
function startWorker(t, service, ...flags) {
  const worker = spawn(tightwire, ['worker', '--store', service.store, ...flags], { stdio: 'ignore' });
  t.after(() => worker.kill('SIGKILL'));
  worker.exited = new Promise((done) => worker.on('exit', done));
  return worker;
}

// The suit's field in the service, made by a worker of its own where the service has none.
async function prepare(t, service) {
  const worker = service.workers().length ? null : startWorker(t, service);
  const wait = { prefer: 'wait=60' };
  const { json: mesh } = await service.post('/v1/meshes?name=suit.obj', readFileSync(suit('suit.obj')), { 'content-type': 'model/obj', ...wait });
  const { json: motion } = await service.post(`/v1/meshes/${mesh.id}/motions?name=walk.pc2`, readFileSync(suit('motions', 'walk.pc2')), {
    'content-type': 'application/octet-stream',
    ...wait,
  });
  const { json: field } = await service.post('/v1/fields', { mesh: mesh.id, motions: [motion.id] }, wait);
  assert.equal(field.state, 'succeeded', JSON.stringify(field.problem));
  worker?.kill('SIGTERM');
  await worker?.exited;
  return (set, options = {}) => ({ field: field.id, terminals: terminalsOf(set), options });
}

// A job that takes some seconds: ten searches for eighty terminals.
const long = { eta: 'auto' };

test('every header that says how a job is queued is checked, and named', async (t) => {
  const service = await serve(t);
  for (const [name, value] of [
    ['Job-Class', 'urgent'],
    ['Job-Priority', 'high'],
    ['Job-Group', 'two words'],
    ['Job-Max-Running', '3'],
    ['Not-Before', 'tomorrow'],
    ['Cancel-After', '0s'],
    ['Supersedes', 'x'.repeat(65)],
    ['Session', ''],
  ]) {
    const { status, json } = await record(service, 'never kept', { [name]: value });
    assert.equal(status, 400, name);
    assert.equal(json.type, 'urn:tightwire:problem:malformed-header');
    assert.equal(json.errors[0].place, name);
  }
  assert.deepEqual((await service.get('/v1/jobs')).json.items, []);
});

test('a header that says how a job is queued stands once in the head', async (t) => {
  const service = await serve(t);
  for (const [name, value] of [
    ['Job-Class', 'batch'],
    ['Job-Priority', '3'],
    ['Job-Group', 'rig'],
    ['Job-Max-Running', '3'],
    ['Not-Before', '8h'],
    ['Cancel-After', '90s'],
    ['Supersedes', 'drag'],
    ['Session', 'studio'],
  ]) {
    const socket = hold(service, 'POST', '/v1/rig/recordings', { [name]: value, [name.toLowerCase()]: value }, '{"name":"twice"}');
    await until(`${name} is answered`, () => /^HTTP\/1.1 [^]*\r\n\r\n[^]*\}/.test(socket.back));
    assert.match(socket.back, /^HTTP\/1.1 400 [^]*malformed-header[^]*stands twice/, name);
    assert.ok(socket.back.includes(`"place":"${name}"`), socket.back);
    socket.destroy();
  }
});

test('a job tells how it is queued', async (t) => {
  const service = await serve(t);
  const at = new Date(Date.now() + 3600_000).toISOString();
  const { json } = await record(service, 'all said', {
    'job-class': 'batch',
    'job-priority': '-7',
    'job-group': 'rig',
    'job-max-running': '2',
    'not-before': at,
    'cancel-after': '2h',
  });
  const { job } = json;
  assert.deepEqual([job.class, job.priority, job.group], ['batch', -7, 'rig']);
  assert.equal(job.not_before, at);
  assert.ok(Math.abs(Date.parse(job.cancel_at) - Date.now() - 7200_000) < 60_000);
  const plain = (await record(service, 'nothing said')).json.job;
  assert.deepEqual([plain.class, plain.priority, plain.group, plain.not_before, plain.cancel_at], ['normal', 0, null, null, null]);
  assert.equal((await record(service, 'waits', { prefer: 'wait=1' })).json.job.class, 'interactive');
});

test('what is said of the queue is no part of what is asked', async (t) => {
  const service = await serve(t);
  const post = (headers) => service.post('/v1/meshes?name=a.obj', 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n', { 'content-type': 'model/obj', ...headers });
  const first = await post({ 'job-class': 'batch', 'job-priority': '1' });
  assert.equal(first.status, 202);
  const second = await post({ 'job-class': 'interactive', 'job-priority': '-3', session: 'b' });
  assert.equal(second.json.id, first.json.id);
  assert.deepEqual([second.json.job.class, second.json.job.priority], ['interactive', 1], 'the more urgent of each');
  assert.equal((await post({ 'job-class': 'batch' })).json.job.class, 'interactive', 'and stays');
  const key = { 'idempotency-key': 'k' };
  const field = (await service.post('/v1/fields', { mesh: first.json.id, motions: [] })).json;
  const layout = { field: field.id, terminals: [{ vertex: 0 }, { vertex: 1 }] };
  const one = await service.post('/v1/layouts', layout, { ...key, 'job-class': 'batch' });
  const two = await service.post('/v1/layouts', layout, { ...key, 'cancel-after': '9h' });
  assert.equal(one.json.id, two.json.id);
});

test('jobs are done by class, and what a job is made from becomes as urgent as the job', async (t) => {
  const service = await serve(t, { workers: 0 });
  const layout = await prepare(t, service);
  const post = (headers) => service.post('/v1/layouts', layout('joints10'), headers);
  const [batch, normal] = [[], []];
  for (let i = 0; i < 4; i++) {
    batch.push((await post({ 'job-class': 'batch' })).json);
    normal.push((await post({})).json);
  }
  // A mesh and its field that only a batch wants, until a designer asks for a layout of them.
  const other = (await service.post('/v1/meshes?name=other.obj', readFileSync(suit('suit.obj')) + '\n# another', { 'content-type': 'model/obj', 'job-class': 'batch' })).json;
  const field = (await service.post('/v1/fields', { mesh: other.id, motions: [] }, { 'job-class': 'batch' })).json;
  const urgent = (await service.post('/v1/layouts', { ...layout('joints10'), field: field.id }, { 'job-class': 'interactive' })).json;
  startWorker(t, service);
  const started = async (list) => Promise.all(list.map(async ({ href }) => Date.parse((await service.finished(href)).job.started_at)));
  const [u, n, b] = [await started([urgent]), await started(normal), await started(batch)];
  assert.ok(u[0] <= Math.min(...n), 'the interactive one first, with what it needs');
  assert.ok(Math.max(...n) <= Math.max(...b));
  assert.ok(n.filter((at) => at > Math.min(...b)).length <= 1, 'batch jobs come before normal ones only so that they do not starve');
});

test('a job ends at its time, queued or running', async (t) => {
  const service = await serve(t, { workers: 1 });
  const queued = (await record(service, 'nobody does it', { 'cancel-after': '1s' })).json;
  await stateBecomes(service, queued, 'cancelled');
  assert.equal((await jobOf(service, queued)).cancel_cause, 'deadline');
  const layout = await prepare(t, service);
  const { json } = await service.post('/v1/layouts', layout('muscles80', long), { 'cancel-after': '400ms' });
  const ended = await service.finished(json.href);
  assert.equal(ended.state, 'cancelled');
  assert.ok(ended.job.started_at, 'it had begun');
});

test('a job is not started before its time', async (t) => {
  const service = await serve(t, { workers: 1 });
  const layout = await prepare(t, service);
  const at = Date.now() + 1500;
  const later = (await service.post('/v1/layouts', layout('joints10'), { 'not-before': new Date(at).toISOString() })).json;
  const soon = await service.finished((await service.post('/v1/layouts', layout('joints10'))).json.href);
  assert.ok(Date.parse(soon.job.started_at) < at);
  const tomorrow = (await service.post('/v1/layouts', layout('joints10'), { 'not-before': '24h' })).json;
  const { job } = await service.finished(later.href);
  assert.ok(Date.parse(job.started_at) >= at, job.started_at);
  assert.equal((await jobOf(service, tomorrow)).state, 'queued');
});

test('of a group as many run at a time as was said', async (t) => {
  const service = await serve(t, { workers: 2 });
  const layout = await prepare(t, service);
  const post = (headers) => service.post('/v1/layouts', layout('segments17'), headers);
  const group = { 'job-group': 'licence', 'job-max-running': '1' };
  const hrefs = [];
  for (let i = 0; i < 5; i++) hrefs.push((await post(group)).json.href);
  const spans = [];
  for (const href of hrefs) {
    const { job, state } = await service.finished(href);
    assert.equal(state, 'succeeded');
    spans.push([Date.parse(job.started_at), Date.parse(job.finished_at)]);
  }
  spans.sort((a, b) => a[0] - b[0]);
  for (let i = 1; i < spans.length; i++) assert.ok(spans[i][0] >= spans[i - 1][1], `${spans}`);
});

test('a new request supersedes the one with the same word, queued or running', async (t) => {
  const service = await serve(t, { workers: 1 });
  const first = (await record(service, 'first', { supersedes: 'w' })).json;
  const other = (await record(service, 'another word', { supersedes: 'v' })).json;
  const second = (await record(service, 'second', { supersedes: 'w' })).json;
  assert.deepEqual([await jobOf(service, first), await jobOf(service, other), await jobOf(service, second)].map(({ state }) => state), ['cancelled', 'queued', 'queued']);
  assert.equal((await jobOf(service, first)).cancel_cause, 'superseded');
  const layout = await prepare(t, service);
  const drag = { supersedes: 'drag', 'job-class': 'interactive' };
  let best = Infinity;
  for (let i = 0; i < 5; i++) {
    const old = (await service.post('/v1/layouts', layout('muscles80', long), drag)).json;
    await stateBecomes(service, old, 'running');
    await sleep(100);
    const next = (await service.post('/v1/layouts', layout('joints10'), { ...drag, prefer: 'wait=30' })).json;
    assert.equal(next.state, 'succeeded');
    const { state, finished_at } = await jobOf(service, old);
    assert.equal(state, 'cancelled');
    best = Math.min(best, Date.parse(finished_at) - Date.parse(next.job.created_at));
  }
  t.diagnostic(`from the request to the end of the running job: ${best} ms at best`);
  assert.ok(best < 2000, `${best} ms`);
});

test('a designer who drags at 20 Hz leaves no stale job, and has the last answer soon', async (t) => {
  const service = await serve(t, { workers: 1 });
  const layout = await prepare(t, service);
  const request = layout('segments17');
  const headers = { supersedes: 'drag', session: 'drag', prefer: 'wait=30' };
  const single = await service.post('/v1/layouts', request, headers);
  const alone = Date.parse(single.json.job.finished_at) - Date.parse(single.json.job.created_at);
  const answers = [];
  for (let i = 0; i < 40; i++) {
    answers.push(service.post('/v1/layouts', { ...request, terminals: [...request.terminals.slice(1), { vertex: 100 + i }] }, headers));
    await sleep(50);
  }
  const since = Date.now();
  const last = await answers.at(-1);
  const took = Date.now() - since;
  assert.equal(last.json.state, 'succeeded', JSON.stringify(last.json.problem));
  const ended = await Promise.all(answers);
  assert.deepEqual(ended.filter(({ json }) => !isFinal(json.state)).length, 0, 'who waits is told at once that he is superseded');
  const { json: left } = await service.get('/v1/jobs?state=queued,running');
  assert.equal(left.items.length, 0);
  t.diagnostic(`alone ${alone} ms; after 40 positions the last answer came ${took} ms later; ${ended.filter(({ json }) => json.state === 'succeeded').length} were computed`);
  assert.ok(took < 2000 + 5 * alone, `${took} ms`);
});

// A connection that the test cuts: the head of the answer, and what came of it.
function hold(service, method, path, headers = {}, body = '') {
  const socket = connect({ port: Number(new URL(service.url).port), host: '127.0.0.1' });
  socket.back = '';
  socket.on('data', (data) => (socket.back += data));
  socket.on('error', () => {});
  const lines = Object.entries({ host: 'localhost', 'content-type': 'application/json', 'content-length': Buffer.byteLength(body), ...headers });
  socket.write(`${method} ${path} HTTP/1.1\r\n${lines.map(([name, value]) => `${name}: ${value}\r\n`).join('')}\r\n${body}`);
  return socket;
}

const held = async (service) => Number((await service.get('/metrics')).text.match(/^tightwire_http_held (\d+)/m)[1]);
const waits = (n) => async (service) => (await held(service)) === n;
const cancels = { prefer: 'wait=60, on_disconnect=cancel' };
const mesh = ['POST', '/v1/meshes?name=a.obj'];
const obj = 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n';

test('a client that leaves cancels what it alone waited for, when it said so', async (t) => {
  const service = await serve(t);
  const post = (name, headers) => hold(service, 'POST', '/v1/rig/recordings', headers, JSON.stringify({ name }));
  const [leaves, stays] = [post('not wanted', cancels), post('wanted all the same', { prefer: 'wait=60' })];
  await until('both wait', () => waits(2)(service));
  leaves.destroy();
  stays.destroy();
  const states = async () => Object.fromEntries((await service.get('/v1/rig/recordings')).json.items.map(({ name, state }) => [name, state]));
  await until('one is cancelled', async () => (await states())['not wanted'] === 'cancelled', 5);
  await until('nobody waits', () => waits(0)(service));
  assert.equal((await states())['wanted all the same'], 'queued');
  const [job] = (await service.get('/v1/jobs?state=cancelled')).json.items;
  assert.equal(job.cancel_cause, 'unwanted');
});

test('a running job that nobody waits for any more ends, and the worker is free', async (t) => {
  const service = await serve(t, { workers: 1 });
  const layout = await prepare(t, service);
  const socket = hold(service, 'POST', '/v1/layouts', cancels, JSON.stringify(layout('muscles80', long)));
  await until('it runs', async () => (await service.get('/v1/jobs?state=running')).json.items.length === 1);
  socket.destroy();
  await until('it is cancelled', async () => (await service.get('/v1/jobs?kind=compute_layout&state=cancelled')).json.items.length === 1, 10);
});

test('of several that wait for the same only the last one to leave cancels it', async (t) => {
  const service = await serve(t);
  const upload = (prefer) => hold(service, ...mesh, { 'content-type': 'model/obj', prefer }, obj);
  const sockets = [upload(cancels.prefer), upload(cancels.prefer), upload(cancels.prefer)];
  await until('all wait', () => waits(3)(service));
  const state = async () => (await service.get('/v1/meshes')).json.items.map((one) => one.state);
  for (const [left, socket] of [[2, sockets[1]], [1, sockets[0]]]) {
    socket.destroy();
    await until('it has left', () => waits(left)(service), 5);
    await sleep(100);
    assert.deepEqual(await state(), ['queued']);
  }
  sockets[2].destroy();
  await until('it is cancelled', async () => (await state())[0] === 'cancelled', 5);
  // Asked for again, it is queued again, and by somebody who wants it for good.
  assert.equal((await service.post('/v1/meshes?name=a.obj', obj, { 'content-type': 'model/obj' })).status, 202);
  const again = upload(cancels.prefer);
  await until('it waits', () => waits(1)(service));
  again.destroy();
  await until('it has left', () => waits(0)(service), 5);
  await sleep(100);
  assert.deepEqual(await state(), ['queued'], 'another request wants it without waiting');
});

test('who has his answer and has not left keeps the job, whoever leaves', async (t) => {
  const service = await serve(t);
  const other = hold(service, ...mesh, { 'content-type': 'model/obj', ...cancels }, obj);
  await until('it waits', () => waits(1)(service));
  const answer = await service.post('/v1/meshes?name=a.obj', obj, { 'content-type': 'model/obj', prefer: 'wait=1, on_disconnect=cancel' });
  assert.equal(answer.status, 202);
  other.destroy();
  await until('it has left', () => waits(0)(service), 5);
  await sleep(150);
  assert.equal((await jobOf(service, answer.json)).state, 'queued');
});

test('what something else is made from is not cancelled', async (t) => {
  const service = await serve(t);
  const socket = hold(service, ...mesh, { 'content-type': 'model/obj', ...cancels }, obj);
  await until('it waits', () => waits(1)(service));
  const [{ id }] = (await service.get('/v1/meshes')).json.items;
  assert.equal((await service.post('/v1/fields', { mesh: id, motions: [] })).status, 202);
  socket.destroy();
  await until('it has left', () => waits(0)(service), 5);
  await sleep(100);
  assert.equal((await service.get(`/v1/meshes/${id}`)).json.state, 'queued');
});

test('who waits by events cancels too, when he said so twice', async (t) => {
  const service = await serve(t);
  const events = (job, query = '') => hold(service, 'GET', `/v1/jobs/${job.id}/events${query}`);
  const post = async (name, prefer) => (await record(service, name, prefer ? { prefer } : {})).json;
  const cases = [
    ['both said it', 'on_disconnect=cancel', '?on_disconnect=cancel', 'cancelled'],
    ['the stream did not', 'on_disconnect=cancel', '', 'queued'],
    ['the request did not', '', '?on_disconnect=cancel', 'queued'],
  ];
  for (const [what, prefer, query, state] of cases) {
    const resource = await post(what, prefer);
    const socket = events(resource.job, query);
    await until('it is told', () => socket.back.includes('event: job'));
    await until('it waits', () => waits(1)(service));
    socket.destroy();
    await until('it has left', () => waits(0)(service), 5);
    await sleep(150);
    assert.equal((await jobOf(service, resource)).state, state, what);
  }
  assert.equal((await service.get('/v1/jobs/job_x/events?on_disconnect=perhaps')).status, 400);
});

test('a service that drains cancels nothing, whoever waited', async (t) => {
  const store = `sqlite:${join(folder.path, 'drained.db')}`;
  const first = await Service.start({ store });
  const socket = hold(first, 'POST', '/v1/rig/recordings', cancels, '{"name": "kept"}');
  await until('it waits', () => waits(1)(first));
  await first.stop();
  assert.match(socket.back, /^HTTP\/1.1 202 /);
  const second = await serve(t, { store });
  assert.equal((await second.get('/v1/rig/recordings')).json.items[0].state, 'queued');
});

test('workers that are kept for interactive jobs do no others', async (t) => {
  const service = await serve(t, { workers: 2, 'interactive-workers': 1 });
  const layout = await prepare(t, service);
  const batch = [];
  for (let i = 0; i < 3; i++) batch.push((await service.post('/v1/layouts', layout('muscles80', long), { 'job-class': 'batch' })).json);
  await until('one runs', async () => (await service.get('/v1/jobs?state=running')).json.items.length === 1);
  await sleep(300);
  assert.equal((await service.get('/v1/jobs?state=running')).json.items.length, 1, 'the other worker waits for a designer');
  const { json } = await service.post('/v1/layouts', layout('joints10'), { prefer: 'wait=30' });
  assert.equal(json.state, 'succeeded');
  const first = await jobOf(service, batch[0]);
  assert.ok(!isFinal(first.state) || Date.parse(first.finished_at) > Date.parse(json.job.started_at), 'it did not wait for the batch');
  for (const one of batch) await service.post(`/v1/jobs/${one.job.id}/cancel`);
});

test('a job goes from host to host without a lost attempt', async (t) => {
  const store = `sqlite:${join(folder.path, 'handed.db')}`;
  let service = await Service.start({ store, workers: 1, 'worker-threads': 1, 'drain-s': 1 });
  const layout = await prepare(t, service);
  const slow = (await service.post('/v1/layouts', layout('muscles36', long))).json;
  const next = (await service.post('/v1/layouts', layout('joints10'))).json;
  await stateBecomes(service, slow, 'running');
  await service.stop(); // half a second for the job to end, then it is given back
  service = await serve(t, { store, workers: 1 });
  for (const one of [slow, next]) {
    const { state, job } = await service.finished(one.href, 120);
    assert.equal(state, 'succeeded');
    assert.equal(job.attempts, 1, 'leaving a host is no attempt');
  }
});

test('many jobs are listed, cancelled and redriven by what they have in common', async (t) => {
  const service = await serve(t);
  const classes = ['interactive', 'normal', 'batch'];
  for (let i = 0; i < 90; i++)
    await record(service, `job ${i}`, { 'job-class': classes[i % 3], ...(i % 2 ? { 'job-group': 'odd' } : {}) });
  const list = async (query) => (await service.get(`/v1/jobs?limit=1000&${query}`)).json.items.length;
  assert.deepEqual([await list('class=batch'), await list('group=odd'), await list('class=batch&group=odd')], [30, 45, 15]);
  assert.deepEqual([await list('older_than=1h'), await list('older_than=1ms')], [0, 90]);
  const post = async (path) => (await service.post(path)).json;
  const oldest = async (name) => Number((await service.get('/metrics')).text.match(new RegExp(`^tightwire_queue_class_oldest_seconds\\{class="${name}"\\} (\\S+)`, 'm'))[1]);
  assert.ok((await oldest('batch')) > 0 && (await oldest('interactive')) > 0);
  assert.deepEqual(await post('/v1/jobs/cancel?class=batch&group=odd'), { cancelled: 15, more: false });
  assert.deepEqual(await post('/v1/jobs/cancel?class=batch&older_than=1h'), { cancelled: 0, more: false });
  assert.deepEqual(await post('/v1/jobs/cancel?group=odd'), { cancelled: 30, more: false });
  assert.deepEqual([await list('state=queued'), await list('state=cancelled&class=batch')], [45, 15]);
  await service.post('/v1/jobs/cancel?class=batch');
  assert.equal(await oldest('batch'), 0);
  assert.ok((await oldest('normal')) > 0);
  assert.deepEqual(await post('/v1/jobs/redrive?state=cancelled&class=normal'), { redriven: 15, more: false });
  assert.deepEqual([await list('state=queued'), await list('state=queued&class=normal')], [45, 30]);
  for (const [path, place] of [
    ['/v1/jobs/cancel', undefined], // nobody means all
    ['/v1/jobs/cancel?state=failed', 'state'],
    ['/v1/jobs/redrive?state=queued', 'state'],
    ['/v1/jobs/cancel?class=urgent', 'class'],
    ['/v1/jobs/cancel?older_than=yesterday', 'older_than'],
    ['/v1/jobs/cancel?older_than=0s', 'older_than'],
    ['/v1/jobs/cancel?kinds=draw', undefined],
  ]) {
    const { status, json } = await service.post(path);
    assert.equal(status, 400, path);
    if (place) assert.equal(json.errors[0].place, place, path);
  }
});

test('the history of a job tells of every attempt that came to nothing', async (t) => {
  const service = await serve(t, { workers: 1, 'lease-s': 1 });
  const layout = await prepare(t, service);
  const { json } = await service.post('/v1/layouts', layout('muscles80', long));
  for (let i = 0; i < 2; i++) {
    await until('it runs', async () => (await jobOf(service, json)).attempts === i + 1 && (await jobOf(service, json)).state === 'running');
    const [worker] = service.workers();
    process.kill(worker, 'SIGKILL');
    await until('that is told', async () => (await jobOf(service, json)).history.reduce((sum, { times }) => sum + times, 0) === i + 1);
  }
  await service.post(`/v1/jobs/${json.job.id}/cancel`);
  const ended = await service.finished(`/v1/jobs/${json.job.id}`);
  assert.equal(ended.state, 'cancelled');
  const crashed = ended.history.filter(({ ending }) => ending === 'crashed');
  assert.equal(crashed.reduce((sum, { times }) => sum + times, 0), 2);
  for (const { started_at, ended_at, worker } of ended.history) assert.ok(started_at <= ended_at && worker.startsWith('worker-'));
});
