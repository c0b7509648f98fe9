// API keys as their holders and the operator see them: made and revoked while the service runs, told once, limited, and
// hard to guess.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { chmodSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { request as httpRequest } from 'node:http';
import { join } from 'node:path';
import { test } from 'node:test';
import { Service, run, sleep, temporaryFolder, tightwire, until } from './service.mjs';

const urn = (type) => `urn:tightwire:problem:${type}`;
const bearer = (secret) => ({ authorization: `Bearer ${secret}` });
const key = (...args) => spawnSync(tightwire, ['key', ...args], { encoding: 'utf8' });

async function withService(flags, use) {
  const service = await Service.start(flags);
  try {
    await use(service);
  } finally {
    await service.stop();
  }
}

// On a store of its own with one key of everything.
async function withKeys(flags, use) {
  const folder = temporaryFolder();
  const store = `sqlite:${join(folder.path, 'store.db')}`;
  const make = (name, ...more) => run('key', 'create', '--store', store, '--name', name, ...more).trim();
  try {
    const root = make('root', '--scopes', 'read,submit,rig,admin');
    await withService({ store, ...flags }, (service) => use({ service, make, store, root, folder }));
  } finally {
    folder.remove();
  }
}

const status = async (service, secret) => (await service.get('/v1/jobs', { headers: secret ? bearer(secret) : {} })).status;

async function withinASecond(what, claim) {
  const start = Date.now();
  await until(what, claim, 20);
  assert.ok(Date.now() - start < 5000, `${what} took ${Date.now() - start} ms`); // a second, and what a loaded machine adds
}

test('the first key closes a running service to all who have none', async () => {
  await withService({}, async (service) => {
    assert.equal(await status(service), 200);
    const made = await service.post('/v1/keys', { name: 'mes', scopes: ['read', 'submit', 'admin'] });
    assert.equal(made.status, 201);
    assert.match(made.json.secret, /^twk_[0-9a-z]{59}$/);
    assert.equal(made.headers.get('cache-control'), 'no-store');
    await withinASecond('nobody is let in without a key', async () => (await status(service)) === 401);
    assert.equal(await status(service, made.json.secret), 200);
    // It stays closed when the last key goes.
    assert.equal((await service.request('DELETE', made.json.href, { headers: bearer(made.json.secret) })).status, 204);
    await withinASecond('the key is refused', async () => (await status(service, made.json.secret)) === 401);
    assert.equal(await status(service), 401);
  });
});

test('keys that the command line makes, rotates and revokes count within a second', async () => {
  await withKeys({}, async ({ service, make, store }) => {
    const first = make('mes', '--tenant', 'mill', '--scopes', 'read');
    await withinASecond('the new key is let in', async () => (await status(service, first)) === 200);
    const named = ['--store', store, '--tenant', 'mill', '--name', 'mes'];
    const second = run('key', 'rotate', ...named, '--overlap', '2s').trim();
    await withinASecond('the rotated key is let in', async () => (await status(service, second)) === 200);
    assert.notEqual(first, second);
    await until('the overlap is over', async () => (await status(service, first)) === 401, 10);
    assert.equal(await status(service, second), 200);
    run('key', 'revoke', ...named);
    await withinASecond('the revoked key is refused', async () => (await status(service, second)) === 401);
  });
});

test('a key that is refused leaves no new tenant behind', async () => {
  await withKeys({}, async ({ service, root, store }) => {
    for (const wrong of [{ name: 'two words' }, { name: 'old', expires_at: '2020-01-01T00:00:00Z' }, { name: 'no', limits: { queued_jobs: 1e15 } }]) {
      const refused = await service.post('/v1/keys', { tenant: 'mill', scopes: ['read'], ...wrong }, bearer(root));
      assert.equal(refused.status, 422, JSON.stringify(refused.json));
    }
    assert.notEqual(key('create', '--store', store, '--tenant', 'mill', '--name', 'two words').status, 0);
    assert.ok(!run('tenant', 'list', '--store', store).includes('mill'));
    assert.equal((await service.get('/v1/keys?tenant=mill', { headers: bearer(root) })).status, 404);
  });
});

