import { codeOf, DecodeError, OutOfRange } from "./jaus/codec.js";
import { ReportGlobalPose } from "./jaus/mobility.js";

const pose = new ReportGlobalPose({ latitudeDeg: 53.1, longitudeDeg: -1.5 });
pose.timeStamp = new ReportGlobalPose.TimeStamp({ day: 31, hour: 12 });
const octets = pose.encode();

if (codeOf(octets) === ReportGlobalPose.code) {
  const received = ReportGlobalPose.decode(octets);
  console.log(received.latitudeDeg.toFixed(6), received.timeStamp.day, received.altitudeM);
}

try {
  pose.latitudeDeg = 91;
} catch (error) {
  console.log(error instanceof OutOfRange, error.message);
}

try {
  ReportGlobalPose.decode(octets.subarray(0, 10));
} catch (error) {
  console.log(error instanceof DecodeError, error.message);
}
