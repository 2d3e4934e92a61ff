// Which alarms sound, and that each sounds once.

import assert from "node:assert/strict";
import test from "node:test";

import { Alarms } from "../../src/page/alarms.js";

const state = (changes = {}, rest = {}) => ({
  vehicle: { subsystem: 101, emergency: false, runaway: false, missing: [], parts: [], ...changes },
  drive: { active: false },
  mission: null,
  ...rest,
});

test("an alarm sounds when it begins, and again only after it was over", () => {
  const alarms = new Alarms();
  assert.equal(alarms.update(state(), true), null);
  assert.equal(alarms.update(state({ emergency: true }), true), "bad");
  assert.equal(alarms.update(state({ emergency: true }), true), null);
  assert.equal(alarms.update(state(), true), null);
  assert.equal(alarms.update(state({ emergency: true }), true), "bad");
});

test("what a page finds when it opens does not sound, except a runaway", () => {
  assert.equal(new Alarms().update(state({ emergency: true }), true), null);
  const alarms = new Alarms();
  assert.equal(alarms.update(state({ emergency: true, runaway: true }), true), "runaway");
  assert.ok(alarms.runaway);
  alarms.update(state({ emergency: true }), true);
  assert.ok(!alarms.runaway);
});

test("another vehicle brings its own alarms, which have begun before", () => {
  const alarms = new Alarms();
  alarms.update(state(), true);
  assert.equal(alarms.update(state({ subsystem: 102, emergency: true }), true), null);
});

test("missing parts, failures, ended drives and lost planners sound", () => {
  const cases = [
    [state({ missing: [{ id: "101.2.40", role: "pose_sensor", how: "silent" }] }), "warn"],
    [state({ missing: [{ id: "101.2.63", role: "planner", how: "gone" }] }), "bad"],
    [state({ parts: [{ id: "101.2.33", state: "failure" }] }), "bad"],
    [state({}, { drive: { active: false, reason: "no new pose for 1 s" } }), "bad"],
    [state({}, { mission: { mission: 7, lost: { id: "101.2.63" } } }), "bad"],
    [state({}, { mission: { mission: 7, stage: "failed" } }), "warn"],
  ];
  for (const [begun, level] of cases) {
    const alarms = new Alarms();
    alarms.update(state(), true);
    assert.equal(alarms.update(begun, true), level);
    assert.equal(alarms.update(begun, true), null);
  }
});

test("a runaway of another vehicle sounds", () => {
  const alarms = new Alarms();
  alarms.update(state(), true, [{ subsystem: 102, runaway: false }]);
  assert.equal(alarms.update(state(), true, [{ subsystem: 102, runaway: true }, null]), "runaway");
});

test("a stale link sounds only while this page drives, and an emergency is not new after it", () => {
  const alarms = new Alarms();
  const driven = state({}, { drive: { active: true }, control: { page: 3 } });
  alarms.update(state({ emergency: true }), true);
  assert.equal(alarms.update(state({ emergency: true }), false), null);
  assert.equal(alarms.update(state({ emergency: true }), true), null);
  alarms.update(driven, true, [], 3);
  assert.equal(alarms.update(driven, false, [], 3), "bad");
  assert.equal(alarms.update(state(), false), null, "once");
});

test("a stale link does not sound on a page that watches another one drive", () => {
  const driven = state({}, { drive: { active: true }, control: { page: 3 } });
  for (const page of [4, null, undefined]) {
    const alarms = new Alarms();
    alarms.update(driven, true, [], page);
    assert.equal(alarms.update(driven, false, [], page), null);
  }
});

test("hostile values are no alarms and no errors", () => {
  const alarms = new Alarms();
  alarms.update(state(), true);
  for (const vehicle of [null, 7, { subsystem: {}, missing: "x", parts: [null, 3], emergency: "yes", runaway: 1 }]) {
    assert.equal(alarms.update({ vehicle, mission: 3, drive: null }, true), null);
  }
});
