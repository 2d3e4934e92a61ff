// Who drives, in virtual time: what each source has to prove, and what ends it.

import assert from "node:assert/strict";
import test from "node:test";

import { Input } from "../../src/page/input.js";

/** An input with a clock: it is polled every 100 ms, and when a proof expires, as the page does. */
class Bench {
  now = 1000;
  input = new Input();
  captured = null;
  last = null;

  constructor() {
    this.input.hinder("", this.now);
  }

  /** Lets time pass; `each` happens every `period` milliseconds. */
  pass(milliseconds, period = 100, each = () => {}) {
    const end = this.now + milliseconds;
    while (this.now < end) {
      this.now += 10;
      if (this.now % period === 0) each();
      if (this.now % 100 === 0 || this.now >= this.input.expiry) this.poll();
    }
  }

  poll() {
    this.last = this.input.poll(this.now, this.captured);
    return this.last;
  }

  press(code) {
    this.input.handleKeyDown({ code, repeat: false }, this.now, this.now);
    this.poll();
  }

  repeat(code) {
    this.input.handleKeyDown({ code, repeat: true }, this.now, this.now);
  }

  lift(code) {
    this.input.handleKeyUp(code, this.now, this.now);
  }

  touch(x, y, more = {}) {
    const pointer = { id: 7, isMouse: false, isPrimary: true, buttons: 1, x, y, ...more };
    this.captured = pointer.id;
    this.input.handlePointerDown(pointer, this.now, this.now);
    this.poll();
  }

  move(x, y, buttons = 1) {
    this.input.handlePointerMove({ id: 7, buttons, x, y });
    this.poll();
  }

  pad({ isHeld = true, timestamp = this.now, forward = 0, connected = true, index = 0 } = {}) {
    const buttons = Array.from({ length: 12 }, (_, button) => ({ pressed: isHeld && button === 5 }));
    this.input.handlePads([{ index, connected, timestamp, axes: [0, -forward], buttons }], this.now);
  }

  get owner() {
    return this.input.owner;
  }
}

// Keys

test("a key drives by the system's repeats, for as long as they come", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(650);
  assert.equal(bench.owner, "Keys");
  bench.pass(5000, 30, () => bench.repeat("KeyW"));
  assert.equal(bench.owner, "Keys");
  assert.deepEqual(bench.last.vector, [1, 0]);
  const last = bench.now - (bench.now % 30);
  bench.pass(last + 390 - bench.now);
  assert.equal(bench.owner, "Keys");
  bench.pass(10);
  assert.equal(bench.owner, null, "a key whose release got lost");
  assert.match(bench.input.takeNotice(), /press again/);
});

test("a key that is let go ends the drive without a notice", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(300);
  bench.lift("KeyW");
  assert.equal(bench.owner, null);
  assert.equal(bench.input.takeNotice() + bench.input.ending, "");
});

test("where no repeats come, a key drives 0.7 s at most and the page says so", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(690);
  assert.equal(bench.owner, "Keys");
  bench.pass(10);
  assert.equal(bench.owner, null);
  assert.match(bench.input.takeNotice(), /no key repeats/);
});

test("one repeat renews all held keys", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(500);
  bench.press("KeyD");
  bench.pass(3000, 30, () => bench.repeat("KeyD"));
  assert.equal(bench.owner, "Keys");
  assert.deepEqual(bench.last.vector, [1, 1]);
});

test("if the repeating key is let go, the others drive 0.4 s at most", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(100);
  bench.press("KeyD");
  bench.pass(600, 30, () => bench.repeat("KeyD"));
  bench.lift("KeyD");
  bench.pass(360);
  assert.equal(bench.owner, "Keys");
  assert.deepEqual(bench.last.vector, [1, 0]);
  bench.pass(40);
  assert.equal(bench.owner, null);
  assert.match(bench.input.takeNotice(), /press again/);
});

test("if the key that repeats is let go before its first repeat, the others drive 0.4 s at most", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(100);
  bench.press("KeyD");
  bench.lift("KeyD");
  bench.pass(400);
  assert.equal(bench.owner, null);
});

test("a repeat alone begins nothing", () => {
  const bench = new Bench();
  bench.pass(1000, 30, () => bench.repeat("KeyW"));
  assert.equal(bench.owner, null);
});

test("another key begins nothing", () => {
  const bench = new Bench();
  bench.press("KeyX");
  assert.equal(bench.owner, null);
  assert.equal(bench.input.takeNotice(), "");
});

test("a key that was pressed against an obstacle does not count with the next one", () => {
  const bench = new Bench();
  bench.input.hinder("Not connected", bench.now);
  bench.press("KeyW");
  bench.input.hinder("", bench.now);
  bench.press("KeyD");
  assert.deepEqual(bench.last.vector, [0, 0.2]);
});

