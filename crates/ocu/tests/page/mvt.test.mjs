// A tile of a map file costs no more than it can draw.

import assert from "node:assert/strict";
import test from "node:test";

globalThis.Path2D = class { moveTo() {} lineTo() {} closePath() {} };
const { decode } = await import("../../src/page/mvt.js");

const field = (number, octets) => [number * 8 + 2, ...varint(octets.length), ...octets];
function varint(value) {
  const octets = [];
  for (; value >= 128; value = Math.floor(value / 128)) octets.push((value % 128) + 128);
  return [...octets, value];
}
const layer = (features) => field(3, [...field(1, [...Buffer.from("water")]), ...features]);
const geometry = (commands) => field(2, [3 * 8, 3, ...field(4, commands.flatMap(varint))]);

test("layers, features and the ends of areas are bounded as points are", () => {
  const tile = (...layers) => new Uint8Array(layers.flat());
  const square = geometry([9, 0, 0, 26, 4, 0, 0, 4, 3, 0, 15]);
  assert.equal(decode(tile(layer(square))).length, 1);
  const many = (count, octets) => Array.from({ length: count }, () => octets).flat();
  assert.throws(() => decode(tile(many(65, [3 * 8 + 2, 0]))), /more than 64 layers/);
  assert.throws(() => decode(tile(layer(many(100_001, [2 * 8 + 2, 0])))), /more than 100000 features/);
  assert.throws(() => decode(tile(layer(geometry(many(1_000_001, [15]))))), /more than 1000000 points/);
});
