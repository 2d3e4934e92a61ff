// What ended the last drive is told once, to the page that saw it.

import assert from "node:assert/strict";
import test from "node:test";

import { DriveEnd } from "../../src/page/drive_end.js";

const state = (reason, subsystem = 101) => ({ vehicle: { subsystem }, drive: { active: false, reason } });

test("a page that has just opened does not tell of a drive that ended before", () => {
  const end = new DriveEnd();
  assert.equal(end.update(null), "");
  assert.equal(end.update(state("no command from the page for 300 ms")), "");
  assert.equal(end.update(state("no command from the page for 300 ms")), "");
});

test("the end of a drive is told once, also while its words change", () => {
  const end = new DriveEnd();
  end.update(state(""));
  assert.equal(end.update(state("the picture is 1.2 s old")), "the picture is 1.2 s old");
  assert.equal(end.update(state("the picture is 1.3 s old")), "");
  assert.equal(end.update(state("no new pose for 1 s")), "no new pose for 1 s");
  end.update(state(""));
  assert.equal(end.update(state("no new pose for 1 s")), "no new pose for 1 s", "the next drive");
});

test("another vehicle's last drive is no news", () => {
  const end = new DriveEnd();
  end.update(state(""));
  assert.equal(end.update(state("no new pose for 1 s", 102)), "");
});