test("repeats of a key that no drive began with renew nothing", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(800, 30, () => bench.repeat("KeyX"));
  assert.equal(bench.owner, null);
});

test("a key that was let go out of the page's sight blocks no other source", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.input.end("blur", bench.now);
  bench.pass(2000);
  bench.touch(0, 0);
  assert.equal(bench.owner, "Touch");
  bench.input.handlePointerUp(7);
  bench.press("KeyS");
  assert.equal(bench.owner, "Keys");
  assert.deepEqual(bench.last.vector, [-0.2, 0]);
  bench.lift("KeyS");
  bench.input.handleFocus(bench.now);
  bench.pass(800);
  bench.press("KeyW");
  assert.equal(bench.owner, "Keys", "the key itself, once it has been silent");
});

test("after an end a held key counts only when it was let go, even if its repeats look like presses", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.pass(600, 30, () => bench.repeat("KeyW"));
  bench.input.end("blur", bench.now);
  bench.pass(3000);
  bench.input.handleFocus(bench.now);
  bench.pass(2000, 30, () => bench.press("KeyW"));
  assert.equal(bench.owner, null);
  assert.match(bench.input.takeNotice(), /press it again/);
  bench.lift("KeyW");
  bench.press("KeyW");
  assert.equal(bench.owner, "Keys");
});

test("opposite keys ask for nothing", () => {
  const bench = new Bench();
  bench.press("KeyW");
  bench.press("KeyS");
  assert.deepEqual(bench.last.vector, [0, 0]);
});

// Mouse and touch

test("the first touch is the stick's centre, wherever it is", () => {
  const bench = new Bench();
  bench.touch(300, 500);
  assert.deepEqual(bench.last, { source: "Touch", vector: [0, 0] });
  bench.move(300, 470);
  assert.deepEqual(bench.last.vector, [0.5, 0]);
  bench.move(900, 500);
  assert.deepEqual(bench.last.vector, [0, 1], "the reach ends");
  bench.move(303, 498);
  assert.deepEqual(bench.last.vector, [0, 0]);
});

test("a finger that rests drives while the browser holds its capture", () => {
  const bench = new Bench();
  bench.touch(0, 0);
  bench.move(0, -60);
  bench.pass(10_000);
  assert.equal(bench.owner, "Touch");
  bench.captured = null;
  bench.pass(100);
  assert.equal(bench.owner, null);
  bench.captured = 7;
  bench.move(0, -60);
  bench.pass(1000);
  assert.equal(bench.owner, null, "it must be put down anew");
});

test("a mouse that moves without a button was let go", () => {
  const bench = new Bench();
  bench.touch(0, 0, { isMouse: true });
  assert.equal(bench.owner, "Mouse");
  bench.move(0, -60, 0);
  assert.equal(bench.owner, null);
});

test("a second finger does not drive, and ends what the first does", () => {
  const bench = new Bench();
  bench.touch(0, 0, { isPrimary: false });
  assert.equal(bench.owner, null);
  assert.match(bench.input.takeNotice(), /other finger/);
  bench.touch(0, 0);
  assert.equal(bench.owner, "Touch");
  bench.input.handlePointerDown({ id: 8, isMouse: false, isPrimary: false, buttons: 1, x: 9, y: 9 }, bench.now, bench.now);
  assert.equal(bench.owner, null);
});

// Gamepad

test("a gamepad does not drive by what it has sent before the page learned of it", () => {
  const bench = new Bench();
  bench.pad({ isHeld: false });
  bench.now += 3000;
  bench.pad({ isHeld: false, timestamp: 0 });
  bench.now += 20;
  bench.pad({ timestamp: bench.now - 1500 });
  assert.equal(bench.owner, null);
  assert.match(bench.input.takeNotice(), /stood still for 1.5 s: press again/);
});

test("a gamepad drives while a shoulder button is held and its time stamp changes", () => {
  const bench = new Bench();
  bench.pad({ isHeld: false });
  bench.pass(5000, 20, () => bench.pad({ forward: 1 }));
  assert.deepEqual(bench.last, { source: "Gamepad", vector: [1, 0] });
  const timestamp = bench.now;
  bench.pass(350, 20, () => bench.pad({ forward: 1, timestamp }));
  assert.equal(bench.owner, "Gamepad");
  bench.pass(150, 20, () => bench.pad({ forward: 1, timestamp }));
  assert.equal(bench.owner, null);
  assert.match(bench.input.takeNotice(), /sends nothing new/);
  bench.pass(1000, 20, () => bench.pad({ forward: 1 }));
  assert.equal(bench.owner, null, "its button must be pressed anew");
  bench.pad({ isHeld: false });
  bench.pad();
  assert.equal(bench.owner, "Gamepad");
});

test("a shoulder button that was pressed before a drive ended, and is read after it, drives nothing", () => {
  const bench = new Bench();
  bench.pad({ isHeld: false });
  bench.input.end("the page changed its size", bench.now);
  bench.pad();
  assert.equal(bench.owner, null);
  bench.pad({ isHeld: false });
  bench.pad();
  assert.equal(bench.owner, "Gamepad");
});

