// What the page says about stopping.

import assert from "node:assert/strict";
import test from "node:test";

import { othersWords, pendingStops, stopAllWords, stopCondition, stopWords } from "../../src/page/stopping.js";

const vehicle = (changes) => ({ emergency: true, at_rest: true, runaway: false, ...changes });

test("an emergency is a stop only with a fresh speed that says so", () => {
  assert.equal(stopCondition(vehicle({}), true), "stopped");
  assert.equal(stopCondition(vehicle({ at_rest: false }), true), "stopping");
  assert.equal(stopCondition(vehicle({ at_rest: null }), true), "unknown");
  assert.equal(stopCondition(vehicle({ at_rest: undefined }), true), "unknown");
  assert.equal(stopCondition(vehicle({}), false), "unknown", "the picture is old");
  assert.equal(stopCondition(vehicle({ at_rest: false, runaway: true }), true), "runaway");
  assert.equal(stopCondition(vehicle({ emergency: false }), true), null);
  assert.equal(stopCondition(null, true), null);
});

test("the button says the speed while the vehicle stops, and 'stopped' in no other case", () => {
  assert.deepEqual(stopWords("stopping", 1.68), ["Stopping", "1.7 m/s"]);
  assert.deepEqual(stopWords("stopping", -0.4), ["Stopping", "0.4 m/s"]);
  assert.deepEqual(stopWords("stopping", 0.0), ["Stopping", "still moving"], "it turns");
  assert.deepEqual(stopWords("unknown", 0), ["Emergency", "stop reported, speed unknown"]);
  for (const condition of ["stopping", "unknown", "runaway"]) {
    assert.doesNotMatch(stopWords(condition, null).join(" "), /stopped/);
  }
});

test("all are stopped only if each of them is measured at rest", () => {
  const one = (changes) => ({ presence: "present", state: "emergency", emergency: true, at_rest: true, runaway: false, ...changes });
  assert.equal(stopAllWords([one(), one()], false), "all are stopped");
  assert.equal(stopAllWords([one(), one({ at_rest: false })], false), "1 still moving");
  assert.equal(stopAllWords([one(), one({ at_rest: null })], true), "stop reported, 1 unknown speed");
  assert.equal(stopAllWords([one(), one({ emergency: false })], true), "1 not stopped yet");
  assert.equal(stopAllWords([one(), one({ emergency: false })], false), "2 vehicles");
  assert.equal(stopAllWords([one(), one({ at_rest: false, runaway: true })], false), "1 RUNAWAY");
  assert.equal(stopAllWords([one({ emergency: false, runaway: true })], false), "1 RUNAWAY", "another part is not stopped");
  assert.equal(stopAllWords([], false), "0 vehicles");
  assert.equal(stopAllWords([one(), one({ presence: "silent", stop_set: false })], true), "1 not stopped yet");
  for (const mute of [{ presence: "silent", stop_set: true }, { presence: "gone" }, { state: null, stop_set: true }]) {
    assert.equal(stopAllWords([one(), one(mute)], true), "1 stopped, 1 not heard");
  }
  assert.equal(pendingStops([one(), one({ emergency: false }), one({ emergency: false, presence: "gone" })]), 1);
});

test("who may not clear the emergency of others reads who can", () => {
  assert.match(othersWords(false), /Another client.*An administrator can/);
  assert.match(othersWords(true), /Another client.*only if you know why/);
});
