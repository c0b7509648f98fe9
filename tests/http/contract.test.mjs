// openapi.yaml is valid, and says neither more nor less than the code does.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { join } from 'node:path';
import { test } from 'node:test';
import { Validator } from '@seriousme/openapi-schema-validator';
import { build, openapi, Service } from './service.mjs';

const code = JSON.parse(execFileSync(join(build, 'tests/tools/contract')));

test('openapi.yaml is a valid OpenAPI 3.1 document', async () => {
  const result = await new Validator().validate(structuredClone(openapi));
  assert.ok(result.valid, JSON.stringify(result.errors));
  assert.equal(openapi.openapi, '3.1.0');
});

test('the contract and the route table name the same operations', () => {
  const methods = ['get', 'put', 'post', 'delete', 'patch'];
  const written = Object.entries(openapi.paths).flatMap(([path, item]) =>
    methods.filter((m) => item[m]).map((m) => `${m.toUpperCase()} ${path}`),
  );
  const routed = code.routes.map((route) => `${route.method} ${route.path}`);
  assert.deepEqual(written.sort(), routed.sort());
});

test('the contract and the route table agree on bodies, on scopes and on what needs no key', () => {
  for (const route of code.routes) {
    const operation = openapi.paths[route.path][route.method.toLowerCase()];
    const types = Object.keys(operation.requestBody?.content ?? {});
    const body = !types.length ? 'none' : types.includes('application/json') ? 'json' : 'upload';
    assert.equal(body, route.body, `${route.method} ${route.path}`);
    // {}: what a service without keys lets in.
    const security = route.scopes.length ? [{}, ...route.scopes.map((scope) => ({ key: [scope] }))] : [];
    assert.deepEqual(operation.security, security, `${route.method} ${route.path}`);
  }
});

test('every {parameter} of a path is declared', () => {
  const name = (parameter) => parameter.name ?? openapi.components.parameters[parameter.$ref.split('/').pop()].name;
  for (const [path, item] of Object.entries(openapi.paths)) {
    const used = [...path.matchAll(/\{(\w+)\}/g)].map((match) => match[1]);
    assert.deepEqual((item.parameters ?? []).map(name), used, path);
  }
});

test('operation ids are unique', () => {
  const ids = Object.values(openapi.paths).flatMap((item) =>
    Object.values(item)
      .map((operation) => operation.operationId)
      .filter(Boolean),
  );
  assert.equal(new Set(ids).size, ids.length);
});

for (const [name, table] of Object.entries(code.options))
  test(`${name} in the contract is the code's option table`, () => {
    const written = openapi.components.schemas[name].properties;
    assert.deepEqual(Object.keys(written), Object.keys(table));
    for (const [option, row] of Object.entries(table)) {
      const schema = written[option];
      const range = schema.oneOf?.find((one) => one.type === 'number') ?? schema;
      if (row.kind === 'choice') {
        assert.deepEqual(schema.enum, row.choices, option);
        assert.equal(schema.default, row.choices[row.default], option);
        continue;
      }
      assert.equal(Number(schema.default) || schema.default, Number(row.default) || schema.default, option);
      assert.equal(schema.default === 'auto', row.default === 'auto', option);
      if (row.kind !== 'flag') assert.deepEqual([range.minimum, range.maximum], [row.minimum, row.maximum], option);
      assert.equal(Boolean(schema.oneOf), row.kind === 'number-or-auto', option);
      assert.equal(range.type === 'integer', row.kind === 'integer', option);
    }
  });

test('the service hands out the contract of its own build', async () => {
  const service = await Service.start();
  try {
    const { text, type, headers } = await service.get('/openapi.yaml');
    assert.equal(type, 'application/yaml');
    assert.match(text, /^openapi: 3\.1\.0\n/);
    const again = await service.get('/openapi.yaml', { headers: { 'if-none-match': headers.get('etag') } });
    assert.equal(again.status, 304);
    assert.equal(again.bytes.length, 0);
  } finally {
    await service.stop();
  }
});
