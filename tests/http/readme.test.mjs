// README's tour with curl and its keys, run as it is printed: it works, and shows no failure on the way.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { join } from 'node:path';
import { test } from 'node:test';
import { temporaryFolder, tightwire } from './service.mjs';

const readme = readFileSync(new URL('../../README.md', import.meta.url), 'utf8');
const tour = readme.match(/\n## Five minutes with curl\n([^]*?)\n## /)[1];
const keys = readme.match(/\n## Keys and tenants\n([^]*?)\n## /)[1];

function freePort() {
  return new Promise((resolve) => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const { port } = server.address();
      server.close(() => resolve(port));
    });
  });
}

const installed = (program) => spawnSync('sh', ['-c', `command -v ${program}`]).status === 0;
const missing = ['bash', 'curl', 'jq'].filter((program) => !installed(program));

test('the tour of README', { skip: missing.length > 0 && `without ${missing}` }, async () => {
  const port = await freePort();
  const commands = tour
    .split('\n')
    .filter((line) => line.startsWith('    '))
    .map((line) => line.slice(4))
    .join('\n')
    .replace('make && ', '')
    .replace('tightwire serve &', `tightwire serve --listen 127.0.0.1:${port} 2>serve.log & daemon=$!`)
    .replaceAll('build/release/tightwire', tightwire)
    .replaceAll('localhost:8080', `127.0.0.1:${port}`);
  assert.match(commands, /curl .*\/v1\/layouts/);
  const folder = temporaryFolder();
  try {
    // The keys are announced on standard error, and count within a second.
    const closing = keys
      .split('\n')
      .filter((line) => line.startsWith('    '))
      .map((line) => line.slice(4).replace(/ +#.*/, '').replace('key create', 'key create 2>>keys.log'))
      .map((line, i) => (line.startsWith('curl') ? `sleep 2; ${line} > keys-${i}.json` : line))
      .join('\n')
      .replaceAll('build/release/tightwire', tightwire)
      .replaceAll('localhost:8080', `127.0.0.1:${port}`);
    assert.match(closing, /> keys-2.json\n.*> keys-3.json/);
    const stranger = `curl -s -o stranger.json 127.0.0.1:${port}/v1/meshes`;
    const script = `set -eo pipefail\ntrap 'kill $daemon; wait $daemon || true' EXIT\n${commands}\n${closing}\n${stranger}\n`;
    const { status, stdout, stderr } = spawnSync('bash', ['-c', script], {
      cwd: folder.path,
      encoding: 'utf8',
      timeout: 300000,
    });
    const read = (name) => readFileSync(join(folder.path, name));
    assert.equal(stderr, '', 'nothing is said that looks like a failure');
    assert.equal(status, 0, stdout);
    for (const name of ['mesh.json', 'answer.json']) assert.equal(JSON.parse(read(name)).state, 'succeeded', name);
    assert.match(String(read('pattern.svg')), /<svg/);
    assert.equal(JSON.parse(read('keys-2.json')).items[0].name, 'my-suit');
    assert.equal(JSON.parse(read('keys-3.json')).name, 'mill');
    assert.equal(JSON.parse(read('stranger.json')).status, 401);
    assert.ok(read('pattern.svg').equals(read('result/pattern.svg')), 'served and local drawings are the same bytes');
  } finally {
    folder.remove();
  }
});
