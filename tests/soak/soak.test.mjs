// Every attack once, small: the promises hold. Figures are printed, and `make soak` measures them at full size; here only what no
// busy machine excuses is asked of them.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { aborts, tricklers } from './crowd.mjs';
import { day } from './day.mjs';
import { disk } from './disk.mjs';
import { kills } from './kills.mjs';
import { load } from './load.mjs';

const short = [
  ['what was acknowledged is kept, once, whoever is killed', kills, 3, { everyMs: 600, inFlight: 6 }],
  ['a full disk costs no job, and work goes on by itself', disk, 2, { jobs: 8 }],
  ['who drags waits for no batch, and nothing is lost or doubled', day, 6, { batch: 2000, finish: true }],
  ['a day on which all breaks that can loses and doubles nothing', day, 6, { batch: 300, kills: 1000, finish: true }],
  ['clients without a key that trickle a body do not keep /livez from answering', tricklers, 4, { clients: 300 }],
  ['requests that are held and aborted do not keep /livez from answering', aborts, 3, { clients: 300 }],
  ['submits are answered beside a busy worker', load, 2, { clients: 8, perSecond: 50 }],
];

for (const [claim, attack, seconds, sizes] of short)
  test(claim, async (t) => {
    const figures = await attack(seconds, sizes);
    for (const [what, value] of Object.entries(figures)) t.diagnostic(`${what}: ${value}`);
    const slowest = figures['/livez max ms'];
    if (slowest !== undefined) assert.ok(slowest < 5000, `/livez took ${slowest} ms`);
  });
