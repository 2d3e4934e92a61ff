// The list of vehicles: which there are, how they are, who controls them, and which one is selected.
// Rows are kept and changed in place, so that focus stays where it is.

import { duration, figure, get, list, make, mark, number, plain, say, show, words } from "./dom.js";

const MOST = 256;

export class Fleet {
  #select;
  #vehicles = [];
  #allStopped = false;
  #stops = null;
  #rows = new Map();

  /** Calls `select` with the number of a vehicle that the operator chooses. */
  constructor(select) {
    this.#select = select;
    get("fleet").addEventListener("keydown", (event) => this.#key(event));
  }

  /** The vehicles, as the station last listed them. */
  get vehicles() {
    return this.#vehicles;
  }

  /** Whether *Stop all* is latched: the station stops vehicles that join. */
  get allStopped() {
    return this.#allStopped;
  }

  /** How many stops of all pages the station had taken when it made the list; null if it does not say it. */
  get stops() {
    return this.#stops;
  }

  /** Takes a list of vehicles. */
  handle({ vehicles, all_stopped: allStopped, stops }) {
    this.#allStopped = allStopped === true;
    this.#stops = number(stops);
    this.#vehicles = list(vehicles, MOST).filter((one) => number(one?.subsystem) !== null);
  }

  /** Shows the list and the selected vehicle; `usable` says whether another one can be selected, and
   * `page` is the number of this page at the station. */
  update(state, usable, page) {
    const chosen = number(state?.vehicle?.subsystem);
    const name = plain(state?.vehicle?.name, 40) || "Vehicle";
    const count = this.#vehicles.length;
    say(get("vehicle-name"), chosen === null ? "No vehicle found" : `${name} · ${chosen}`);
    say(get("vehicle-count"), count > 1 ? `of ${count}` : "");
    say(get("fleet-count"), count === 1 ? "1 vehicle" : `${count} vehicles`);
    show(get("fleet-empty"), count === 0);
    const left = new Set(this.#rows.keys());
    for (const vehicle of this.#vehicles) {
      left.delete(vehicle.subsystem);
      this.#showRow(vehicle, vehicle.subsystem === chosen, usable, page);
    }
    for (const gone of left) {
      this.#rows.get(gone).remove();
      this.#rows.delete(gone);
    }
  }

  /** Puts the focus on the selected vehicle, or else on the first. */
  focus() {
    const rows = [...get("fleet").children];
    (rows.find((row) => row.firstChild.ariaCurrent === "true") ?? rows[0])?.firstChild.focus();
  }

  #showRow(vehicle, chosen, usable, page) {
    const row = this.#rows.get(vehicle.subsystem) ?? this.#create(vehicle.subsystem);
    const button = row.firstChild;
    const [, name, mode, detail] = button.children;
    const absent = vehicle.presence !== "present";
    mark(button, "data-state", absent ? plain(vehicle.presence, 12) : plain(vehicle.state ?? "unknown", 20));
    mark(button, "aria-current", String(chosen));
    button.disabled = !usable;
    say(name, `${plain(vehicle.name, 40) || "Vehicle"} · ${vehicle.subsystem}`);
    say(mode, condition(vehicle));
    say(detail, `${controller(vehicle, page)} · ${news(vehicle)}`);
  }

  #create(number) {
    const parts = [
      make("span", { className: "dot", "aria-hidden": "true" }),
      make("b"),
      make("span", { className: "part-state" }),
      make("small"),
    ];
    const button = make("button", { type: "button", className: "part" }, ...parts);
    button.addEventListener("click", () => this.#select(number));
    const row = make("li", {}, button);
    this.#rows.set(number, row);
    const after = [...this.#rows.keys()].filter((other) => other > number);
    get("fleet").insertBefore(row, this.#rows.get(Math.min(...after)) ?? null);
    return row;
  }

  /** The arrow keys move along the list. They must not drive meanwhile. */
  #key(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    const buttons = [...get("fleet").querySelectorAll("button")];
    const at = buttons.indexOf(document.activeElement);
    if (!step || at < 0) return;
    event.preventDefault();
    event.stopPropagation();
    buttons[Math.min(Math.max(at + step, 0), buttons.length - 1)].focus();
  }
}

/** The vehicle's state in words; while it is on a mission, the mission's. */
export function condition({ presence, state, mission, at_rest: rest, speed, runaway }) {
  if (presence === "unknown") return "Not found yet";
  if (presence !== "present") return words(presence);
  if (runaway === true) return "RUNAWAY";
  if (state === "emergency" && rest === false) return `Emergency, ${pace(speed) || "moving"}`;
  const mode = state === "ready" && mission ? words(mission) : words(state ?? "unknown");
  return rest === false && pace(speed) ? `${mode}, ${pace(speed)}` : mode;
}

const pace = (speed) => (number(speed) !== null && Math.abs(speed) >= 0.05 ? `${figure(Math.abs(speed), 1)} m/s` : "");

/** Who drives or controls the vehicle, in words. */
export function controller({ held, driver, requested, controller: id, authority }, page) {
  if (requested) return "another operator requests control";
  if (driver?.endsWith(`(page ${page})`)) return "you control it";
  if (driver) return `${plain(driver, 48)} controls it`;
  if (held) return "this station controls it";
  if (!id) return "nobody controls it";
  return `${plain(id, 16)} controls it${number(authority) === null ? "" : ` (${authority})`}`;
}

function news({ age_ms: age }) {
  if (number(age) === null) return "no report";
  return age < 1_500 ? "now" : `${duration(age)} ago`;
}
