// A stop is repeated until the station has it, whatever happens meanwhile.

import assert from "node:assert/strict";
import test, { mock } from "node:test";

import { forgetElements, get } from "./fake_elements.mjs";

class Socket extends EventTarget {
  static all = [];
  readyState = 1;
  bufferedAmount = 0;
  sent = [];
  constructor() {
    super();
    Socket.all.push(this);
  }
  send(frame) {
    this.sent.push(frame);
  }
  close() {
    this.readyState = 3;
  }
}

Object.assign(globalThis, {
  HTMLInputElement: class {},
});
// Newer versions of Node.js have one of their own.
Object.defineProperty(globalThis, "navigator", { value: {}, configurable: true });

const { Emergency } = await import("../../src/page/emergency.js");
const { Fleet } = await import("../../src/page/fleet.js");

const clears = { clears: true, clearsAny: false };

function page({ vehicle = 101, barred = "" } = {}) {
  mock.timers.enable({ apis: ["setTimeout"] });
  forgetElements();
  Socket.all = [];
  let answer;
  const [unbarred, asked] = [[], []];
  const link = Object.assign(new EventTarget(), {
    open: true,
    vehicle,
    socketTo: () => new Socket(),
    send() {},
    ask: (request) => {
      asked.push(request);
      return new Promise((resolve) => (answer = resolve));
    },
  });
  const emergency = new Emergency(link, () => unbarred.push(1));
  const fleet = new Fleet(() => {});
  link.dispatchEvent(new CustomEvent("hello", { detail: {} }));
  const state = (changes, stops) => ({ vehicle: { subsystem: 101, emergency: false, stop_set: false, ...changes }, stops });
  const lastPress = () => Socket.all.flatMap(({ sent }) => sent).at(-1).split(" ").at(-1);
  const say = (data) => Socket.all[0].dispatchEvent(Object.assign(new Event("message"), { data }));
  const update = (shown) => emergency.update(shown, true, fleet, barred, clears);
  update(null);
  return {
    link,
    emergency,
    unbarred,
    asked,
    update: () => update(null),
    /** The station says that it has taken what was pressed last, and how many stops that were. */
    take: (stops) => say(`ok 101 ${lastPress()} ${stops}`),
    /** The station says that what was pressed last was cleared since. */
    clear: () => say(`cleared all ${lastPress()}`),
    /** A state arrives. */
    hear: (changes, stops = 0) => {
      const detail = state(changes, stops);
      emergency.handleState(detail);
      update(detail);
    },
    /** A list of vehicles arrives. */
    hearFleet: (vehicles, stops, all_stopped = false) => {
      fleet.handle({ vehicles, all_stopped, stops });
      emergency.handleFleet(fleet);
      update(null);
    },
    answer: async (reason) => {
      answer(reason);
      await new Promise((resolve) => setImmediate(resolve));
    },
    /** What is sent in the next 2 s. */
    repeated: () => {
      Socket.all.forEach(({ sent }) => sent.splice(0));
      for (let round = 0; round < 4; round++) mock.timers.tick(500);
      return [...new Set(Socket.all.flatMap(({ sent }) => sent.map((frame) => frame.replace(/ \d+\.\d+$/, ""))))].sort();
    },
  };
}

test.afterEach(() => mock.timers.reset());

test("a page that is barred sends its stop all the same, and asks for the token", () => {
  const { emergency, unbarred, repeated } = page({ barred: "enter the token to use it" });
  emergency.stop();
  assert.deepEqual(repeated(), ["stop 101"]);
  assert.equal(unbarred.length, 1);
});

test("an emergency that others have set does not confirm the operator's own stop", () => {
  const { emergency, hear, take, repeated } = page();
  hear({ emergency: true });
  emergency.stop();
  take(1);
  hear({ emergency: true }, 1);
  assert.deepEqual(repeated(), ["stop 101"]);
  hear({ emergency: false, stop_set: true }, 1);
  assert.deepEqual(repeated(), ["stop 101"], "the vehicle has not confirmed it");
  hear({ emergency: true, stop_set: true }, 1);
  assert.deepEqual(repeated(), []);
});