test('a key expires at a moment, however that is written', async () => {
  await withKeys({}, async ({ service, root }) => {
    const make = (name, expires_at) => service.post('/v1/keys', { name, scopes: ['read'], expires_at }, bearer(root));
    const moment = Date.UTC(2099, 0, 31, 12);
    const written = ['2099-01-31T12:00:00Z', '2099-01-31T13:00:00+01:00', '2099-01-31t06:30:00.000-05:30', new Date(moment).toISOString()];
    for (const [i, text] of written.entries()) {
      const made = await make(`mes-${i}`, text);
      assert.equal(made.status, 201, text);
      assert.equal(Date.parse(made.json.expires_at), moment, text);
    }
    const wrong = ['', 'soon', '90d', '2099-01-31', '2099-1-31T12:00:00Z', '2099-02-30T12:00:00Z', '2099-01-31T12:00:00', '1970-01-01T00:00:00Z'];
    for (const text of wrong) {
      const refused = await make('never', text);
      assert.equal(refused.status, 422, text);
      assert.equal(refused.json.type, urn('json-value'), text);
    }
  });
});

test('who may only read ends no job by closing its stream', async () => {
  await withKeys({}, async ({ service, make }) => {
    const [reads, rigs] = [make('viewer', '--scopes', 'read'), make('bench', '--scopes', 'read,rig')];
    await until('the keys are let in', async () => (await status(service, rigs)) === 200);
    const { json } = await service.post('/v1/rig/recordings', {}, { prefer: 'on_disconnect=cancel', ...bearer(rigs) });
    const events = `/v1/jobs/${json.job.id}/events`;
    for (const [path, headers] of [[`${events}?on_disconnect=cancel`, {}], [events, { prefer: 'on_disconnect=cancel' }]]) {
      const refused = await service.get(path, { headers: { ...headers, ...bearer(reads) } });
      assert.equal(refused.status, 403);
      assert.equal(refused.json.type, urn('missing-scope'));
    }
    assert.equal((await service.get(`/v1/jobs/${json.job.id}`, { headers: bearer(reads) })).json.state, 'queued');
    for (const [secret, query, state] of [[reads, '', 'queued'], [rigs, '?on_disconnect=cancel', 'cancelled']]) {
      const stream = await fetch(service.url + events + query, { headers: bearer(secret) });
      assert.equal(stream.status, 200);
      await stream.body.cancel();
      await until('it has left', async () => /tightwire_http_held 0$/m.test((await service.get('/metrics', { headers: bearer(reads) })).text));
      await until(`it is ${state}`, async () => (await service.get(`/v1/jobs/${json.job.id}`, { headers: bearer(reads) })).json.state === state, 10);
    }
  });
});

test('a key that was revoked, and a secret that was rotated away, end the streams that they have opened', async () => {
  await withKeys({}, async ({ service, make, store }) => {
    const first = make('viewer', '--scopes', 'read,rig');
    await until('the key is let in', async () => (await status(service, first)) === 200);
    const { json } = await service.post('/v1/rig/recordings', {}, bearer(first));
    const open = async (secret) => {
      const stream = await fetch(`${service.url}/v1/jobs/${json.job.id}/events`, { headers: bearer(secret) });
      assert.equal(stream.status, 200);
      return stream.text();
    };
    const ends = async (stream) => {
      const text = await Promise.race([stream, sleep(20000).then(() => assert.fail('it goes on'))]);
      assert.equal(text.match(/^event: job$/gm).length, 1);
    };
    const old = open(first);
    await until('it is open', async () => /tightwire_http_held 1$/m.test((await service.get('/metrics', { headers: bearer(first) })).text));
    const second = run('key', 'rotate', '--store', store, '--name', 'viewer', '--overlap', '0s').trim();
    await ends(old);
    await until('the new secret is let in', async () => (await status(service, second)) === 200);
    const last = open(second);
    await until('it is open', async () => /tightwire_http_held 1$/m.test((await service.get('/metrics', { headers: bearer(second) })).text));
    run('key', 'revoke', '--store', store, '--name', 'viewer');
    await ends(last);
  });
});

