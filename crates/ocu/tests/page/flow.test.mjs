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

test("on a short link one setpoint is under way, and the newest replaces what waits", () => {
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

test("a setpoint tells for how long the hand counts when it is sent, and is not sent after that", () => {
  const it = rig();
  it.flow.shown(1);
  it.taken();
  it.flow.setpoint({ ...push(0.1), expiry: 250 });
  it.flow.setpoint({ ...push(0.2), expiry: 250 });
  it.now = 99.5;
  it.flow.confirmed();
  assert.deepEqual(it.taken(), ["[1,0,0.1,0,250]", "[1,100,0.2,0,151]"]);
  it.flow.setpoint({ ...push(0.3), expiry: 150 });
  it.now = 150;
  it.flow.confirmed();
  assert.deepEqual(it.taken(), []);
});

test("the time that drawing takes is the page's own", () => {
  const it = rig();
  it.now = 100;
  it.flow.shown(12, 60);
  assert.deepEqual(it.taken(), ["[12,40]"]);
  it.now = 150;
  it.flow.setpoint(push(0.5));
  assert.deepEqual(it.taken(), ["[12,90,0.5,0]"]);
});

test("a release replaces a setpoint that waits, and is sent at once", () => {
  const it = rig();
  it.flow.shown(1);
  it.flow.setpoint(push(0.1));
  it.flow.setpoint(push(0.2));
  it.taken();
  it.flow.release();
  it.flow.release();
  assert.deepEqual(it.taken(), ["[]"]);
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

test("nothing is driven by a state that is too old for the station, and the drive goes on by the next one", () => {
  const it = rig();
  it.flow.shown(1);
  it.taken();
  it.now = 361;
  assert.equal(it.flow.setpoint(push(0.1)), true);
  assert.deepEqual(it.taken(), []);
  it.flow.shown(2);
  assert.equal(it.flow.setpoint(push(0.1)), true);
  assert.deepEqual(it.taken(), ["[2,0]", "[2,0,0.1,0]"]);
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

test("after a drive, states are confirmed at once although its last frames are still under way, unless they are late", () => {
  const it = rig();
  it.flow.estimate(600);
  it.flow.shown(1);
  it.flow.setpoint(push(0.5));
  it.flow.release();
  it.taken();
  it.now = 700;
  it.flow.shown(2);
  assert.deepEqual(it.taken(), ["[2,0]"]);
  it.now = 701;
  it.flow.shown(3);
  assert.deepEqual(it.taken(), [], "the link queues");
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

/** Drives every 100 ms for `time` ms, over a link that takes `frame` ms for each frame and `delay` ms for the
 * rest of the round trip. Returns what was sent and the most setpoints under way, both in the last 5 s. */
function drive(it, time, frame, delay) {
  const arriving = (it.arriving ??= []);
  let [most, sent, freeAt] = [0, 0, it.now];
  for (const end = it.now + time; it.now < end; it.now += 10) {
    while (arriving.length && arriving[0] <= it.now) {
      arriving.shift();
      it.flow.confirmed();
    }
    if (it.now % 100 === 0) {
      it.flow.shown(it.now);
      it.flow.setpoint(push(0.5));
    }
    for (const sentFrame of it.taken()) {
      const isSetpoint = sentFrame.split(",").length > 2;
      if (!isSetpoint) continue;
      freeAt = Math.max(freeAt, it.now) + frame;
      arriving.push(freeAt + delay);
      if (it.now >= end - 5_000) sent += 1;
    }
    if (it.now >= end - 5_000) most = Math.max(most, arriving.length);
  }
  return { sent, most };
}

test("a link with a round trip of 0.6 s carries ten setpoints a second", () => {
  for (const delay of [0, 300, 600, 700]) {
    const it = rig();
    it.flow.shown(1);
    it.taken();
    assert.equal(drive(it, 10_000, 0, delay).sent, 50, `${delay} ms`);
  }
});

test("what the station has measured counts from the first setpoint", () => {
  const it = rig();
  it.flow.estimate(600);
  it.flow.shown(1);
  it.taken();
  for (const expected of [1, 1, 1, 1, 1, 1, 1, 0]) {
    it.flow.setpoint(push(0.5));
    assert.equal(it.taken().length, expected);
    it.now += 20;
  }
});

test("a link that begins to queue has one setpoint under way", () => {
  for (const delay of [0, 600]) {
    const it = rig();
    it.flow.shown(1);
    it.taken();
    drive(it, 5_000, 0, delay);
    drive(it, 4_000, 400, delay);
    assert.ok(drive(it, 5_000, 400, delay).most <= 2, `${delay} ms`);
  }
});

test("after a queue, ten setpoints a second follow again", () => {
  const it = rig();
  it.flow.shown(1);
  it.taken();
  drive(it, 5_000, 0, 600);
  drive(it, 3_000, 400, 600);
  assert.equal(drive(it, 10_000, 0, 600).sent, 50);
});

test("one late confirmation is no queue", () => {
  const it = rig();
  it.flow.estimate(600);
  it.flow.shown(1);
  drive(it, 5_000, 0, 600);
  it.taken();
  for (let count = 0; count < 10; count++) it.flow.confirmed();
  it.flow.setpoint(push(0.5));
  it.now += 720;
  it.flow.shown(2);
  it.taken();
  it.flow.confirmed();
  it.flow.setpoint(push(0.5));
  it.flow.setpoint(push(0.6));
  assert.deepEqual(it.taken(), ["[2,0]", "[2,0,0.5,0]", "[2,0,0.6,0]"]);
});
