// What the TypeScript compiler must accept, and what it must refuse.
import * as codec from "./jaus/codec.js";
import * as core from "./jaus/core.js";
import { ReportGlobalPose, v0_6 } from "./jaus/mobility.js";

const pose: ReportGlobalPose = new ReportGlobalPose({ latitudeDeg: 53.1 });
const octets: Uint8Array = pose.encode();
const again: ReportGlobalPose = ReportGlobalPose.decode(octets);
const latitude: number | undefined = again.latitudeDeg;
const scaled: ReportGlobalPose.Latitude | undefined = again.latitude;
const raw: number | undefined = scaled?.raw;
pose.latitude = ReportGlobalPose.Latitude.of(53.1);
pose.latitude = undefined;

const stamp = new ReportGlobalPose.TimeStamp({ day: 1 });
stamp.hour = 5;
pose.timeStamp = stamp;

const older: v0_6.ReportAccelerationState = new v0_6.ReportAccelerationState();
const message: codec.Message = codec.decode(core.messages, octets);
if (message instanceof core.ReportIdentification) {
  const name: string | Uint8Array = message.identification;
  console.log(name);
}
const query = new core.QueryIdentification();
query.queryType = core.QueryIdentification.QueryType.SystemIdentification;

// @ts-expect-error: no such member
pose.latitud = 1;
// @ts-expect-error: no such member
new ReportGlobalPose({ latitud: 1 });
// @ts-expect-error: a value in degrees has its own member
pose.latitude = 53.1;
// @ts-expect-error: a number
stamp.hour = "5";
// @ts-expect-error: immutable
if (pose.latitude) pose.latitude.raw = 1;

console.log(latitude, raw, older);