test('a secret is told once: neither the store, nor the log, nor any answer has it again', async () => {
  await withKeys({ 'log-level': 'debug' }, async ({ service, root, folder }) => {
    const made = await service.post('/v1/keys', { name: 'mes', scopes: ['read'] }, bearer(root));
    const { secret, href } = made.json;
    const rotated = await service.post(`${href}/rotate?overlap_s=60`, undefined, bearer(root));
    assert.equal(rotated.json.id, made.json.id);
    assert.ok(rotated.json.overlap_until);
    await until('both are let in', async () => (await status(service, rotated.json.secret)) === 200);
    assert.equal(await status(service, secret), 200);
    for (const path of [href, '/v1/keys', '/v1/tenant'])
      assert.ok(!(await service.get(path, { headers: bearer(root) })).text.includes('twk_'), path);
    for (const name of readdirSync(folder.path)) {
      const bytes = readFileSync(join(folder.path, name), 'latin1');
      for (const told of [root, secret, rotated.json.secret]) assert.ok(!bytes.includes(told), name);
    }
    assert.ok(!service.log.includes('twk_'));
    assert.match(service.log, / request .* tenant=default key=root /);
  });
});

test('a key that expires is refused from that moment on', async () => {
  await withKeys({}, async ({ service, make }) => {
    const secret = make('guest', '--expires', '3s', '--scopes', 'read');
    await until('it is let in', async () => (await status(service, secret)) === 200, 3);
    await until('it is not any more', async () => (await status(service, secret)) === 401, 10);
  });
});

test('use is told in batches, not with a write for each request', async () => {
  await withKeys({}, async ({ service, root, store }) => {
    const transactions = async () => {
      const { text } = await service.get('/metrics', { headers: bearer(root) });
      return Number(text.match(/^tightwire_store_transactions_total (\d+)/m)[1]);
    };
    const before = await transactions();
    for (let i = 0; i < 200; i++) assert.equal(await status(service, root), 200);
    const usage = () => JSON.parse(run('key', 'list', '--store', store, '--json'))[0];
    await until('the use stands in the store', () => usage().requests >= 201, 30);
    assert.ok(Date.now() - usage().last_used_ms < 60000);
    assert.ok((await transactions()) - before < 50);
  });
});

test('the own tenant tells whose a key is and what it may do', async () => {
  await withKeys({}, async ({ service, make }) => {
    const limits = ['--queued-jobs', '5', '--stored-bytes', '1M', '--weight', '3'];
    const secret = make('mes', '--tenant', 'mill', '--scopes', 'read,submit', ...limits);
    await until('it is let in', async () => (await status(service, secret)) === 200);
    const { json } = await service.get('/v1/tenant', { headers: bearer(secret) });
    assert.equal(json.name, 'mill');
    assert.deepEqual(json.scopes, ['read', 'submit']);
    assert.equal(json.key.weight, 3);
    assert.deepEqual(json.key.limits, { requests_per_s: null, requests_per_min: null, queued_jobs: 5, stored_bytes: 1048576 });
  });
});

// --- limits -----------------------------------------------------------------------------------------------------

test('a limit is 429, names itself, says when to come again, and is over then', async () => {
  await withKeys({}, async ({ service, make }) => {
    const secret = make('busy', '--scopes', 'read', '--requests-per-s', '20');
    await until('it is let in', async () => (await status(service, secret)) === 200);
    await sleep(1500);
    const answers = await Promise.all(Array.from({ length: 80 }, () => service.get('/v1/tenant', { headers: bearer(secret) })));
    const refused = answers.filter((answer) => answer.status === 429);
    assert.ok(answers.filter((answer) => answer.status === 200).length >= 20);
    assert.ok(refused.length > 0);
    assert.equal(refused[0].json.type, urn('limit-requests-per-second'));
    await sleep(1000 * Number(refused[0].headers.get('retry-after')));
    assert.equal(await status(service, secret), 200);

    const slow = make('slow', '--scopes', 'read', '--requests-per-min', '3');
    const seen = [];
    await until('it is limited', async () => {
      const answer = await service.get('/v1/tenant', { headers: bearer(slow) });
      seen.push(answer);
      return answer.status === 429;
    });
    const last = seen.at(-1);
    assert.equal(last.json.type, urn('limit-requests-per-minute'));
    assert.ok(Number(last.headers.get('retry-after')) >= 1 && Number(last.headers.get('retry-after')) <= 20);
    assert.equal(seen.filter((answer) => answer.status === 200).length, 3);
  });
});

