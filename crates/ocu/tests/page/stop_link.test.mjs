import assert from "node:assert/strict";
import test, { mock } from "node:test";

import { StopLink } from "../../src/page/stop_link.js";

class Socket extends EventTarget {
  readyState = 0;
  bufferedAmount = 0;
  sent = [];
  send(frame) {
    this.sent.push(frame);
  }
  close() {
    this.readyState = 3;
  }
  open() {
    this.readyState = 1;
    this.dispatchEvent(new Event("open"));
  }
  fail() {
    this.readyState = 3;
    this.dispatchEvent(new Event("close"));
  }
  say(data) {
    this.dispatchEvent(Object.assign(new Event("message"), { data }));
  }
}

function rig(token = "", answer = "") {
  mock.timers.enable({ apis: ["setTimeout"] });
  const sockets = [];
  const requests = [];
  const link = Object.assign(new EventTarget(), { token, send: (request) => requests.push(request.type) });
  const stops = new StopLink(link, () => {
    sockets.push(Object.assign(new Socket(), { answer }));
    return sockets.at(-1);
  });
  stops.start();
  /** What was sent, without the presses. */
  const sent = () => sockets.map(({ sent }) => sent.splice(0).map((frame) => frame.replace(PRESS, "")));
  return { link, stops, sockets, requests, sent };
}

const PRESS = / \d+\.\d+$/;

test.afterEach(() => mock.timers.reset());

test("a stop goes out on every connection at once, and is repeated until it is cancelled", () => {
  const { stops, sockets, requests, sent } = rig();
  sockets.forEach((socket) => socket.open());
  stops.stop(101);
  assert.deepEqual(sent(), [["stop 101"], ["stop 101"]]);
  assert.deepEqual(requests, []);
  mock.timers.tick(50);
  mock.timers.tick(100);
  assert.deepEqual(sent(), [Array(2).fill("stop 101"), Array(2).fill("stop 101")]);
  assert.deepEqual(requests, ["emergency", "emergency"]);
  stops.cancel(101);
  mock.timers.tick(3_000);
  assert.deepEqual(sent(), [[], []]);
});

test("copies of a stop carry its press, and the next stop has another one", () => {
  const { stops, sockets } = rig();
  sockets.forEach((socket) => socket.open());
  const presses = () => {
    mock.timers.tick(1_000);
    const frames = sockets.flatMap(({ sent }) => sent.splice(0));
    return [...new Set(frames.map((frame) => frame.match(/\d+\.\d+$/)[0]))];
  };
  stops.stop(101);
  const first = presses();
  assert.deepEqual(first, [stops.press.join(".")]);
  stops.cancel(101);
  stops.stop(101);
  const second = presses();
  assert.deepEqual(second, [stops.press.join(".")]);
  assert.notDeepEqual(first, second);
  assert.ok(`stop 65535 ${2 ** 32 - 1}.${2 ** 32 - 1}`.length <= 32, "the station takes no longer frame");
});

test("a stop is confirmed by what the station said no sooner than it had taken this press, on whichever connection", () => {
  const { link, stops, sockets } = rig();
  sockets[0].open();
  stops.stop(101);
  const [page, number] = stops.press;
  stops.confirm(101, 1_000);
  assert.ok(stops.wants(101), "not taken yet");
  for (const answer of ["ok 101", `ok 101 ${page}.${number}`, `ok 101 ${page}.${number} many`, `ok 101 1.${number} 0`]) {
    sockets[0].say(answer);
    stops.confirm(101, 1_000);
    assert.ok(stops.wants(101), answer);
  }
  sockets[0].say(`ok 101 ${page}.${number} 8`);
  for (const stops_said of [7, null, undefined, NaN, "9"]) stops.confirm(101, stops_said);
  assert.ok(stops.wants(101));
  stops.confirm(101, 8);
  assert.ok(!stops.wants(101));
  stops.stop(101);
  sockets[0].say(`ok 101 ${page}.${number} 8`);
  stops.confirm(101, 8);
  assert.ok(stops.wants(101), "a late answer to the press before");
  const heard = (press, stops) => link.dispatchEvent(new CustomEvent("stopped", { detail: { press, stops } }));
  for (const wrong of [undefined, null, 7, "7.1", []]) heard(wrong, 9);
  stops.confirm(101, 9);
  assert.ok(stops.wants(101));
  heard(stops.press, 9);
  stops.confirm(101, 9);
  assert.ok(!stops.wants(101));
});

