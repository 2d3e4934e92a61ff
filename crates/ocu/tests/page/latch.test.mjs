// The latch of a stop of all: shown, also with one vehicle, and cleared as it was set.

import assert from "node:assert/strict";
import test from "node:test";

import { forgetElements, get } from "./fake_elements.mjs";

const { Emergency } = await import("../../src/page/emergency.js");

const stopped = { subsystem: 101, presence: "present", state: "emergency", at_rest: true };
const standing = { ...stopped, state: "standby" };

function page() {
  forgetElements();
  const requests = [];
  const link = Object.assign(new EventTarget(), {
    open: true,
    vehicle: 101,
    send: (request) => requests.push(request),
    // No answer comes within the test.
    ask: (request) => new Promise(() => requests.push(request)),
  });
  const emergency = new Emergency(link, () => {});
  const update = (vehicle, allStopped, clears = true) => {
    const state = { vehicle: { ...vehicle, emergency: vehicle.state === "emergency" } };
    emergency.update(state, true, { vehicles: [vehicle], allStopped }, "", { clears, clearsAny: false });
  };
  return { update, requests };
}

test("that vehicles which join are stopped is shown, also with one vehicle and after its emergency", () => {
  const { update } = page();
  update(standing, false);
  assert.ok(get("latch").hidden);
  update(stopped, true);
  assert.ok(!get("latch").hidden);
  assert.ok(!get("clear-all").hidden, "with one vehicle");
  update(standing, true);
  assert.ok(!get("latch").hidden, "no emergency is left, and the next vehicle would be stopped");
});

test("the latch is cleared as it was set, by who may clear emergencies", () => {
  for (const button of ["latch-clear", "clear-all"]) {
    const { update, requests } = page();
    update(stopped, true);
    get(button).click();
    const [{ press, stops, ...request }] = requests;
    assert.deepEqual(request, { type: "emergency_all", on: false }, button);
    assert.equal(press.length, 2, "by which the station knows late copies of its stops");
    assert.equal(stops, 0, "by which it knows which stops the operator has seen");
  }
  page().update(stopped, true, true);
  assert.ok(!get("latch-clear").disabled);
  page().update(stopped, true, false);
  assert.ok(get("latch-clear").disabled);
});