test('queued jobs and stored bytes are limited by key, and come back', async () => {
  await withKeys({}, async ({ service, make, root }) => {
    const scopes = ['--scopes', 'read,submit,rig'];
    const jobs = make('jobs', ...scopes, '--queued-jobs', '2');
    const bytes = make('bytes', ...scopes, '--stored-bytes', '1000');
    await until('they are let in', async () => (await status(service, bytes)) === 200);
    const record = (secret) => service.post('/v1/rig/recordings', {}, bearer(secret));
    const first = await record(jobs);
    assert.equal(first.status, 202);
    assert.equal((await record(jobs)).status, 202);
    const refused = await record(jobs);
    assert.equal(refused.status, 429);
    assert.equal(refused.json.type, urn('limit-queued-jobs'));
    assert.ok(Number(refused.headers.get('retry-after')) >= 1);
    assert.equal((await record(root)).status, 202);
    assert.equal((await service.post(`/v1/jobs/${first.json.job.id}/cancel`, undefined, bearer(jobs))).status, 200);
    assert.equal((await record(jobs)).status, 202);

    const upload = (size) =>
      service.post('/v1/meshes', 'v'.repeat(size), { 'content-type': 'model/obj', ...bearer(bytes) });
    const stored = await upload(600);
    assert.equal(stored.status, 202);
    const over = await upload(601);
    assert.equal(over.status, 429);
    assert.equal(over.json.type, urn('limit-stored-bytes'));
    const [, has, more] = over.json.detail.match(/stores (\d+) bytes.* may store 1000; this needs at least (\d+) more/);
    assert.ok(Number(has) >= 600 && Number(has) + Number(more) > 1000 && Number(more) <= 601, over.json.detail);
    const path = stored.json.href;
    assert.equal((await service.request('DELETE', path, { headers: bearer(bytes) })).status, 204);
    assert.equal((await upload(601)).status, 202);
  });
});

test('a key of greater weight gets more turns', async () => {
  await withKeys({}, async ({ service, make, store }) => {
    const heavy = make('heavy', '--scopes', 'read,submit', '--weight', '3');
    const light = make('light', '--scopes', 'read,submit');
    await until('they are let in', async () => (await status(service, light)) === 200);
    const jobs = {};
    for (const [name, secret] of Object.entries({ heavy, light }))
      for (let i = 0; i < 24; i++) {
        const body = `# ${name} ${i}\nv 0 0 0\n`;
        const { json } = await service.post('/v1/meshes', body, { 'content-type': 'model/obj', ...bearer(secret) });
        jobs[json.job.id] = name;
      }
    // One worker takes them one by one; each fails at once, because it is no mesh.
    const worker = spawn(tightwire, ['worker', '--store', store]);
    const finished = async () => (await service.get('/v1/jobs?state=failed&limit=100', { headers: bearer(light) })).json.items;
    try {
      await until('all have ended', async () => (await finished()).length === 48, 60);
    } finally {
      worker.kill('SIGKILL');
    }
    const all = await finished();
    all.sort((a, b) => (a.started_at < b.started_at ? -1 : 1));
    // While both wait, three of four are the heavy one's: its 24 are over after 32.
    const first = all.slice(0, 24).filter(({ id }) => jobs[id] === 'heavy').length;
    assert.ok(first >= 15 && first <= 21, `${first} of the first 24`);
  });
});

// --- guessing ---------------------------------------------------------------------------------------------------

function from(service, address, secret) {
  const start = Date.now();
  return new Promise((done, fail) =>
    httpRequest(`${service.url}/v1/jobs`, { localAddress: address, headers: bearer(secret), agent: false }, (response) => {
      response.resume();
      response.on('end', () => done({ status: response.statusCode, retry: response.headers['retry-after'], ms: Date.now() - start }));
    })
      .on('error', fail)
      .end(),
  );
}

test('wrong keys are answered later and later, and a right one behind the same address at once', async () => {
  await withKeys({}, async ({ service, root }) => {
    const answers = [];
    for (let i = 0; i < 9; i++) answers.push(await from(service, '127.5.0.1', `guess-${i}`));
    for (const answer of answers) {
      assert.equal(answer.status, 401);
      assert.ok(Number(answer.retry) >= 1);
    }
    assert.ok(answers[8].ms >= 600, `the ninth after ${answers[8].ms} ms`);
    const many = await Promise.all(Array.from({ length: 20 }, (_, i) => from(service, '127.5.0.1', `more-${i}`)));
    assert.ok(many.some((answer) => answer.status === 429 && Number(answer.retry) >= 10));
    /* Which of them came first is not known. */
    const waits = many.map((answer) => answer.ms).sort((a, b) => a - b);
    assert.ok(waits[10] >= 1500, `${waits}`);
    const right = await from(service, '127.5.0.1', root);
    assert.equal(right.status, 200);
    assert.ok(right.ms < 1900, `the right one after ${right.ms} ms`);
    const other = await from(service, '127.5.0.2', 'guess');
    assert.equal(other.status, 401);
    assert.ok(other.ms < 1900, `another address after ${other.ms} ms`);
    const { text } = await service.get('/metrics', { headers: bearer(root) });
    assert.match(text, /^tightwire_wrong_keys_total 30$/m);
  });
});