test("without a connection of its own, a stop takes the other one and the next that opens", () => {
  const { stops, sockets, requests, sent } = rig();
  assert.equal(stops.open, false);
  stops.stopAll();
  assert.deepEqual(requests, ["emergency_all"]);
  sockets[1].open();
  assert.deepEqual(sent(), [[], ["stop-all"]]);
});

test("no copy is added to what has not left the browser, but each new press is", () => {
  const { stops, sockets, sent } = rig();
  sockets[0].open();
  sockets[0].bufferedAmount = 8;
  for (const press of ["first", "second"]) {
    stops.stop(101);
    mock.timers.tick(200);
    assert.deepEqual(sent()[0], ["stop 101"], press);
  }
});

test("a connection that is lost or silent is opened again", () => {
  const { sockets } = rig();
  sockets.forEach((socket) => socket.open());
  sockets[0].fail();
  mock.timers.tick(250);
  assert.equal(sockets.length, 3);
  sockets[2].open();
  mock.timers.tick(24_500);
  sockets[2].say("");
  mock.timers.tick(1_000);
  assert.equal(sockets[1].readyState, 3, "this one was silent for 25 s");
  assert.equal(sockets[2].readyState, 1);
});

test("the token comes first, and a refusal is told", () => {
  const { stops, sockets, sent } = rig("secret");
  let reason;
  stops.addEventListener("refused", ({ detail }) => (reason = detail));
  sockets[0].open();
  stops.stop(7);
  assert.deepEqual(sent()[0], ["token secret", "stop 7"]);
  sockets[0].say("no vehicle 7 is unknown");
  assert.equal(reason, "vehicle 7 is unknown");
});

test("a press sends its own stop at once, and the others only when it is their turn", () => {
  const { stops, sockets, sent } = rig();
  sockets[0].open();
  for (let vehicle = 101; vehicle < 116; vehicle++) {
    stops.stop(vehicle);
    assert.deepEqual(sent()[0], [`stop ${vehicle}`]);
  }
  mock.timers.tick(50);
  assert.equal(sent()[0].length, 15);
});

test("each stop is repeated until it is confirmed itself", () => {
  const { stops, sockets, requests, sent } = rig();
  sockets[0].open();
  stops.stop(101);
  stops.stop(102);
  stops.stopAll();
  sent();
  requests.splice(0);
  stops.cancel(102);
  mock.timers.tick(50);
  assert.deepEqual(sent()[0], ["stop 101", "stop-all"]);
  assert.deepEqual(requests, ["emergency", "emergency_all"]);
  stops.cancel("all");
  mock.timers.tick(100);
  assert.deepEqual(sent()[0], ["stop 101"]);
  stops.cancel(101);
  mock.timers.tick(3_000);
  assert.deepEqual(sent()[0], []);
});

test("a connection that does not open keeps the others waiting for 8 s at most, and a stop for a quarter of a second", () => {
  const { stops, sockets } = rig();
  mock.timers.tick(8_000);
  assert.deepEqual(sockets.map(({ readyState }) => readyState), [3, 3]);
  mock.timers.tick(250);
  stops.stop(101);
  mock.timers.tick(8_000);
  mock.timers.tick(250);
  assert.equal(sockets.length, 6);
});

test("a connection that is open and silent is opened again with the other one", () => {
  let now = 0;
  const clock = mock.method(performance, "now", () => now);
  const { stops, sockets } = rig();
  sockets.forEach((socket) => socket.open());
  now = 5_000;
  sockets[0].say("");
  now = 12_000;
  stops.start();
  assert.equal(sockets.length, 3, "the one that was heard stays");
  assert.equal(sockets[1].readyState, 3);
  clock.mock.restore();
});

test("a frame takes 32 octets at most", () => {
  const { stops, sockets, sent } = rig();
  sockets[0].open();
  stops.stop(65_535);
  stops.stopAll();
  for (const frame of sent()[0]) assert.ok(frame.length <= 32, frame);
});

test("who does not prove to be the station confirms and ends no stop", () => {
  const { stops, sockets, sent } = rig("ticket", "proof");
  sockets.forEach((socket) => socket.open());
  stops.stop(7);
  const press = stops.press.join(".");
  sockets[0].say(`cleared 7 ${press}`);
  sockets[1].say("");
  assert.deepEqual([sockets[0].readyState, sockets[1].readyState], [3, 3]);
  assert.ok(stops.wants(7));
  mock.timers.tick(250);
  sockets[2].open();
  sockets[2].say("proof");
  sent();
  mock.timers.tick(500);
  assert.deepEqual(sent()[2].slice(0, 1), ["stop 7"]);
  sockets[2].say(`cleared 7 ${press}`);
  assert.ok(!stops.wants(7));
});
