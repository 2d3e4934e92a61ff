import assert from "node:assert/strict";
import test from "node:test";

import { Flow } from "../../src/page/flow.js";

/** A flow with a clock of its own, and what it has sent. */
function rig() {
  const it = { now: 0, sent: [], open: true };
  it.flow = new Flow((frame) => it.open && it.sent.push(JSON.stringify(frame)) > 0, () => it.now);
  it.taken = () => it.sent.splice(0);
  return it;
}

const push = (forward) => ({ forward, turn: 0 });

test("nothing is driven before a state was shown", () => {
  const { flow, taken } = rig();
  assert.equal(flow.setpoint(push(0.5)), false);
  assert.deepEqual(taken(), []);
});

test("one setpoint is under way at most, and the newest replaces what waits", () => {
  const it = rig();
  it.flow.shown(12);
  assert.deepEqual(it.taken(), ["[12,0]"]);
  it.now = 40;
  for (const forward of [0.1, 0.2, 0.3]) assert.equal(it.flow.setpoint(push(forward)), true);
  assert.deepEqual(it.taken(), ["[12,40,0.1,0]"]);
  it.now = 90;
  it.flow.confirmed();
  assert.deepEqual(it.taken(), ["[12,90,0.3,0]"]);
  it.flow.confirmed();
  assert.deepEqual(it.taken(), []);
});

test("a release replaces a setpoint that waits, and is sent at once", () => {
  const it = rig();
  it.flow.shown(1);
  it.flow.setpoint(push(0.1));
  it.flow.setpoint(push(0.2));
  it.taken();
  it.flow.release();
  it.flow.release();
  assert.deepEqual(it.taken(), ['{"type":"drive_end"}']);
  it.flow.confirmed();
  it.flow.confirmed();
  assert.deepEqual(it.taken(), []);
});

test("a setpoint that waited too long is not sent", () => {
  const it = rig();
  it.flow.shown(1);
  it.flow.setpoint(push(0.1));
  it.flow.setpoint(push(0.2));
  it.taken();
  it.now = 250;
  it.flow.confirmed();
  assert.deepEqual(it.taken(), []);
});

test("a station that does not confirm is not driven to", () => {
  const it = rig();
  it.flow.shown(1);
  it.flow.setpoint(push(0.1));
  it.now = 1001;
  assert.equal(it.flow.setpoint(push(0.1)), false);
});

test("while a setpoint is under way, the next one confirms the state as well", () => {
  const it = rig();
  it.flow.shown(1);
  it.flow.setpoint(push(0.1));
  it.taken();
  it.now = 100;
  it.flow.shown(2);
  assert.deepEqual(it.taken(), []);
  it.flow.setpoint(push(0.2));
  it.now = 130;
  it.flow.confirmed();
  assert.deepEqual(it.taken(), ["[2,30,0.2,0]"]);
  it.flow.shown(3);
  it.flow.release();
  it.taken();
  it.flow.confirmed();
  it.flow.confirmed();
  assert.deepEqual(it.taken(), ["[3,0]"], "without a setpoint, the state is confirmed alone");
});

test("frames are small", () => {
  const it = rig();
  it.flow.shown(1234567);
  it.now = 300;
  it.flow.setpoint({ forward: -0.123456, turn: -0.123456 });
  const [confirmation, drive] = it.taken();
  assert.ok(confirmation.length <= 24, confirmation);
  assert.ok(drive.length <= 64, drive);
});

test("a new connection begins without what the old one had under way", () => {
  const it = rig();
  it.flow.shown(1);
  it.flow.setpoint(push(0.1));
  it.flow.setpoint(push(0.2));
  it.taken();
  it.flow.reset();
  assert.equal(it.flow.setpoint(push(0.1)), false, "it has shown no state yet");
  it.flow.confirmed();
  assert.deepEqual(it.taken(), []);
});
