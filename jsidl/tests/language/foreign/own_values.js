// Values that an application sets.
import assert from "node:assert/strict";
import * as codec from "./jaus/codec.js";
import * as core from "./jaus/core.js";
import * as mobility from "./jaus/mobility.js";

const { ReportGlobalPose } = mobility;

// A scaled integer is set and read in its unit, and keeps its integer.
const pose = new ReportGlobalPose({ latitudeDeg: 53.1, longitudeDeg: -1.5 });
pose.altitudeM = 12;
const again = ReportGlobalPose.decode(pose.encode());
assert.ok(Math.abs(again.latitudeDeg - 53.1) < 1e-7);
assert.equal(again.latitude.raw, pose.latitude.raw);
assert.equal(again.yaw, undefined);
assert.equal(again.yawRad, undefined);
assert.deepEqual(again.encode(), pose.encode());
assert.equal(JSON.stringify(again), JSON.stringify(pose));
pose.latitudeDeg = undefined;
assert.equal(pose.latitude, undefined);

// A number out of range is an error and changes nothing.
assert.throws(() => (pose.longitudeDeg = 180.5), {
  name: "OutOfRange",
  message: "Longitude: 180.5 is not in -180 to 180 degree",
});
assert.throws(() => (pose.longitudeDeg = NaN), codec.OutOfRange);
assert.throws(() => (pose.longitudeDeg = "1"), codec.OutOfRange);
assert.equal(pose.longitudeDeg, again.longitudeDeg);
assert.throws(() => ReportGlobalPose.Latitude.fromRaw(2 ** 32), codec.OutOfRange);
assert.throws(() => ReportGlobalPose.Latitude.fromRaw(0.5), codec.OutOfRange);
assert.throws(() => new ReportGlobalPose({ latitud: 1 }), /ReportGlobalPose has no member latitud/);

// A scaled integer of another range does not fit.
pose.longitude = ReportGlobalPose.Latitude.of(3);
assert.throws(() => pose.encode(), /ReportGlobalPose: Longitude: 3, but the definition has/);

// The sub-fields of a bit field have limits.
const stamp = new ReportGlobalPose.TimeStamp({ day: 31, hour: 23, milliseconds: 999 });
assert.deepEqual([stamp.day, stamp.hour, stamp.seconds, stamp.milliseconds], [31, 23, 0, 999]);
assert.throws(() => (stamp.day = 32), { message: "Day: 32 is not in 1 to 31" });
assert.throws(() => (stamp.day = 0), codec.OutOfRange);
assert.equal(stamp.day, 31);
assert.deepEqual(ReportGlobalPose.TimeStamp.fromRaw(stamp.raw).toJSON(), stamp.toJSON());

// Named values are numbers; others are preserved.
const { QueryIdentification } = core;
const vehicle = QueryIdentification.QueryType;
assert.ok(Object.values(vehicle).every(Number.isInteger));
const query = QueryIdentification.decode(Uint8Array.of(0x00, 0x2b, 0x63));
assert.equal(query.queryType, 0x63);
query.queryType = 256;
assert.throws(() => query.encode(), {
  name: "EncodeError",
  message: "QueryIdentification: QueryType: 256 does not fit unsigned byte",
});

// Text is a string if it is UTF-8, and octets otherwise.
const { ReportIdentification } = core;
const report = new ReportIdentification({ identification: "dépôt" });
assert.equal(ReportIdentification.decode(report.encode()).identification, "dépôt");
report.identification = Uint8Array.of(0x64, 0xe9);
const octets = ReportIdentification.decode(report.encode()).identification;
assert.deepEqual(octets, Uint8Array.of(0x64, 0xe9));
report.identification = "\ud800";
assert.throws(() => report.encode(), /Identification: half of a surrogate pair/);
report.identification = "x".repeat(300);
assert.throws(() => report.encode(), /Identification: count 300 is outside 0 to 255/);

// The kind of message is found by its code.
const message = codec.decode(core.messages, Uint8Array.of(0x00, 0x2b, 0x02));
assert.ok(message instanceof QueryIdentification);
assert.equal(codec.codeOf(Uint8Array.of(0x00)), undefined);
assert.throws(() => codec.decode(core.messages, Uint8Array.of(0xff, 0xff)), codec.DecodeError);
assert.throws(() => codec.decode(core.messages, Uint8Array.of(0x00, 0x2b)), {
  message: "QueryIdentification: QueryType: octets needed: 1, left: 0 at octet 2",
  path: "QueryType",
  offset: 2,
  kind: "short",
});

// A view into a larger buffer is read from its own beginning.
const larger = Uint8Array.of(9, 9, 0x00, 0x2b, 0x02, 9);
assert.equal(QueryIdentification.decode(larger.subarray(2, 5)).queryType, 2);
assert.equal(QueryIdentification.decode(new DataView(larger.buffer, 2, 3)).queryType, 2);

// Each version has its layout; the newest one is also the set's.
for (const [version, types] of Object.entries(core).filter(([name]) => /^v\d/.test(name))) {
  assert.ok(Object.keys(types).length > 0, version);
}
assert.equal(core.QueryIdentification, core.v1_0.QueryIdentification);

console.log("done");
