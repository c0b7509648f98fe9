// soak.mjs [SECONDS [ATTACK…]]: each attack for so long, and its figures. Exit 1 when a promise was broken: something accepted
// was lost, failed or doubled. BUILD, TIGHTWIRE: as for the tests.
import { aborts, tricklers } from './crowd.mjs';
import { day } from './day.mjs';
import { disk } from './disk.mjs';
import { kills } from './kills.mjs';
import { load } from './load.mjs';

const broken = (seconds) => day(seconds, { batch: 20000, kills: 2000 });
const attacks = { kills, disk, tricklers, aborts, load, day, broken };
const seconds = Number(process.argv[2] ?? 60);
const names = process.argv.slice(3);
const unknown = names.filter((name) => !attacks[name]);
if (!(seconds > 0) || unknown.length) {
  console.error(`usage: soak.mjs [SECONDS [ATTACK…]]; attacks: ${Object.keys(attacks).join(', ')}`);
  process.exit(2);
}

const show = (value) => (typeof value !== 'number' ? value : Number.isInteger(value) ? value : value.toFixed(1));
for (const name of names.length ? names : Object.keys(attacks)) {
  console.log(`${name}, ${seconds} s`);
  try {
    for (const [what, value] of Object.entries(await attacks[name](seconds))) console.log(`  ${what.padEnd(44)} ${show(value)}`);
  } catch (error) {
    console.log(`  BROKEN: ${error.stack}`);
    process.exitCode = 1;
  }
}
