// A request for control is answered by who has read it.

import assert from "node:assert/strict";
import test from "node:test";

import { get } from "./fake_elements.mjs";

const { Handover } = await import("../../src/page/handover.js");

const request = (operator) => ({ part: "101.1.33", operator, authority: 100, explanation: "please" });
const state = (...operators) => ({ control: { requests: operators.map(request) } });

function bench() {
  const it = { now: 0, asked: [] };
  it.handover = new Handover((answer) => it.asked.push(answer.operator), () => it.now);
  return it;
}

test("the request that is shown stays until it is gone, whichever comes first", () => {
  const it = bench();
  it.handover.update(state("60.1.8"), true);
  it.now = 2_000;
  it.handover.update(state("60.1.9", "60.1.8"), true);
  get("handover-yes").click();
  assert.deepEqual(it.asked, ["60.1.8"]);
});

test("a click that was meant for the request before answers no other one", () => {
  const it = bench();
  it.handover.update(state("60.1.8"), true);
  it.now = 2_000;
  it.handover.update(state("60.1.9"), true);
  it.now = 2_500;
  assert.ok(get("handover-yes").disabled);
  get("handover-yes").click();
  assert.deepEqual(it.asked, []);
  it.now = 3_000;
  it.handover.update(state("60.1.9"), true);
  assert.ok(!get("handover-no").disabled);
  get("handover-no").click();
  assert.deepEqual(it.asked, ["60.1.9"]);
});
