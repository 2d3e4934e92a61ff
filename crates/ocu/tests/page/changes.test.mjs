import assert from "node:assert/strict";
import test from "node:test";

import { changed } from "../../src/page/changes.js";

test("what is not named is as before, and so in objects within", () => {
  const before = { seq: 1, mission: null, map: { id: 1 }, vehicle: { name: "Rover", pose: { x: 1, y: 2 }, parts: [1, 2] } };
  const after = changed(before, { seq: 2, mission: { stage: "idle" }, map: null, vehicle: { pose: { y: 3 }, parts: [4] } });
  assert.deepEqual(after, { seq: 2, mission: { stage: "idle" }, map: null, vehicle: { name: "Rover", pose: { x: 1, y: 3 }, parts: [4] } });
  assert.deepEqual(changed(after, {}), after);
  assert.deepEqual(before.vehicle.pose, { x: 1, y: 2 }, "who still shows the state before has that");
});

test("the first state has all fields, also after another connection", () => {
  const state = { seq: 1, vehicle: { pose: null } };
  assert.deepEqual(changed(null, state), state);
  assert.deepEqual(changed({ vehicle: null }, state), state);
});

test("a field with the name of a prototype is a field", () => {
  const after = changed({}, JSON.parse('{"__proto__":{"polluted":1},"constructor":2}'));
  assert.equal(after.polluted, undefined);
  assert.equal({}.polluted, undefined);
});