test("an old picture confirms nothing", () => {
  const { emergency, hear, update, repeated } = page();
  hear({ emergency: true, stop_set: true });
  emergency.stop();
  update();
  assert.deepEqual(repeated(), ["stop 101"]);
});

test("what was said before the station had a stop does not confirm it, however late it arrives", () => {
  const { emergency, hear, hearFleet, take, repeated } = page();
  // Other pages have stopped and cleared this vehicle meanwhile, of which this page has not heard yet.
  emergency.stop();
  take(5);
  const stopped = [{ subsystem: 101, state: "emergency", emergency: true, presence: "present", stop_set: true }];
  for (const stops of [3, 4]) {
    hear({ emergency: true, stop_set: true }, stops);
    hearFleet(stopped, stops, true);
    assert.deepEqual(repeated(), ["stop 101"]);
  }
  hearFleet(stopped, 5);
  assert.deepEqual(repeated(), []);
});

test("a stop is confirmed only once the station has said which of all it was, and after a new connection again", () => {
  const { link, emergency, hear, take, repeated } = page();
  emergency.stop();
  hear({ emergency: true, stop_set: true }, 9);
  assert.deepEqual(repeated(), ["stop 101"]);
  take(2);
  link.dispatchEvent(new CustomEvent("hello", { detail: {} }));
  hear({ emergency: true, stop_set: true }, 9);
  assert.deepEqual(repeated(), ["stop 101"], "perhaps another station, which counts from the start");
  take(1);
  hear({ emergency: true, stop_set: true }, 1);
  assert.deepEqual(repeated(), []);
});

test("a stop that somebody has cleared, who knew of it, is not repeated any more", () => {
  const { emergency, take, clear, repeated } = page();
  emergency.stop();
  take(1);
  emergency.stopAll();
  assert.deepEqual(repeated(), ["stop 101", "stop-all"]);
  clear();
  assert.deepEqual(repeated(), ["stop 101"]);
});

test("a stop after one's own clearing outlives it", async () => {
  const { emergency, hear, take, answer, repeated } = page();
  hear({ emergency: true, stop_set: true }, 1);
  get("clear-yes").click();
  emergency.stop();
  hear({ emergency: true, stop_set: true }, 1);
  assert.deepEqual(repeated(), ["stop 101"], "the clearing is still under way");
  await answer(null);
  take(2);
  hear({ emergency: false }, 2);
  assert.deepEqual(repeated(), ["stop 101"]);
});

test("clearing ends the repetitions of an earlier stop", () => {
  const { emergency, repeated } = page();
  emergency.stop();
  get("clear-yes").click();
  assert.deepEqual(repeated(), []);
});

test("each vehicle is stopped for itself, whichever the page shows", () => {
  const { link, emergency, hear, hearFleet, take, repeated } = page();
  emergency.stop();
  take(1);
  link.vehicle = 102;
  hear({ subsystem: 102, emergency: true, stop_set: true }, 1);
  assert.deepEqual(repeated(), ["stop 101"]);
  emergency.stop();
  take(2);
  assert.deepEqual(repeated(), ["stop 101", "stop 102"]);
  hearFleet([{ subsystem: 101, state: "emergency", emergency: true, presence: "present", stop_set: true }], 2);
  assert.deepEqual(repeated(), ["stop 102"]);
});

test("a stop that was pressed before the page knew a vehicle is sent when it does", () => {
  const { link, emergency, update, repeated } = page({ vehicle: null });
  emergency.stop();
  assert.deepEqual(repeated(), []);
  link.vehicle = 101;
  update();
  assert.deepEqual(repeated(), ["stop 101"]);
});

