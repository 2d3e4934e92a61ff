// Small texts of the page: links, the list of vehicles, and reasons of missions.

import assert from "node:assert/strict";
import test from "node:test";

import { condition, controller } from "../../src/page/fleet.js";
import { currentReason } from "../../src/page/mission.js";
import { forgetElements, get } from "./fake_elements.mjs";

const { hop, hops, showStatus } = await import("../../src/page/status.js");

test("both hops show their round trip and their loss, as far as they are known", () => {
  assert.equal(hop(42.4, 0), "42 ms");
  assert.equal(hop(1_530, 12.6), "1.5 s, 13 % lost");
  assert.equal(hop(null, null), "");
  const quality = { roundTripMs: 20, lossPercent: 0, vehicleRoundTripMs: 310, vehicleLossPercent: 5, wayBack: true };
  assert.equal(hops(quality), "station 20 ms · vehicle 310 ms, 5 % lost");
  assert.equal(hops(null), "");
  assert.equal(hops({ roundTripMs: "x", vehicleRoundTripMs: 9 }), "vehicle 9 ms");
});

test("a state that the vehicle has reported long ago is marked, and its age is said", () => {
  const shown = (age, late) => {
    forgetElements();
    const parts = [{ role: "primitive_driver", managed: true, state: "ready" }];
    showStatus({ vehicle: { parts, status_age_ms: age, pose: { x: 1, age_ms: 100 }, velocity: { x: 1, age_ms: 100 } } }, late);
    return [get("state").getAttribute("data-old"), get("state-old").textContent];
  };
  assert.deepEqual(shown(100, 0), [null, ""]);
  assert.deepEqual(shown(60_000, 0), ["yes", "60 s old: state"]);
  assert.equal(shown(100, 5_000)[0], "yes", "the picture itself is old");
});

test("the list says who of this station drives, and whether a vehicle moves in emergency", () => {
  const vehicle = { presence: "present", state: "emergency", at_rest: true };
  assert.equal(condition(vehicle), "Emergency");
  assert.equal(condition({ ...vehicle, at_rest: false, speed: 1.68 }), "Emergency, 1.7 m/s");
  assert.equal(condition({ ...vehicle, at_rest: false, runaway: true }), "RUNAWAY");
  assert.equal(controller({ held: true, driver: "alice (page 3)" }, 7), "alice (page 3) controls it");
  assert.equal(controller({ held: true, driver: "alice (page 7)" }, 7), "you control it");
  assert.equal(controller({ held: true, driver: "" }, 7), "this station controls it");
  assert.equal(controller({ controller: "43.1.1", authority: 200 }), "43.1.1 controls it (200)");
});

test("the reason of an earlier attempt is not shown while the mission drives well", () => {
  const mission = { reason: "no control of 101.3.48", attempt: 2 };
  assert.equal(currentReason("driving", mission, { held: null }), "");
  assert.equal(currentReason("driving", mission, { held: { reason: "an obstacle is 0.4 m away" } }), "held: an obstacle is 0.4 m away");
  assert.equal(currentReason("failed", mission, {}), "no control of 101.3.48");
  assert.equal(currentReason("driving", { reason: "returns: control is lost" }, {}), "returns: control is lost");
});
