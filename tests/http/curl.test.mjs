// curl as a client: another implementation of HTTP than Node's.
import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { promisify } from 'node:util';
import { Service, temporaryFolder } from './service.mjs';

const folder = temporaryFolder();
const file = (name) => join(folder.path, name);
let service;

before(async () => {
  service = await Service.start();
  writeFileSync(file('small.obj'), 'v 0 0 0\n');
  writeFileSync(file('large.obj'), 'v 0.125 0.25 0.5\n'.repeat(500000));
});
after(async () => {
  await service.stop();
  folder.remove();
});

async function curl(...args) {
  const { stdout, stderr } = await promisify(execFile)('curl', ['-sS', '--max-time', '20', ...args]);
  return stdout + stderr;
}
const url = (path) => service.url + path;
const status = ['-o', '/dev/null', '-w', '%{http_code}'];

test('curl uploads a file as it is and as a form, small and large', async () => {
  for (const name of ['small.obj', 'large.obj']) {
    const type = ['-H', 'Content-Type: model/obj'];
    const raw = JSON.parse(await curl(...type, '--data-binary', `@${file(name)}`, url(`/v1/meshes?name=${name}`)));
    assert.equal(raw.state, 'queued');
    const form = ['-F', `worn=@${file(name)}`, '-F', `pattern=@${file('small.obj')};type=model/obj`];
    const { href } = JSON.parse(await curl(...form, url('/v1/meshes?unit=m')));
    const { uploads } = JSON.parse(await curl(url(href)));
    assert.deepEqual(
      uploads.map((upload) => upload.file_name),
      [name, 'small.obj'],
    );
  }
});

test('curl that waits for 100 Continue gets it, or the refusal in its place', async () => {
  const expect = ['-v', '-H', 'Expect: 100-continue', '-H', 'Content-Type: model/obj'];
  const good = await curl(...expect, '--data-binary', `@${file('large.obj')}`, url('/v1/meshes?name=l.obj'));
  assert.match(good, /HTTP\/1.1 100 Continue[^]*HTTP\/1.1 202 /);
  const bad = await curl(...expect, '--data-binary', `@${file('large.obj')}`, url('/v1/mushes'));
  assert.match(bad, /HTTP\/1.1 404 /);
  assert.doesNotMatch(bad, /100 Continue/);
});

test('curl sends chunks, asks for heads, and keeps its connection', async () => {
  const chunked = ['-H', 'Transfer-Encoding: chunked', '-H', 'Content-Type: model/obj', '--data-binary'];
  assert.equal(await curl(...status, ...chunked, `@${file('small.obj')}`, url('/v1/meshes?name=c.obj')), '202');
  assert.match(await curl('-I', url('/v1/jobs')), /^HTTP\/1.1 200 OK\r\n/);
  const twice = await curl('-v', url('/livez'), url('/readyz'));
  assert.match(twice, /Re-using existing connection/);
});

test('curl speaks HTTP/1.0 too', async () => {
  assert.equal(await curl('-0', ...status, url('/livez')), '200');
  const type = ['-H', 'Content-Type: model/obj'];
  assert.equal(
    await curl('-0', ...status, ...type, '--data-binary', `@${file('small.obj')}`, url('/v1/meshes')),
    '202',
  );
});