test("a stop of all is confirmed by the latch and the station's stop of each, and not by vehicles that are already stopped", () => {
  const { emergency, hearFleet, take, repeated } = page();
  const known = (isSet) => [
    { subsystem: 101, state: "emergency", emergency: true, presence: "present" },
    { subsystem: 102, state: "ready", presence: "silent", stop_set: isSet },
    { subsystem: 103, state: null, presence: "gone" },
  ];
  emergency.stopAll();
  take(1);
  hearFleet(known(true), 1);
  hearFleet([], 1);
  assert.deepEqual(repeated(), ["stop-all"]);
  // Somebody has cleared the silent one since all were stopped the last time.
  hearFleet(known(false), 1, true);
  assert.deepEqual(repeated(), ["stop-all"]);
  hearFleet(known(true), 1, true);
  assert.deepEqual(repeated(), []);
});

test("a stop of all is not confirmed by a station that does not know the vehicles yet that were there", () => {
  const one = (changes) => ({ subsystem: 101, state: "ready", emergency: false, presence: "present", ...changes });
  const { emergency, hearFleet, take, repeated } = page();
  hearFleet([one(), one({ subsystem: 102 }), one({ subsystem: 103, presence: "gone" })], 0);
  emergency.stopAll();
  take(1);
  // The station has restarted, and stops whatever comes.
  hearFleet([], 1, true);
  assert.deepEqual(repeated(), ["stop-all"]);
  const stopped = one({ state: "emergency", emergency: true, stop_set: true });
  hearFleet([stopped], 1, true);
  assert.deepEqual(repeated(), ["stop-all"]);
  // Its settings name the other one, or it was heard and is silent now.
  for (const presence of ["unknown", "silent"]) {
    hearFleet([stopped, one({ subsystem: 102, state: null, presence, stop_set: true })], 1, true);
    assert.deepEqual(repeated(), ["stop-all"], presence);
  }
  hearFleet([stopped, one({ subsystem: 102, state: null, presence: "gone" })], 1, true);
  assert.deepEqual(repeated(), []);
});

test("a stop that comes while the operator is about to clear one has to be looked at first", () => {
  const { hear } = page();
  hear({ emergency: true, stop_set: true }, 7);
  get("estop-clear").click();
  assert.ok(!get("clear-sheet").hidden);
  hear({ emergency: true, stop_set: true }, 7);
  assert.ok(!get("clear-sheet").hidden);
  hear({ emergency: true, stop_set: true }, 8);
  assert.ok(get("clear-sheet").hidden);
});

test("what the station has stopped can be cleared before the vehicle reports it, or if it never does", () => {
  const { hear } = page();
  hear({ emergency: false, stop_set: true });
  assert.ok(!get("estop-clear").hidden);
  get("estop-clear").click();
  hear({ emergency: false, stop_set: true });
  assert.ok(!get("clear-sheet").hidden);
  hear({ emergency: false, stop_set: false });
  assert.ok(get("estop-clear").hidden && get("clear-sheet").hidden);
});

test("a stop that is not confirmed goes on if its clearing is refused", async () => {
  const { emergency, hear, answer, repeated } = page();
  hear({});
  emergency.stop();
  hear({ emergency: true });
  get("clear-yes").click();
  assert.deepEqual(repeated(), []);
  await answer("stopped again since then");
  assert.deepEqual(repeated(), ["stop 101"]);
});

test("who clears a stop says which stops the shown state knows of, and none of another connection", async () => {
  const { asked, emergency, hear, link, answer } = page();
  hear({ emergency: true, stop_set: true }, 7);
  get("clear-yes").click();
  assert.deepEqual([asked[0].type, asked[0].stops], ["emergency", 7]);
  await answer(null);
  link.dispatchEvent(new CustomEvent("hello", { detail: {} }));
  // The old state is still shown.
  emergency.update({ vehicle: { emergency: true }, stops: 7 }, true, { vehicles: [], allStopped: false }, "", clears);
  get("clear-yes").click();
  assert.equal(asked[1].stops, 0);
});

test("a key whose first press the page did not see stops by its repeats", () => {
  const { emergency, hear, take, repeated } = page();
  const key = { key: "Escape", target: {}, repeat: true, preventDefault() {} };
  assert.ok(emergency.key(key));
  assert.deepEqual(repeated(), ["stop 101"]);
  take(1);
  hear({ emergency: true, stop_set: true }, 1);
  emergency.key(key);
  assert.deepEqual(repeated(), [], "it is done");
});
