// One button from arrival to driving by hand.

import assert from "node:assert/strict";
import test from "node:test";

import { get } from "./fake_elements.mjs";

let now = 0;
globalThis.setTimeout = () => {};
Object.defineProperty(globalThis, "performance", { value: { now: () => now }, configurable: true });
const { Engage } = await import("../../src/page/engage.js");

const vehicle = (state, subsystem = 101) => ({ subsystem, parts: [{ role: "primitive_driver", state, ours: true }] });
const free = { control: {}, vehicle: vehicle("standby") };
const held = (state) => ({ control: { held: true, wanted: true }, vehicle: vehicle(state) });

/** An operator who has pressed the button; `asked` is what the page has asked the station for since. */
function pressed() {
  const asked = [];
  let isReady = false;
  const engage = new Engage(
    async ({ type }) => (asked.push(type), null),
    { drives: false },
    () => (isReady = true),
  );
  engage.update(free, true, "");
  get("by-hand").click();
  return { engage, asked, isReady: () => isReady };
}

test("a packet that comes late does not take back the operator's word", async () => {
  const { engage, asked, isReady } = pressed();
  await null;
  engage.update(free, false, "");
  now += 400;
  engage.update(held("standby"), false, "");
  assert.deepEqual(asked, ["control"], "nothing is asked over a connection that does not answer");
  now += 100;
  engage.update(held("standby"), true, "");
  await null;
  assert.deepEqual(asked, ["control", "resume"]);
  engage.update(held("ready"), true, "");
  assert.ok(isReady());
});

test("a vehicle that is ready as another client has left it is resumed for this station", async () => {
  const { engage, asked, isReady } = pressed();
  await null;
  const left = { control: { held: true, wanted: true, resumed: false }, vehicle: vehicle("ready") };
  engage.update(left, true, "");
  await null;
  assert.deepEqual(asked, ["control", "resume"]);
  assert.ok(!isReady());
  assert.ok(!get("by-hand").hidden);
  engage.update({ ...left, control: { ...left.control, resumed: true } }, true, "");
  assert.ok(isReady());
  engage.update(left, true, "");
  assert.ok(!get("by-hand").hidden, "it says what to press");
});

test("a vehicle that is resumed and does not get ready can be tried again", async () => {
  const { engage, asked, isReady } = pressed();
  await null;
  engage.update(held("standby"), true, "");
  await null;
  now += 2_000;
  engage.update(held("standby"), true, "");
  assert.ok(get("by-hand").disabled, "it may take a while");
  now += 1;
  engage.update(held("standby"), true, "");
  assert.ok(!get("by-hand").disabled);
  get("by-hand").click();
  await null;
  engage.update(held("standby"), true, "");
  await null;
  engage.update(held("ready"), true, "");
  assert.deepEqual(asked, ["control", "resume", "control", "resume"]);
  assert.ok(isReady());
});

test("a connection that stays lost ends it: the vehicle does not become ready when it comes back", async () => {
  const { engage, asked, isReady } = pressed();
  await null;
  now += 2_500;
  engage.update(held("standby"), false, "");
  engage.update(held("standby"), true, "");
  await null;
  engage.update(held("ready"), true, "");
  assert.deepEqual(asked, ["control"]);
  assert.ok(!isReady());
});

test("another vehicle is not taken: the press meant the one that was shown", async () => {
  const { engage, asked } = pressed();
  await null;
  const other = { control: { held: true, wanted: true }, vehicle: vehicle("standby", 102) };
  engage.update(other, true, "");
  engage.update(other, true, "");
  await null;
  assert.deepEqual(asked, ["control"]);
});

test("an obstacle ends it at once", async () => {
  const { engage, asked } = pressed();
  engage.update(held("standby"), true, "Clear the emergency first");
  engage.update(held("standby"), true, "");
  await null;
  assert.deepEqual(asked, ["control"]);
});
