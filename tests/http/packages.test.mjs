// What these tests install runs on Debian 12's own Node.js 18.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';

const read = (name) => JSON.parse(readFileSync(new URL(name, import.meta.url), 'utf8'));
const node = [18, 0, 0];

const order = (a, b) => a.map((part, i) => part - b[i]).find((difference) => difference !== 0) ?? 0;

// Whether a range of `engines` has Node 18.0.0 in it. Throws on what it cannot read: then this is to be taught more.
function allows(range, version) {
  return range.split('||').some((alternative) =>
    alternative
      .trim()
      .replace(/([<>=^~])\s+/g, '$1')
      .split(/\s+/)
      .every((comparator) => {
        if (comparator === '*') return true;
        const match = comparator.match(/^(>=|<=|>|<|=|\^|~)?v?(\d+)(?:\.(\d+|x))?(?:\.(\d+|x))?$/);
        assert.ok(match, `cannot read "${comparator}" of "${range}"`);
        const [, operator, major, minor, patch] = match;
        const bound = [major, minor, patch].map((part) => (part === undefined || part === 'x' ? 0 : Number(part)));
        const difference = order(version, bound);
        if (operator === '>=') return difference >= 0;
        if (operator === '<') return difference < 0;
        if (operator === '>' || operator === '<=') assert.fail(`cannot read "${comparator}" of "${range}"`);
        if (operator === '^' || !minor) return version[0] === bound[0] && difference >= 0;
        return version[0] === bound[0] && version[1] === bound[1] && difference >= 0;
      }),
  );
}

test('ranges of versions are read as npm reads them', () => {
  for (const range of ['>=18', '>= 14.6', '^12.22 || ^14.13 || >=16', '^18', '18', '18.x', '*', '>=16.0.0 <21'])
    assert.ok(allows(range, node), range);
  for (const range of ['>=20', '>=18.1', '^20 || >= 21', '^18.12.0', '<18', '17.x', '~18.1'])
    assert.ok(!allows(range, node), range);
});

test('every package in the lock file declares Node 18, or no version at all', () => {
  for (const [path, { engines }] of Object.entries(read('package-lock.json').packages))
    assert.ok(allows(engines?.node ?? '*', node), `${path || 'this package'} asks for Node ${engines?.node}`);
});

test('the packages that we ask for by name are pinned', () => {
  const { devDependencies, overrides } = read('package.json');
  for (const [name, version] of Object.entries({ ...devDependencies, ...overrides }))
    assert.match(version, /^\d+\.\d+\.\d+$/, name);
});
