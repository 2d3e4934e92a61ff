// The map: what holds a vehicle lies where the operator looks.

import assert from "node:assert/strict";
import test from "node:test";

import { FakeElement, get } from "./fake_elements.mjs";

/** A canvas context that knows what was painted, by colour. */
const painted = [];
const context = new Proxy({}, {
  get: (style, name) => style[name] ?? (() => ["fillRect", "stroke"].includes(name) && painted.push(name === "stroke" ? style.strokeStyle : style.fillStyle)),
});
let frame = null;
Object.assign(globalThis, {
  ResizeObserver: class { observe() {} },
  requestAnimationFrame: (draw) => (frame = draw),
  getComputedStyle: () => ({ getPropertyValue: (name) => name }),
  devicePixelRatio: 1,
});
Object.assign(document, { documentElement: new FakeElement() });
Object.assign(get("map"), { clientWidth: 300, clientHeight: 200, width: 300, height: 200, getContext: () => context });

const { MapView } = await import("../../src/page/map.js");

const SQUARE = [[2, 2], [2, 4], [4, 4], [4, 2]];
const OVERLAY = { zones_revision: 1, zones: [{ number: 7, points: SQUARE }], scan_revision: 1, scan: [[1, 1]], obstacles: [[3, 3]], cell_m: 0.5 };

test("zones, obstacles and the scan of a vehicle are drawn", async () => {
  const map = new MapView(() => {}, async () => OVERLAY);
  const vehicle = { subsystem: 101, pose: { x: 0, y: 0, yaw: 0, age_ms: 0 }, overlay: { zones: 1, scan: 1, scan_age_ms: 0 } };
  const draw = async () => {
    map.update({ vehicle }, true, "");
    await new Promise((resolve) => setImmediate(resolve));
    painted.length = 0;
    frame();
    return painted;
  };
  await draw();
  const colours = await draw();
  assert.ok(colours.includes("--map-zone"), "the zone's edge");
  assert.equal(colours.filter((colour) => colour === "--map-obstacle").length, 2, "the obstacle and the scan's point");
});

test("places where no vehicle can be leave the page able to draw, and so to stop", async () => {
  for (const far of [1e18, -1e300, 1e6 + 1]) {
    const map = new MapView(() => {}, async () => ({ zones_revision: 1, zones: [{ number: 1, points: [[far, 0], [0, far], [9, 9]] }] }));
    const info = { id: 1, revision: 1, rows: 1, columns: 1, cell_m: 1, x: far, y: 0 };
    const vehicle = { subsystem: 101, pose: { x: far, y: 0, yaw: 0, age_ms: 0 }, overlay: { zones: 1, scan: 0 } };
    const mission = { stage: "driving", path: [[far, 0], [0, 0]], destination: [0, far] };
    for (const cell_m of [1, Math.abs(far)]) map.update({ vehicle, mission, map: { ...info, cell_m } }, true, "");
    await new Promise((resolve) => setImmediate(resolve));
    painted.length = 0;
    frame();
    assert.ok(painted.length < 100, `${painted.length} lines for ${far}`);
  }
});
