// What the page shows instead of its token, and what it awaits from the station.

import assert from "node:assert/strict";
import test from "node:test";

const TOKEN = "correct-horse-battery";
const RUN = "00112233445566778899aabbccddeeff";
const NONCE = "0123456789abcdef0123456789abcdef";

const session = new Map();
Object.assign(globalThis, {
  sessionStorage: {
    getItem: (key) => session.get(key) ?? null,
    setItem: (key, value) => session.set(key, value),
    removeItem: (key) => session.delete(key),
  },
  history: { replaceState: () => (location.hash = "") },
  location: { host: "127.0.0.1:8080", pathname: "/", hash: "" },
});
const { Pass } = await import("../../src/page/pass.js");

/** The browser's storage of keys, which outlives pages. */
function storage() {
  let kept = null;
  return { get: async () => kept, put: async (key) => (kept = key) };
}

function open(hash = "", keys = storage(), subtle = crypto.subtle) {
  location.hash = hash;
  return new Pass(subtle, keys);
}

test("ticket and answer are those of the station", async (context) => {
  // `server/proof.rs` has the same values.
  const numbers = Buffer.from(NONCE, "hex");
  context.mock.method(crypto, "getRandomValues", (octets) => (octets.set(numbers), octets));
  const pass = open(`#token=${TOKEN}`);
  await pass.meet(RUN);
  assert.equal(pass.shown, "0ca9e004ae75439ca379669a66839a51e2aff20a8f2acc4261b4737d9da051cf");
  assert.equal(pass.nonce, NONCE);
  assert.equal(pass.answer, "f441351e7482cfe1048da253a6cbcf73dc577993a544df177cdf4dd39f53d8c2");
});

test("a page never shows its token, and shows nothing before the station has named its run", async () => {
  const pass = open(`#token=${TOKEN}`);
  assert.equal(pass.shown, "");
  for (const run of [undefined, "", RUN, "f".repeat(32)]) {
    await pass.meet(run);
    assert.ok(!pass.shown.includes(TOKEN));
    assert.equal(pass.shown === "", !run);
  }
  assert.equal(location.hash, "");
  assert.deepEqual([...session], []);
});

test("the ticket of a run stays, and each connection has a nonce of its own", async () => {
  const pass = open(`#token=${TOKEN}`);
  await pass.meet(RUN);
  const { shown, nonce, answer } = pass;
  await pass.meet(RUN);
  assert.equal(pass.shown, shown);
  assert.notEqual(pass.nonce, nonce);
  assert.notEqual(pass.answer, answer);
});

test("the browser keeps a key that tells nobody the token, until it is forgotten", async () => {
  const keys = storage();
  const pass = open(`#token=${TOKEN}`, keys);
  await pass.meet(RUN);
  const key = await keys.get();
  assert.equal(key.extractable, false);
  await assert.rejects(crypto.subtle.exportKey("raw", key));
  const again = open("", keys);
  await again.meet(RUN);
  assert.equal(again.shown, pass.shown);
  await again.forget();
  assert.ok(!again.holds && again.shown === "");
  const later = open("", keys);
  await later.meet(RUN);
  assert.ok(!later.holds);
});

test("at another address the same token is another ticket", async () => {
  const pass = open(`#token=${TOKEN}`);
  await pass.meet(RUN);
  location.host = "127.0.0.1:8081";
  const elsewhere = open(`#token=${TOKEN}`);
  await elsewhere.meet(RUN);
  location.host = "127.0.0.1:8080";
  assert.notEqual(elsewhere.shown, pass.shown);
});

test("a browser without cryptography shows the token, and asks for no proof", async () => {
  const pass = open(`#token=${TOKEN}`, storage(), null);
  await pass.meet(RUN);
  assert.deepEqual([pass.shown, pass.nonce, pass.answer], [TOKEN, "", ""]);
  const again = open("", storage(), null);
  await again.meet(RUN);
  assert.equal(again.shown, TOKEN);
  assert.equal(await again.use("too short"), false);
  await again.forget();
  assert.equal(again.shown, "");
});
