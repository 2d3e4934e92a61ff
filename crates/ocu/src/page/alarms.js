// Which alarms there are: what an operator must hear of while looking elsewhere. Pure: it takes what
// the page knows, and returns the alarms that have begun since the last time.

import { number, objects, plain } from "./dom.js";

/** How urgent an alarm is; a runaway sounds until it is over or muted. */
export const URGENT = new Set(["runaway"]);

/** The present alarms as a map from a key to a level: `runaway`, `bad` or `warn`. */
export function alarmsOf(state, { live, driving, vehicles = [] }) {
  const alarms = new Map();
  const vehicle = state?.vehicle;
  for (const { subsystem, runaway } of live ? objects(vehicles, 256) : []) {
    if (runaway === true) alarms.set(`${plain(subsystem, 8)} runaway`, "runaway");
  }
  if (!vehicle) return alarms;
  const add = (key, level) => alarms.set(`${plain(vehicle.subsystem, 8)} ${key}`, level);
  if (!live) {
    if (driving) add("link", "bad");
    return alarms;
  }
  if (vehicle.runaway === true) add("runaway", "runaway");
  if (plain(state.drive?.reason)) add("drive ended", "bad");
  if (vehicle.emergency === true) add("emergency", "bad");
  for (const { id, role, how } of objects(vehicle.missing, 64)) {
    add(`missing ${plain(id, 16)} ${plain(how, 8)}`, role === "planner" ? "bad" : "warn");
  }
  for (const { id, state: mode } of objects(vehicle.parts, 64)) {
    if (mode === "failure") add(`failure ${plain(id, 16)}`, "bad");
  }
  if (state.mission?.lost) add("planner lost", "bad");
  if (state.mission?.stage === "failed") add(`mission ${plain(state.mission.mission, 12)}`, "warn");
  return alarms;
}

/** Follows the alarms of a page. */
export class Alarms {
  #known = new Map();
  #vehicle = null;
  #first = true;
  /** Whether this page drove in the last state that was live. */
  #driving = false;

  /**
   * Takes a state with whether it is live, the list of vehicles and the number of this page; returns the
   * level of the most urgent alarm that has begun, or null. What a page finds when it opens, or at another
   * vehicle, has begun before: it is shown, and does not sound. That the link is stale concerns the page
   * that drives, and not those that watch.
   */
  update(state, live, vehicles, page) {
    if (live) this.#driving = state?.drive?.active === true && number(page) !== null && state.control?.page === page;
    const vehicle = state?.vehicle?.subsystem ?? null;
    const now = alarmsOf(state, { live, driving: this.#driving, vehicles });
    const isNew = this.#first || vehicle !== this.#vehicle;
    if (state) this.#first = false;
    const begun = [...now].filter(([key]) => !this.#known.has(key)).map(([, level]) => level);
    // Without a fresh picture nothing else is known to be over.
    if (!live) for (const [key, level] of this.#known) if (vehicle === this.#vehicle && !now.has(key)) now.set(key, level);
    [this.#known, this.#vehicle] = [now, vehicle];
    if (begun.includes("runaway")) return "runaway";
    if (isNew) return null;
    return ["bad", "warn"].find((level) => begun.includes(level)) ?? null;
  }

  /** Whether a runaway is going on. */
  get runaway() {
    return [...this.#known.values()].some((level) => URGENT.has(level));
  }
}
