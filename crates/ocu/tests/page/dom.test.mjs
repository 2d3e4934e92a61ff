// Text of peers in the document.

import assert from "node:assert/strict";
import test from "node:test";

import { FakeElement } from "./fake_elements.mjs";

const { make, mark, plain, say } = await import("../../src/page/dom.js");

const HOSTILE = "Müller\u001b[2J\u009b\r\u202egpj\u2066\u200b\u00ad\u2028\u2029\ufeff\u{e0041}\ufe0f\u3164\u2800";
const HIDDEN = /[\u0000-\u0009\u000b-\u001f\u007f-\u009f\u00ad\u200b-\u200f\u2028-\u202e\u2060-\u206f\u3164\u2800\ufe00-\ufe0f\ufeff]|[\u{e0000}-\u{e0fff}]/u;

test("no way into the document lets a hidden letter of a name through", () => {
  const made = [];
  const element = new FakeElement();
  element.append = (...children) => made.push(...children);
  const create = document.createElement;
  document.createElement = () => element;
  make("p", { title: HOSTILE }, HOSTILE);
  document.createElement = create;
  const title = element.getAttribute("title");
  mark(element, "aria-label", HOSTILE);
  say(element, HOSTILE);
  for (const shown of [made[0], title, element.getAttribute("aria-label"), element.textContent, plain(HOSTILE)]) {
    assert.ok(shown.startsWith("Müller") && shown.includes("gpj"), shown);
    assert.ok(!HIDDEN.test(shown), JSON.stringify(shown));
  }
});

test("printable text of all scripts and the lines of a message stay", () => {
  const element = new FakeElement();
  for (const text of ["Müller · 5 µs", "火星　探査車", "ровер ρόβερ מרכבה", '{\n  "X": 1\n}']) {
    say(element, text);
    assert.equal(element.textContent, text);
  }
  assert.equal(plain("two\nlines"), "two lines");
});
