// What lies over the map: fetched when it has changed, and bounded.

import assert from "node:assert/strict";
import test from "node:test";

import { Overlay, paintScan, paintZones } from "../../src/page/overlay.js";
import { Pull } from "../../src/page/pull.js";

/** A network with a clock: answers with `content` after `takes` milliseconds. */
function network(content, takes = 0) {
  const bench = { now: 0, asked: [], content };
  const fetch = async (path, options) => {
    bench.asked.push({ path, options, at: bench.now });
    bench.now += takes;
    return { ok: true, json: async () => bench.content };
  };
  bench.pull = new Pull(500, fetch, () => bench.now);
  return bench;
}

const settle = () => new Promise((resolve) => setImmediate(resolve));
const state = (zones, scan, age = 0, subsystem = 101) => ({
  vehicle: { subsystem, overlay: { zones, scan, scan_age_ms: age } },
});
const SQUARE = [[0, 0], [0, 9], [9, 9], [9, 0]];

test("nothing is fetched before something is reported, and zones only once", async () => {
  const bench = network({ zones_revision: 1, zones: [{ number: 1, points: SQUARE }], scan_revision: 0, scan: [], obstacles: [] });
  const overlay = new Overlay(null, bench.pull);
  overlay.update(state(0, 0, null), true, "secret", () => {});
  assert.equal(bench.asked.length, 0);
  overlay.update(state(1, 0, null), true, "secret", () => {});
  await settle();
  assert.deepEqual(bench.asked[0].path, { type: "overlay", zones: 0 });
  assert.equal(bench.asked[0].options.headers.Authorization, "Bearer secret");
  assert.equal(overlay.content.zones[0].points.length, 4);
  bench.now += 10_000;
  overlay.update(state(1, 0, null), true, "", () => {});
  assert.equal(bench.asked.length, 1);
  bench.content = { zones_revision: 1, zones: null, scan_revision: 5, scan: [[1, 2]], obstacles: [] };
  overlay.update(state(1, 5), true, "", () => {});
  await settle();
  assert.deepEqual(bench.asked[1].path, { type: "overlay", zones: 1 });
  assert.equal(overlay.content.zones.length, 1, "those that the page has");
  assert.deepEqual(overlay.content.scan, [{ x: 1, y: 2 }]);
});

test("scans are fetched at most twice a second, and less often on a slow link", async () => {
  for (const [takes, most] of [[0, 21], [1_000, 3]]) {
    const bench = network({ zones_revision: 0, scan_revision: 0, scan: [], obstacles: [] }, takes);
    const overlay = new Overlay(null, bench.pull);
    for (let revision = 1; bench.now < 10_000; revision++) {
      overlay.update(state(0, revision), true, "", () => {});
      await settle();
      bench.now += 100;
    }
    assert.ok(bench.asked.length <= most && bench.asked.length >= 2, `${takes} ms: ${bench.asked.length}`);
  }
});

test("a scan that is old is marked, and one that is much older not drawn", async () => {
  const bench = network({ zones_revision: 0, scan_revision: 1, scan: [[1, 2]], obstacles: [[3, 4]] });
  const overlay = new Overlay(null, bench.pull);
  overlay.update(state(0, 1), true, "", () => {});
  await settle();
  assert.equal(overlay.content.old, false);
  overlay.update(state(0, 1, 2_500), true, "", () => {});
  assert.equal(overlay.content.old, true);
  assert.equal(overlay.content.scan.length, 1);
  overlay.update(state(0, 1, 31_000), true, "", () => {});
  assert.deepEqual([overlay.content.scan, overlay.content.obstacles], [[], []]);
});

test("an answer about the vehicle before is dropped", async () => {
  const bench = network({ zones_revision: 1, zones: [{ number: 1, points: SQUARE }], scan_revision: 0 });
  const overlay = new Overlay(null, bench.pull);
  overlay.update(state(1, 0), true, "", () => {});
  overlay.update(state(0, 0, null, 102), true, "", () => {});
  await settle();
  assert.deepEqual(overlay.content.zones, []);
});

test("hostile answers are bounded and drawn without errors", async () => {
  const far = Array.from({ length: 100_000 }, (_, index) => [index, 1e300]);
  const zones = Array.from({ length: 5_000 }, () => ({ number: "x", points: far }));
  for (const content of [{ zones, scan: far, obstacles: far, cell_m: -1 }, { zones: [null, { points: [[NaN, 1], "x"] }], scan: "x" }, []]) {
    const bench = network({ ...content, zones_revision: 1, scan_revision: 1 });
    const overlay = new Overlay(null, bench.pull);
    overlay.update(state(1, 1), true, "", () => {});
    await settle();
    const { content: shown } = overlay;
    assert.ok(shown.zones.length <= 64 && shown.scan.length <= 1_024 && shown.obstacles.length <= 1_024);
    const context = new Proxy({}, { get: () => () => {}, set: () => true });
    paintZones(context, shown, () => [0, 0], { width: 1, height: 1 }, {});
    paintScan(context, shown, () => [0, 0], 24, {});
  }
});

test("an edge that is far longer than the screen is drawn without dashes", () => {
  const dashes = [];
  const context = new Proxy({}, { get: (_, name) => (...values) => name === "setLineDash" && dashes.push(values[0].length) });
  const zone = (side) => ({ zones: [{ number: 1, points: [{ x: 0, y: 0 }, { x: 0, y: side }, { x: side, y: side }] }] });
  const paint = (side) => paintZones(context, zone(side), ({ x, y }) => [y, x], { width: 300, height: 200 }, {});
  paint(100);
  assert.deepEqual(dashes.splice(0), [2, 0]);
  paint(1_000_000);
  assert.deepEqual(dashes.splice(0), [0, 0]);
});
