// Every event that ends a drive, with every source: what was held before it does not count after it.

import assert from "node:assert/strict";
import test from "node:test";

import { browser, clock, showSheet, stick } from "./fake_page.mjs";
import { Input } from "../../src/page/input.js";
import { InputEvents } from "../../src/page/input_events.js";

const input = new Input();
const events = new InputEvents(input, stick, () => {});

const key = (type, code, more = {}) => {
  const event = browser.fire(type, { code, key: code, repeat: false, ...more });
  if (type === "keydown") events.keyDown(event);
};
const pointer = (type, pointerType, more = {}) => {
  const pointerId = pointerType === "mouse" ? 1 : 7;
  const at = { pointerId, pointerType, isPrimary: true, button: type === "pointermove" ? -1 : 0, buttons: 1, clientX: 0, clientY: -30, ...more };
  stick.fire(type, at);
};
const lose = (id) => {
  stick.captured.delete(id);
  for (const pointerType of ["mouse", "touch"]) pointer("lostpointercapture", pointerType, { pointerId: id });
};
const pad = (isHeld) => {
  const buttons = Array.from({ length: 12 }, (_, button) => ({ pressed: isHeld && button === 4 }));
  events.handlePads([{ index: 0, connected: true, timestamp: clock.now, axes: [0, -1], buttons }]);
};

const SOURCES = {
  Keys: {
    takeUp: () => key("keydown", "KeyW"),
    hold: () => key("keydown", "KeyW", { repeat: true }),
    letGo: () => key("keyup", "KeyW"),
    lose: null,
  },
  Mouse: {
    takeUp: () => pointer("pointerdown", "mouse"),
    hold: () => pointer("pointermove", "mouse"),
    letGo: () => pointer("pointerup", "mouse"),
    lose: () => lose(1),
  },
  Touch: {
    takeUp: () => pointer("pointerdown", "touch"),
    hold: () => pointer("pointermove", "touch"),
    letGo: () => pointer("pointerup", "touch"),
    lose: () => lose(7),
  },
  Gamepad: {
    takeUp: () => pad(true),
    hold: () => pad(true),
    letGo: () => pad(false),
    lose: () => events.handlePads([]),
  },
};

const modifier = (type, name) => () => browser.fire(type, { key: name, code: name });

/** Each ends the drive of every source. */
const ENDINGS = {
  "a menu": () => browser.fire("contextmenu", { target: {}, pointerType: "mouse", pointerId: 1 }),
  "a menu of the menu key": () => browser.fire("contextmenu", { target: {}, pointerType: "", pointerId: -1 }),
  "blur": () => browser.fire("blur"),
  "visibilitychange": () => {
    document.hidden = true;
    document.fire("visibilitychange");
    document.hidden = false;
  },
  "pagehide": () => browser.fire("pagehide"),
  "freeze": () => document.fire("freeze"),
  "resize": () => browser.fire("resize"),
  "rotation": () => screen.orientation.fire("change"),
  "rotation of an old system": () => browser.fire("orientationchange"),
  "a keyboard on the screen": () => browser.visualViewport.fire("resize"),
  "a dialog": () => {
    showSheet(true);
    showSheet(false);
  },
  "a field with the focus": () => browser.fire("focusin", { target: { matches: () => true } }),
  "another view": () => events.end("the Drive view was left"),
};
for (const name of ["Control", "Alt", "AltGraph", "Meta"]) {
  ENDINGS[`${name} down`] = modifier("keydown", name);
  ENDINGS[`${name} up`] = modifier("keyup", name);
}

/** Lets 2 s pass with a source held. */
function hold(source) {
  for (let times = 0; times < 100; times++) {
    clock.now += 20;
    source.hold();
    if (times % 5 === 0) input.poll(clock.now, events.captured);
  }
}

/** Nothing is held, and all keys have been silent. */
function rest() {
  for (const source of Object.values(SOURCES)) source.letGo();
  clock.now += 1000;
  pad(false);
  input.hinder("", clock.now);
  input.takeNotice();
}

for (const [name, source] of Object.entries(SOURCES)) {
  for (const [ending, happen] of Object.entries(ENDINGS)) {
    test(`${ending} ends what ${name} drives`, () => {
      rest();
      source.takeUp();
      hold(source);
      assert.equal(input.owner, name);
      happen();
      assert.equal(input.owner, null);
      assert.notEqual(input.ending, "");
      hold(source);
      assert.equal(input.owner, null, "still held");
      source.letGo();
      source.takeUp();
      assert.equal(input.owner, name, "taken up anew");
    });
  }

  for (const how of ["letGo", "lose"]) {
    if (!source[how]) continue;
    test(`${name}: ${how} ends the drive`, () => {
      rest();
      source.takeUp();
      hold(source);
      assert.equal(input.owner, name);
      source[how]();
      assert.equal(input.owner, null);
    });
  }
}

test("a finger that rests on the stick asks for a menu, gets none, and drives on", () => {
  rest();
  SOURCES.Touch.takeUp();
  let isPrevented = false;
  browser.fire("contextmenu", { target: stick, pointerType: "touch", pointerId: 7, preventDefault: () => (isPrevented = true) });
  assert.ok(isPrevented);
  assert.equal(input.owner, "Touch");
});

test("the focus that leaves an element inside the page ends nothing", () => {
  rest();
  SOURCES.Keys.takeUp();
  browser.fire("blur", { target: {} });
  assert.equal(input.owner, "Keys");
});

test("a key that is still down when the focus returns does not drive, even if its repeats look like presses", () => {
  rest();
  SOURCES.Keys.takeUp();
  browser.fire("blur");
  clock.now += 5000;
  browser.fire("focus");
  for (let times = 0; times < 20; times++) {
    clock.now += 30;
    SOURCES.Keys.takeUp();
    assert.equal(input.owner, null);
  }
});

test("a key with a modifier does not drive, and ends what does", () => {
  rest();
  SOURCES.Keys.takeUp();
  key("keydown", "KeyW", { repeat: true, ctrlKey: true });
  assert.equal(input.owner, null);
  key("keydown", "KeyD", { getModifierState: (name) => name === "AltGraph" });
  assert.equal(input.owner, null);
});

test("what a script pretends does not drive", () => {
  rest();
  key("keydown", "KeyW", { isTrusted: false });
  pointer("pointerdown", "mouse", { isTrusted: false });
  assert.equal(input.owner, null);
});
