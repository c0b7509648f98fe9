// A day at a shared service (tests/soak/day.mjs): two designers drag, an MES orders, 100,000 batch jobs lie in the queue. How long
// jobs of each class wait until they are started.
//   TIGHTWIRE  the binary     SECONDS  of the day, 20 unless told otherwise     BATCH  jobs
import { day } from '../soak/day.mjs';

const figures = await day(Number(process.env.SECONDS ?? 20), { batch: Number(process.env.BATCH ?? 100000) });

function line(name, value, unit, goal) {
  const met = goal === undefined ? '' : value <= goal ? 'ok' : 'MISSED';
  console.log(`${name.padEnd(36)} ${Number(value.toPrecision(4)).toString().padStart(12)} ${unit.padEnd(6)} ${(goal === undefined ? '' : `<= ${goal}`).padEnd(10)} ${met}`);
}

const goals = { interactive: 50 }; // after a worker is free; what it is about takes some milliseconds
for (const [name, { p50, p99, max }] of Object.entries(figures.waits)) {
  line(`day.${name}_wait_p50`, p50, 'ms', goals[name]);
  line(`day.${name}_wait_p99`, p99, 'ms');
  line(`day.${name}_wait_max`, max, 'ms');
}
for (const [what, value] of Object.entries(figures)) console.log(`# ${what}: ${value}`);