test('a client that leaves while its answer is kept back costs nothing', async () => {
  await withKeys({ connections: 16, 'connections-per-address': 16 }, async ({ service, root }) => {
    for (let i = 0; i < 8; i++) await from(service, '127.5.0.3', `guess-${i}`);
    for (let i = 0; i < 200; i++) {
      const sent = httpRequest(`${service.url}/v1/jobs`, { localAddress: '127.5.0.3', headers: bearer('x'), agent: false });
      sent.on('error', () => {});
      sent.end();
      await sleep(2);
      sent.destroy();
    }
    await until('it serves', async () => (await from(service, '127.0.0.1', root)).status === 200, 10);
  });
});

test('a key that lost a letter is told from one that was never given out', async () => {
  await withKeys({}, async ({ service, root }) => {
    const cut = await service.get('/v1/jobs', { headers: bearer(root.slice(0, -1)) });
    assert.equal(cut.status, 401);
    assert.match(cut.json.detail, /no whole key/);
    const never = await service.get('/v1/jobs', { headers: bearer('never') });
    assert.doesNotMatch(never.json.detail, /no whole key/);
  });
});

// --- the operator -----------------------------------------------------------------------------------------------

test('a store with a key is enough to listen beyond this machine', async () => {
  await withKeys({ listen: '0.0.0.0:0' }, async ({ service, root }) => {
    service.url = service.url.replace('0.0.0.0', '127.0.0.1');
    assert.equal(await status(service, root), 200);
    assert.equal(await status(service), 401);
  });
});

test('a key file that others may use is refused, with what to do', () => {
  const folder = temporaryFolder();
  const file = join(folder.path, 'keys');
  writeFileSync(file, run('key', 'somebody'));
  for (const mode of [0o644, 0o604, 0o602, 0o606]) {
    chmodSync(file, mode);
    const args = ['serve', '--key-file', file, '--store', `sqlite:${folder.path}/s.db`, '--listen', '127.0.0.1:0'];
    const { status: code, stderr } = spawnSync(tightwire, args, { encoding: 'utf8' });
    assert.equal(code, 1, stderr);
    assert.ok(stderr.includes(`run: chmod o= ${file}`), stderr);
  }
  folder.remove();
});

test('the log tells whose a request was, one that deletes a tenant too', async () => {
  await withKeys({}, async ({ service, make }) => {
    for (const tenant of ['mill', 'weaver']) {
      const secret = make('mes', '--tenant', tenant, '--scopes', 'read,admin');
      await until('it is let in', async () => (await status(service, secret)) === 200);
      const headers = { 'confirm-delete': tenant, ...bearer(secret) };
      assert.equal((await service.request('DELETE', '/v1/tenant', { headers })).status, 202);
      const line = new RegExp(` request .* tenant=${tenant} key=mes method=DELETE route="/v1/tenant" status=202 `);
      await until('it stands in the log', () => line.test(service.log), 10);
    }
    assert.equal(await status(service, 'nobody'), 401);
    await until('a stranger stands in it', () => / request .* tenant=- key=- .* status=401 /.test(service.log), 10);
  });
});

test('keys of the file and of the store are good side by side', async () => {
  const folder = temporaryFolder();
  const file = join(folder.path, 'keys');
  const made = spawnSync(tightwire, ['key', 'studio'], { encoding: 'utf8' });
  writeFileSync(file, made.stdout, { mode: 0o640 });
  await withKeys({ 'key-file': file }, async ({ service, root }) => {
    assert.equal(await status(service, root), 200);
    const own = bearer(made.stderr.trim());
    const { json } = await service.get('/v1/tenant', { headers: own });
    assert.deepEqual(json, { name: 'default', scopes: ['read', 'submit', 'rig', 'admin'], key: null });
    await until('the log names it', () => / request .* tenant=default key=studio /.test(service.log), 10);
    assert.equal((await service.post('/v1/keys', { name: 'more', scopes: ['read'] }, own)).status, 201);
  });
  folder.remove();
});