test("a gamepad that is not read any more stops", () => {
  const bench = new Bench();
  bench.pad({ isHeld: false });
  bench.pad();
  bench.pass(290);
  assert.equal(bench.owner, "Gamepad");
  bench.pass(10);
  assert.equal(bench.owner, null);
});

test("a shoulder button that was pressed while the page stood still drives nothing", () => {
  const bench = new Bench();
  bench.pad({ isHeld: false });
  bench.pass(300);
  bench.pad();
  assert.equal(bench.owner, null);
  bench.pad({ isHeld: false });
  bench.pass(280);
  bench.pad();
  assert.equal(bench.owner, "Gamepad");
});

test("a gamepad that is gone stops, and comes back at rest", () => {
  const bench = new Bench();
  bench.pad({ isHeld: false });
  bench.pad();
  bench.input.handlePads([], bench.now);
  assert.equal(bench.owner, null);
  bench.pad();
  assert.equal(bench.owner, null, "held when it was connected");
  bench.pad({ isHeld: false });
  bench.input.handlePads([], bench.now);
  bench.pad();
  assert.equal(bench.owner, null, "held when it was connected again");
});

test("a gamepad that is marked as disconnected stops", () => {
  const bench = new Bench();
  bench.pad({ isHeld: false });
  bench.pad();
  bench.pad({ connected: false });
  assert.equal(bench.owner, null);
});

// One owner

const TAKE_UP = {
  Keys: (bench) => bench.press("KeyW"),
  Mouse: (bench) => bench.touch(0, 0, { isMouse: true, id: 1 }),
  Touch: (bench) => bench.touch(0, 0),
  Gamepad: (bench) => {
    bench.pad({ isHeld: false });
    bench.pad();
    bench.poll();
  },
};

/** What a source says while it is held: repeats, moves, readings. */
const HOLD = {
  Keys: (bench) => bench.repeat("KeyW"),
  Mouse: (bench) => bench.input.handlePointerMove({ id: 1, buttons: 1, x: 0, y: -60 }),
  Touch: (bench) => bench.input.handlePointerMove({ id: 7, buttons: 1, x: 0, y: -60 }),
  Gamepad: (bench) => bench.pad({ forward: 1 }),
};

for (const [one, takeUp] of Object.entries(TAKE_UP)) {
  for (const [other, takeUpOther] of Object.entries(TAKE_UP)) {
    if (one === other) continue;
    test(`${other} ends what ${one} drives, and drives only when taken up anew`, () => {
      const bench = new Bench();
      takeUp(bench);
      assert.equal(bench.owner, one);
      takeUpOther(bench);
      assert.equal(bench.owner, null);
      assert.match(bench.input.takeNotice(), /take up one|two pointers/);
      bench.pass(2000, 20, () => {
        HOLD[one](bench);
        HOLD[other](bench);
      });
      assert.equal(bench.owner, null);
    });
  }

  test(`${one} does not drive against an obstacle, and not when the obstacle is gone`, () => {
    const bench = new Bench();
    bench.input.hinder("A mission drives", bench.now);
    takeUp(bench);
    assert.equal(bench.owner, null);
    assert.equal(bench.input.takeNotice(), "A mission drives");
    bench.input.hinder("", bench.now);
    bench.pass(2000, 20, () => HOLD[one](bench));
    assert.equal(bench.owner, null);
  });

  test(`an obstacle ends what ${one} drives`, () => {
    const bench = new Bench();
    takeUp(bench);
    bench.input.hinder("Not connected", bench.now);
    assert.equal(bench.owner, null);
    assert.equal(bench.input.ending, "Not connected");
  });

  test(`after a pause of the page ${one} sends nothing, and does not drive on`, () => {
    const bench = new Bench();
    takeUp(bench);
    bench.pass(500, 20, () => HOLD[one](bench));
    assert.equal(bench.owner, one);
    bench.now += 400;
    // The timer may come before the events that wait.
    assert.equal(bench.poll(), null);
    bench.pass(2000, 20, () => HOLD[one](bench));
    assert.equal(bench.owner, null);
    assert.match(bench.input.ending, /stood still|not read/);
  });
}

for (const [one, takeUp] of Object.entries(TAKE_UP)) {
  if (one === "Gamepad") continue;
  test(`${one} does not drive if the page learns of it too late`, () => {
    const bench = new Bench();
    const input = bench.input;
    for (const name of ["handleKeyDown", "handlePointerDown"]) {
      const handle = input[name].bind(input);
      input[name] = (what, time, now) => handle(what, time - 400, now);
    }
    takeUp(bench);
    assert.equal(bench.owner, null);
    assert.match(input.takeNotice(), /stood still/);
  });
}
