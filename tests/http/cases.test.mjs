// Small inputs that once went wrong (CASES, with a README of its own), each with its right outcome. Where the folder is not
// there they are skipped; the unit tests of garment, field, motion and graph make equivalents of their own.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { after, test } from 'node:test';
import { temporaryFolder, tightwire } from './service.mjs';

const root = resolve(import.meta.dirname ?? new URL('.', import.meta.url).pathname, '../..');
const cases = resolve(process.env.CASES ?? join(root, '../shared/cases'));
const options = existsSync(join(cases, 'README.md')) ? {} : { skip: 'the cases are not here' };
const folder = temporaryFolder();
after(() => folder.remove());

const at = (name) => join(cases, name);
const run = (...args) => spawnSync(tightwire, args, { encoding: 'utf8' });
const layout = (worn, ...args) => {
  const out = join(folder.path, 'out');
  const result = run('layout', '--worn', at(worn), '--out', out, '--json', ...args);
  if (result.status === 0) result.document = JSON.parse(readFileSync(join(out, 'layout.json')));
  return result;
};
const sleeve = (worn, motion = 'base.pc2', ...args) => layout(worn, '--motion', at(motion), '--terminals', at('terminals.json'), ...args);
const accepted = (result) => (assert.equal(result.status, 0, result.stderr), result);
const refused = (result, ...patterns) => {
  assert.equal(result.status, 1, 'it was taken');
  for (const pattern of patterns) assert.match(result.stderr, pattern);
};
const base = () => (base.known ??= accepted(sleeve('base.obj')).document);
const isBase = ({ document, stderr }, slack = 0) => {
  const weight = Number(base().layout.weight);
  assert.ok(Math.abs(Number(document.layout.weight) - weight) <= slack * weight, `${document.layout.weight} is not ${weight}`);
  assert.equal(document.garment.pieces, 2, stderr);
  assert.equal(document.garment.file_faces, 192);
};

test('case 01: a motion whose last frame collapsed or exploded is refused with frame, vertices and stretch', options, () => {
  refused(sleeve('base.obj', '01_last_frame_zero.pc2'), /frame 5\b/, /vertices \d+ and \d+/, /collapsed/);
  refused(sleeve('base.obj', '01_last_frame_exploded.pc2'), /frame 4\b/, /vertices \d+ and \d+/, /[\d.]+ times as long/);
});
test('case 02: vertices in another order are refused', options, () => {
  refused(sleeve('base.obj', '02_three_pairs_swapped.pc2'), /frame 0\b/, /vertices \d+ and \d+/, /order/);
});
test('case 03: a name that ends in a backslash swallows no line', options, () => isBase(accepted(sleeve('03_usemtl_ends_in_backslash.obj'))));
test('case 04: a seam whose sides have 8 and 9 vertices is said to stay open, with its length', options, () => {
  const sewn = (name) => accepted(layout(`${name}.obj`, '--motion', at(`${name}.pc2`), '--weld-mm', '0.01', '--terminals', at('points.json')));
  assert.match(sewn('04_seam_8_9').stderr, /600 mm .*not sewn/);
  assert.doesNotMatch(sewn('04_seam_8_8').stderr, /not sewn/);
});
test('case 05: positions per corner that differ in the last digit are one', options, () => isBase(accepted(sleeve('05_vt_per_corner_last_digit.obj')), 1e-6));
test('cases 06 and 07: frames of a tar are read in numeric order, without the companions of macOS', options, () => {
  for (const name of ['06_unpadded.tar', '07_macos.tar']) isBase(accepted(sleeve('base.obj', name)));
});
test('case 08: a garment in metres is told its unit', options, () => {
  refused(sleeve('08_all_in_metres.obj'), /metres/, /unit = m\b/, /pattern_unit = m\b/);
  isBase(accepted(sleeve('08_all_in_metres.obj', 'base.pc2', '--unit', 'm', '--pattern-unit', 'm', '--motion-unit', 'mm')), 1e-5);
});
test('case 08: the same in centimetres does not pass in silence', options, () => {
  const tenth = readFileSync(at('base.obj'), 'utf8').replace(/^(v|vt) .*$/gm, (line) =>
    line.split(' ').map((word, i) => (i ? (Number(word) / 10).toFixed(6) : word)).join(' '));
  writeFileSync(join(folder.path, 'cm.obj'), tenth);
  refused(run('field', '--worn', join(folder.path, 'cm.obj'), '--out', folder.path), /centimetres/, /unit = cm\b/);
});
test('cases 09, 10 and 11: texture coordinates as lists, empty slashes and capitals are read', options, () => {
  isBase(accepted(sleeve('09_wedge_texcoord.ply')));
  isBase(accepted(sleeve('10_double_slash.obj', 'base.pc2', '--pattern', at('10_flat.obj'))));
  const { stdout } = run('field', '--worn', at('11_upper_case.stl'), '--pattern', at('11_flat.stl'), '--out', folder.path, '--json');
  const { vertices, faces } = JSON.parse(stdout);
  assert.deepEqual({ vertices, faces }, { vertices: 108, faces: 192 });
});
test('case 12: pieces that lie mirrored on each other are named', options, () => {
  refused(sleeve('12_mirrored_on_each_other.obj'), /front and back lie mirrored on each other/, /move one/);
});
test('case 13: an edge from a vertex to itself is left out with a note', options, () => {
  const { status, stdout, stderr } = run('steiner', at('13_self_loop.gr'));
  assert.equal(status, 0, stderr);
  assert.match(stdout, /^VALUE 2\n/);
  assert.match(stderr, /line 5/);
});
test('case 20: terminals by the number of the file lie at the places of the file, sewn or not', options, () => {
  for (const [terminals, point] of [['20_weld_terminals.json', [300, 0, 0]], ['20_weld_terminals2.json', [200, 0, 0]]]) {
    const { document } = accepted(layout('20_weld.obj', '--weld-mm', '0.01', '--terminals', at(terminals)));
    assert.deepEqual(document.terminals[0].point_mm, point);
    assert.deepEqual(document.terminals[1].point_mm, [0, 0, 0]);
  }
});
test('case 21: a terminal in a face of the file is at the same point with every refinement', options, () => {
  for (const [refinement, levels] of [['none', 1], ['midpoint', 1], ['midpoint', 4], ['centroid', 1], ['centroid', 4]]) {
    const { document } = accepted(
      layout('21_refine.obj', '--refinement', refinement, '--refine-levels', levels, '--terminals', at('21_refine_terminals.json')));
    const [terminal] = document.terminals;
    assert.deepEqual(terminal.point_mm, [160, 80, 0], refinement);
    assert.deepEqual([terminal.face, terminal.barycentric], [3, [0.2, 0.6, 0.2]], refinement);
  }
});