test('the command line says what is wrong with what it is told', () => {
  const folder = temporaryFolder();
  const store = ['--store', `sqlite:${join(folder.path, 'store.db')}`];
  const wrong = [
    [['create', ...store], /--name is needed/],
    [['create', '--name', 'a'], /--store is needed/],
    [['create', ...store, '--name', 'a b'], /a key's name has/],
    [['create', ...store, '--name', 'a', '--scopes', 'write'], /no scope "write"/],
    [['create', ...store, '--name', 'a', '--expires', 'soon'], /no day/],
    [['create', ...store, '--name', 'a', '--expires', '2027-02-30'], /no day/],
    [['create', ...store, '--name', 'a', '--expires', '2020-01-01'], /expired already/],
    [['create', ...store, '--name', 'a', '--queued-jobs', '-1'], /no number/],
    ...['--queued-jobs', '--stored-bytes', '--weight', '--requests-per-s', '--requests-per-min'].flatMap((flag) =>
      ['0', '00'].map((none) => [['create', ...store, '--name', 'a', flag, none], /a whole number from 1 on; .* leave the flag out/]),
    ),
    [['create', ...store, '--name', 'a', '--stored-bytes', '0G'], /a whole number from 1 on/],
    [['create', ...store, '--name', 'a', '--tenant', 'A B'], /a tenant's name has/],
    [['create', ...store, '--name', 'a', '--queued', '1'], /did you mean --queued-jobs/],
    [['rotate', ...store, '--name', 'a', '--scopes', 'read'], /a key keeps them/],
    [['list', ...store, '--name', 'a'], /no flag of list/],
    [['revoke', ...store, '--name', 'a'], /there is no (store|key)/],
    [['frobnicate', ...store], /one argument too many/],
  ];
  for (const [args, words] of wrong) {
    const { status: code, stderr } = key(...args);
    assert.ok(code === 1 || code === 2, args.join(' '));
    assert.match(stderr, words, args.join(' '));
  }
  assert.match(run('key', 'create', ...store, '--name', 'a'), /^twk_\w{59}\n$/);
  const other = ['--store', `sqlite:${join(folder.path, 'other.db')}`];
  for (const [name, isNew] of [['a', true], ['b', false]])
    assert.equal(/^the store sqlite:\S+other\.db is new$/m.test(key('create', ...other, '--name', name).stderr), isNew, name);
  assert.match(key('create', ...store, '--name', 'a').stderr, /has a key a already/);
  assert.match(run('key', 'list', ...store), /^default +a +read,submit/m);
  const limits = ['requests-per-s', 'requests-per-min', 'queued-jobs', 'weight'].flatMap((name, i) => [`--${name}`, `${i + 2}`]);
  assert.match(key('create', ...store, '--name', 'few', '--expires', '2099-01-31', '--stored-bytes', '1k', ...limits).stderr, /expires: 2099-01-31T00:00Z/);
  assert.match(
    run('key', 'list', ...store),
    /^default +few +read,submit +2099-01-31T00:00Z +never .* weight=5 requests-per-s=2 requests-per-min=3 queued-jobs=4 stored-bytes=1024$/m,
  );
  assert.match(run('key', 'list', ...store), /^default +a +read,submit +never +never +0 +0 +0$/m);
  const overlap = (time) => key('rotate', ...store, '--name', 'a', '--overlap', time);
  for (const time of ['91d', '7776001s', '9999d']) assert.match(overlap(time).stderr, /at most 90 days/, time);
  assert.equal(overlap('90d').status, 0);
  const tenant = (...args) => spawnSync(tightwire, ['tenant', ...args], { encoding: 'utf8' });
  assert.match(tenant('delete', ...store, '--tenant', 'default').stderr, /say --yes/);
  assert.match(tenant('delete', ...store, '--tenant', 'mill', '--yes').stderr, /no tenant mill/);
  assert.equal(tenant('delete', ...store, '--tenant', 'default', '--yes').status, 0);
  assert.doesNotMatch(run('key', 'list', ...store), /read,submit/);
  assert.match(tenant('list', ...store).stdout, /^default +0$/m);
  folder.remove();
});
