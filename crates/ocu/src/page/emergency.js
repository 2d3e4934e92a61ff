// Emergency stop of the selected vehicle and of all: one touch or key, from anywhere, in any
// condition. Each stop is repeated until the station repeats it itself and the vehicle reports its
// emergency, over reconnections and other vehicles as well; that it has stopped shows in its speed.
// Clearing it takes two.

import { get, mark, number, say, show, toast } from "./dom.js";
import { StopLink } from "./stop_link.js";
import { haveStopped, othersWords, pendingStops, stopAllWords, stopCondition, stopWords } from "./stopping.js";

const CLEAR_TEXT = "The vehicle can move again once a client resumes and commands it. Check it first.";
const touch = matchMedia("(hover: none)");

export class Emergency {
  #link;
  /** Holds the stops that are not confirmed yet. */
  #stops;
  /** Whether the operator has pressed a stop before the page knew a vehicle. */
  #wantedFirst = false;
  /** How far the vehicle's stop is; null while it reports no emergency. */
  #condition = null;
  #speed = null;
  #refusal = "";
  /** How many stops of all pages the station had taken by the last state. The operator who clears knows of them. */
  #known = 0;
  /** Whether the station has stopped the vehicle, which may not have reported it yet, and perhaps never can. */
  #isSet = false;
  #vehicles = [];
  /** The vehicles that were there when all were stopped. A station that has restarted since may not know them yet. */
  #toStop = [];
  /** Whether the station stops vehicles that join. */
  #latched = false;
  /** Why the station takes no requests from this page; empty if it does. */
  #barred = "";
  #clears = false;
  /** Whether other clients have set the emergency, and whether this page may clear theirs. */
  #ofOthers = false;
  #clearsAny = false;
  #unbar;

