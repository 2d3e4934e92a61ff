// What the page says about stopping, in words. "Stopped" depends on the measured speed alone: a
// reported emergency says what the parts intend, not what the motor does.

import { figure, number } from "./dom.js";

/** Speed in words, for example `1.7 m/s`. */
const speedWords = (speed) => `${figure(Math.abs(speed), 1)} m/s`;

/**
 * How far the stop of a vehicle is: `stopped`, `stopping`, `unknown` without a fresh speed, or
 * `runaway`; null if no emergency is reported. `live` says whether the state itself is fresh.
 */
export function stopCondition(vehicle, live) {
  // Whatever its other parts report, or do not.
  if (live && vehicle?.runaway === true) return "runaway";
  if (vehicle?.emergency !== true) return null;
  if (!live) return "unknown";
  if (vehicle.at_rest === true) return "stopped";
  return vehicle.at_rest === false ? "stopping" : "unknown";
}

/** The word and the detail on the emergency button while an emergency is reported. */
export function stopWords(condition, speed) {
  const known = number(speed) !== null && Math.abs(speed) >= 0.05;
  return {
    stopped: ["Emergency", "the vehicle is stopped"],
    stopping: ["Stopping", known ? speedWords(speed) : "still moving"],
    unknown: ["Emergency", "stop reported, speed unknown"],
    runaway: ["RUNAWAY", known ? `moves in emergency: ${speedWords(speed)}` : "moves in emergency"],
  }[condition];
}

/** Who has to clear an emergency that this station has not set. `may` says whether this page may, too. */
export function othersWords(may) {
  const who = "Another client or a stop input has stopped this vehicle, and is to clear that. ";
  return may ? `${who}Clear it here only if you know why. ` : `${who}An administrator can clear it here. `;
}

/** The vehicles by how far their stop is. */
function sorted(vehicles) {
  const isPresent = ({ presence, state }) => presence === "present" && state !== null;
  const present = vehicles.filter(isPresent);
  const inEmergency = present.filter(({ emergency }) => emergency === true);
  // Of these the station hears nothing: it has to know of their stop, and that is all.
  const mute = vehicles.filter((one) => !isPresent(one) && !["gone", "unknown"].includes(one.presence));
  const unset = mute.filter(({ stop_set: isSet }) => isSet !== true);
  return {
    present: present.length,
    pending: present.length - inEmergency.length + unset.length,
    runaways: present.filter(({ runaway }) => runaway === true).length,
    moving: inEmergency.filter(({ at_rest: rest }) => rest === false).length,
    unknown: inEmergency.filter(({ at_rest: rest }) => rest !== true && rest !== false).length,
    mute: vehicles.length - present.length,
  };
}

/** How many vehicles have not reported their emergency, or report nothing and are not even stopped by the station. */
export const pendingStops = (vehicles) => sorted(vehicles).pending;

/** Whether these vehicles, by their subsystems, have reported their emergency or have left. */
export function haveStopped(subsystems, vehicles) {
  const has = ({ presence, emergency }) => emergency === true || presence === "gone";
  const stopped = vehicles.filter(has).map(({ subsystem }) => subsystem);
  return subsystems.every((subsystem) => stopped.includes(subsystem));
}

/** What *Stop all* has reached, in words. `wanted` says whether it is still being sent. */
export function stopAllWords(vehicles, wanted) {
  const { present, pending, runaways, moving, unknown, mute } = sorted(vehicles);
  if (runaways > 0) return `${runaways} RUNAWAY`;
  if (wanted && pending > 0) return `${pending} not stopped yet`;
  if (present === 0 || pending > 0) return `${vehicles.length} vehicles`;
  if (moving > 0) return `${moving} still moving`;
  if (unknown > 0) return `stop reported, ${unknown} unknown speed`;
  if (mute > 0) return `${present} stopped, ${mute} not heard`;
  return "all are stopped";
}
