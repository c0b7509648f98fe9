// Starts the real service on a free port with a fresh store, and talks to it. Every answer is checked against
// openapi.yaml on the way, by ajv, which knows nothing of the service's code.
import { spawn, execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import Ajv from 'ajv/dist/2020.js';
import addFormats from 'ajv-formats';
import { parse } from 'yaml';

const root = resolve(import.meta.dirname ?? new URL('.', import.meta.url).pathname, '../..');
export const build = resolve(root, process.env.BUILD ?? 'build/release');
export const tightwire = process.env.TIGHTWIRE ?? join(build, 'tightwire');
export const openapi = parse(readFileSync(join(root, 'openapi.yaml'), 'utf8'));

const ajv = new Ajv({ strict: false, allErrors: true });
addFormats(ajv);
ajv.addSchema(openapi, 'openapi');

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

export async function until(what, claim, seconds = 20) {
  for (const end = Date.now() + seconds * 1000; Date.now() < end; await sleep(25)) {
    const value = await claim();
    if (value) return value;
  }
  throw new Error(`still not after ${seconds} s: ${what}`);
}

// A folder of its own for each service, removed with it.
export function temporaryFolder() {
  const path = mkdtempSync(join(tmpdir(), 'tightwire-test-'));
  return { path, remove: () => rmSync(path, { recursive: true, force: true }) };
}

export class Service {
  // flags: {workers: 1, 'idle-timeout-s': 2}; environment is added to this process's own; ignored: signals that a shell
  // ignores before it becomes the service, "CHLD HUP".
  static async start(flags = {}, environment = {}, ignored = '') {
    const service = new Service();
    service.folder = temporaryFolder();
    service.store = flags.store ?? `sqlite:${join(service.folder.path, 'store.db')}`;
    const all = { listen: '127.0.0.1:0', workers: 0, ...flags, store: service.store };
    const given = Object.entries(all).map(([name, value]) => `--${name}=${value}`);
    service.log = '';
    const shell = ['-c', `trap "" ${ignored}; exec "$0" "$@"`, tightwire];
    const [program, before] = ignored ? ['sh', shell] : [tightwire, []];
    service.process = spawn(program, [...before, 'serve', ...given], { env: { ...process.env, ...environment } });
    service.process.stderr.on('data', (bytes) => (service.log += bytes));
    service.exited = new Promise((done) => service.process.on('exit', (code, signal) => done({ code, signal })));
    let out = '';
    service.process.stdout.on('data', (bytes) => (out += bytes));
    await until('the service listens', () => {
      if (service.process.exitCode !== null) throw new Error(`it ended: ${service.log}`);
      return out.includes('\n');
    });
    service.url = out.match(/listening on (\S+)/)[1];
    return service;
  }

  async stop() {
    if (this.process.exitCode === null && this.process.signalCode === null) this.process.kill('SIGTERM');
    const end = await Promise.race([this.exited, new Promise((done) => setTimeout(done, 40000, null).unref())]);
    if (!end) this.process.kill('SIGKILL');
    this.folder.remove();
    return end;
  }

  // fetch, with the answer's body read and checked against the contract. body: an object is sent as JSON.
  async request(method, path, { body, headers = {}, ...rest } = {}) {
    const isJson = body && Object.getPrototypeOf(body) === Object.prototype;
    const response = await fetch(this.url + path, {
      method,
      body: isJson ? JSON.stringify(body) : body,
      headers: isJson ? { 'content-type': 'application/json', ...headers } : headers,
      ...rest,
    });
    const bytes = Buffer.from(await response.arrayBuffer());
    const type = response.headers.get('content-type')?.split(';')[0] ?? '';
    const json = /json$/.test(type) && bytes.length ? JSON.parse(bytes) : undefined;
    if (method !== 'OPTIONS') checkContract(method, path, response.status, type, json);
    return { status: response.status, headers: response.headers, type, bytes, json, text: bytes.toString() };
  }

  get = (path, options) => this.request('GET', path, options);
  post = (path, body, headers, options) => this.request('POST', path, { body, headers, ...options });
  delete = (path) => this.request('DELETE', path);

  // Waits for the resource or job at `path` to end.
  async finished(path, seconds = 60) {
    return until(
      `${path} has ended`,
      async () => {
        const { json } = await this.get(path);
        return ['succeeded', 'failed', 'cancelled', 'incomplete'].includes(json.state) && json;
      },
      seconds,
    );
  }

  workers() {
    return childrenOf(this.process.pid);
  }

  residentBytes(pid = this.process.pid) {
    return 1024 * Number(readFileSync(`/proc/${pid}/status`, 'utf8').match(/VmRSS:\s+(\d+)/)[1]);
  }

  // The most that the process ever had, by the kernel's own mark.
  peakBytes(pid = this.process.pid) {
    return 1024 * Number(readFileSync(`/proc/${pid}/status`, 'utf8').match(/VmHWM:\s+(\d+)/)[1]);
  }
}

export function childrenOf(pid) {
  const text = readFileSync(`/proc/${pid}/task/${pid}/children`, 'utf8').trim();
  return text ? text.split(' ').map(Number) : [];
}

export const run = (...args) => execFileSync(tightwire, args, { encoding: 'utf8' });

// The path template of the contract that a path is an instance of; literal segments win.
export function templateOf(path) {
  const segments = path.split('?')[0].split('/');
  const fits = (template) => {
    const parts = template.split('/');
    return (
      parts.length === segments.length &&
      parts.every((part, i) => part === segments[i] || (part[0] === '{' && segments[i]))
    );
  };
  const literals = (template) => template.split('/').filter((part) => part[0] !== '{').length;
  return Object.keys(openapi.paths)
    .filter(fits)
    .sort((a, b) => literals(b) - literals(a))[0];
}

const pointer = (...parts) =>
  '#/' + parts.map((p) => encodeURIComponent(String(p).replace(/~/g, '~0').replace(/\//g, '~1'))).join('/');

function follow(object, path) {
  return object?.$ref
    ? { object: openapi.components.responses[object.$ref.split('/').pop()], path: object.$ref.slice(2).split('/') }
    : { object, path };
}

export function checkContract(method, path, status, type, json) {
  const fail = (why) => {
    throw new Error(`${method} ${path} answered ${status} ${type}: ${why}`);
  };
  const validate = (schema, value) => {
    const check = ajv.getSchema('openapi' + schema) ?? ajv.compile({ $ref: 'openapi' + schema });
    if (!check(value)) fail(`${ajv.errorsText(check.errors)}\n${JSON.stringify(value).slice(0, 2000)}`);
  };
  if (status >= 400) {
    if (type !== 'application/problem+json') fail('an error must be a problem');
    if (!json) return; // HEAD
    validate(pointer('components', 'schemas', 'Problem'), json);
    if (json.status !== status) fail('the problem says another status');
    return;
  }
  const template = templateOf(path);
  const operation = openapi.paths[template]?.[method === 'HEAD' ? 'get' : method.toLowerCase()];
  if (!operation) fail('the contract has no such operation');
  if (!operation.responses[status]) fail('the contract has no such status');
  const { object, path: place } = follow(operation.responses[status], [
    'paths',
    template,
    method === 'HEAD' ? 'get' : method.toLowerCase(),
    'responses',
    status,
  ]);
  if (!object.content) return json === undefined ? undefined : fail('the contract has no body here');
  if (!object.content[type]) fail('the contract has no such media type here');
  if (json !== undefined) validate(pointer(...place, 'content', type, 'schema'), json);
}