  /** Calls `unbar` when the operator stops a vehicle and the station takes no requests. */
  constructor(link, unbar) {
    this.#link = link;
    this.#stops = new StopLink(link);
    this.#stops.addEventListener("refused", ({ detail }) => this.#refuse(detail));
    link.addEventListener("hello", () => {
      // Another station may count from the start.
      this.#known = 0;
      this.#stops.start();
    });
    link.addEventListener("barred", () => this.#stops.close());
    this.#unbar = unbar;
    get("estop").addEventListener("click", () => this.stop());
    get("estop-all").addEventListener("click", () => this.stopAll());
    get("estop-clear").addEventListener("click", () => this.#openSheet());
    get("clear-no").addEventListener("click", () => this.#closeSheet());
    get("clear-yes").addEventListener("click", () => this.#clear({ type: "emergency", on: false }));
    get("clear-any").addEventListener("click", () => this.#clear({ type: "clear_any_emergency" }));
    for (const id of ["clear-all", "latch-clear"]) {
      get(id).addEventListener("click", () => this.#clear({ type: "emergency_all", on: false }));
    }
    this.#render();
  }

  /** Stops the vehicle. */
  stop() {
    this.#press(() => {
      const { vehicle } = this.#link;
      if (vehicle === null) this.#wantedFirst = true;
      else this.#stops.stop(vehicle);
    });
  }

  /** Stops all vehicles. */
  stopAll() {
    const there = this.#vehicles.filter(({ presence }) => !["gone", "unknown"].includes(presence));
    this.#toStop = there.map(({ subsystem }) => subsystem);
    this.#press(() => this.#stops.stopAll());
  }

  #press(stop) {
    this.#closeSheet();
    this.#refusal = "";
    // Also if the page is barred: the station decides.
    stop();
    if (this.#barred) this.#unbar();
    this.#render();
    navigator.vibrate?.(80);
  }

  /** Takes a state that has just arrived. */
  handleState({ vehicle, stops }) {
    const before = this.#known;
    this.#known = number(stops) ?? 0;
    if (this.#known > before && !get("clear-sheet").hidden) {
      this.#closeSheet();
      toast("warn", "Somebody has stopped a vehicle again: look before you clear it.");
    }
    if (vehicle) this.#confirm(vehicle, stops);
  }

  /** Takes a list of vehicles that has just arrived, and whether all are to be stopped. */
  handleFleet({ vehicles, allStopped, stops }) {
    for (const vehicle of vehicles) this.#confirm(vehicle, stops);
    const isDone = allStopped && pendingStops(vehicles) === 0;
    if (isDone && haveStopped(this.#toStop, vehicles)) this.#stops.confirm("all", stops);
  }

  /** Takes what the station says of a vehicle when it has taken so many stops. */
  #confirm({ subsystem, stop_set: isSet, emergency }, stops) {
    if (isSet === true && emergency === true) this.#stops.confirm(subsystem, stops);
  }

  /** Takes a key; true if it was for the emergency stop. Space types in fields, Escape never does. With
   * Shift it stops all vehicles. */
  key(event) {
    const field = event.target instanceof HTMLInputElement;
    if (event.key !== "Escape" && !(event.code === "Space" && !field)) return false;
    event.preventDefault();
    // A menu may have taken the press itself.
    const isDone = this.#condition !== null || this.#isWanted;
    if (!event.repeat || !isDone) event.shiftKey ? this.stopAll() : this.stop();
    return true;
  }

  /**
   * Takes a state with whether it is live, the list of vehicles with whether all are to be stopped, why
   * the station takes no requests, and whether it lets this page clear emergencies, also of others.
   */
  update(state, live, { vehicles, allStopped }, barred, { clears, clearsAny }) {
    this.#vehicles = vehicles;
    this.#latched = allStopped;
    this.#barred = barred;
    [this.#clears, this.#clearsAny] = [clears, clearsAny];
    this.#ofOthers = live && state?.vehicle?.emergency_of_others === true;
    this.#isSet = state?.vehicle?.stop_set === true;
    this.#condition = stopCondition(state?.vehicle, live);
    this.#speed = state?.vehicle?.velocity?.x;
    if (this.#wantedFirst && this.#link.vehicle !== null) {
      this.#wantedFirst = false;
      this.#stops.stop(this.#link.vehicle);
    }
    this.#render();
  }

  /** Whether a stop that concerns the vehicle is not confirmed yet. */
  get #isWanted() {
    return this.#wantedFirst || this.#stops.wants("all") || this.#stops.wants(this.#link.vehicle);
  }

  #refuse(reason) {
    if (this.#refusal !== reason) toast("bad", `Emergency stop: ${reason}`);
    this.#refusal = reason;
  }

  #render() {
    const isStopping = this.#isWanted || this.#isSet;
    const how = this.#condition ?? (this.#barred ? "barred" : isStopping ? "wanted" : "ready");
    document.body.dataset.emergency = how;
    const [word, detail] = this.#condition
      ? stopWords(this.#condition, this.#speed)
      : {
          ready: ["Emergency stop", touch.matches ? "stops the vehicle at once" : "Esc or Space"],
          barred: ["Emergency stop", this.#isWanted ? `NOT SENT: ${this.#barred}` : this.#barred],
          wanted: ["Stopping", this.#link.open ? this.#refusal || "not confirmed yet" : "NOT SENT: no connection"],
        }[how];
    say(get("estop-word"), word);
    say(get("estop-detail"), detail);
    mark(get("estop"), "aria-pressed", String(this.#condition !== null || isStopping));
    show(get("runaway"), this.#condition === "runaway");
    const count = this.#vehicles.length;
    show(get("estop-all"), count > 1);
    const wantsAll = this.#stops.wants("all");
    say(get("estop-all-detail"), stopAllWords(this.#vehicles, wantsAll));
    mark(get("estop-all"), "data-wanted", wantsAll ? "yes" : null);
    show(get("latch"), this.#latched);
    get("latch-clear").disabled = !this.#clears;
    const stopped = this.#vehicles.filter(({ state }) => state === "emergency").length;
    show(get("clear-all"), stopped > 1 || this.#latched);
    const isStopped = this.#condition !== null || this.#isSet;
    show(get("estop-clear"), isStopped && this.#clears);
    show(get("clear-any"), this.#ofOthers && this.#clearsAny);
    if (!isStopped) show(get("clear-sheet"), false);
  }

  #openSheet() {
    const moves = this.#condition !== "stopped";
    const others = this.#ofOthers ? othersWords(this.#clearsAny) : "";
    say(get("clear-text"), `${others}${moves ? "The vehicle is not known to be at rest. " : ""}${CLEAR_TEXT}`);
    show(get("clear-sheet"), true);
    get("clear-no").focus();
  }

  #closeSheet() {
    const sheet = get("clear-sheet");
    if (sheet.contains(document.activeElement)) get("estop").focus();
    show(sheet, false);
  }

  async #clear(request) {
    this.#closeSheet();
    // The operator's last word counts, unless it is refused: then what was to be stopped still is.
    const { vehicle } = this.#link;
    const isWanted = this.#stops.wants(vehicle);
    const isAllWanted = this.#stops.wants("all") && request.type === "emergency_all";
    if (request.type === "emergency_all") this.#stops.cancelAll();
    else this.#stops.cancel(vehicle);
    const reason = await this.#link.ask({ ...request, press: this.#stops.press, stops: this.#known });
    if (reason === null) toast("good", request.type === "emergency" ? "Emergency cleared." : "All emergencies cleared.");
    else toast("bad", reason);
    if (reason !== null && isAllWanted) this.#stops.stopAll();
    if (reason !== null && isWanted) this.#stops.stop(vehicle);
  }
}
