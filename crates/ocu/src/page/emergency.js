// Emergency stop of the selected vehicle and of all: one touch or key, from anywhere, in any
// condition. The request is repeated until the vehicles report their emergency, over reconnections
// as well; that they have stopped shows in their speed. Clearing it takes two.

import { get, mark, say, show, toast } from "./dom.js";
import { StopLink } from "./stop_link.js";
import { othersWords, pendingStops, stopAllWords, stopCondition, stopWords } from "./stopping.js";

const CLEAR_TEXT = "The vehicle can move again once a client resumes and commands it. Check it first.";
const touch = matchMedia("(hover: none)");

export class Emergency {
  #link;
  #stops;
  /** Whether the operator has stopped the vehicle and it has not confirmed that yet. */
  #wanted = false;
  /** How far the vehicle's stop is; null while it reports no emergency. */
  #condition = null;
  #speed = null;
  #refusal = "";
  /** The same for all vehicles. */
  #wantedAll = false;
  #vehicles = [];
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
    link.addEventListener("hello", () => this.#stops.start());
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
    this.#stop("emergency");
  }

  /** Stops all vehicles. */
  stopAll() {
    this.#wantedAll = true;
    this.#stop("emergency_all");
  }

  #stop(type) {
    if (this.#barred) {
      [this.#wanted, this.#wantedAll] = [false, false];
      return this.#unbar();
    }
    this.#closeSheet();
    this.#wanted = true;
    this.#refusal = "";
    this.#send(type);
    this.#render();
    navigator.vibrate?.(80);
  }

  /** Takes a key; true if it was for the emergency stop. Space types in fields, Escape never does. With
   * Shift it stops all vehicles. */
  key(event) {
    const field = event.target instanceof HTMLInputElement;
    if (event.key !== "Escape" && !(event.code === "Space" && !field)) return false;
    event.preventDefault();
    if (!event.repeat) event.shiftKey ? this.stopAll() : this.stop();
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
    this.#condition = stopCondition(state?.vehicle, live);
    this.#speed = state?.vehicle?.velocity?.x;
    if (this.#condition) this.#wanted = false;
    if (pendingStops(vehicles) === 0) this.#wantedAll = false;
    if (!this.#wanted && !this.#wantedAll) this.#stops.cancel();
    this.#render();
  }

  #send(type) {
    if (type === "emergency_all") this.#stops.stopAll();
    else if (this.#link.vehicle !== null) this.#stops.stop(this.#link.vehicle);
  }

  #refuse(reason) {
    if (this.#refusal !== reason) toast("bad", `Emergency stop: ${reason}`);
    this.#refusal = reason;
  }

  #render() {
    const how = this.#condition ?? (this.#wanted ? "wanted" : this.#barred ? "barred" : "ready");
    document.body.dataset.emergency = how;
    const [word, detail] = this.#condition
      ? stopWords(this.#condition, this.#speed)
      : {
          ready: ["Emergency stop", touch.matches ? "stops the vehicle at once" : "Esc or Space"],
          barred: ["Emergency stop", this.#barred],
          wanted: ["Stopping", this.#link.open ? this.#refusal || "not confirmed yet" : "NOT SENT: no connection"],
        }[how];
    say(get("estop-word"), word);
    say(get("estop-detail"), detail);
    mark(get("estop"), "aria-pressed", String(this.#condition !== null || how === "wanted"));
    show(get("runaway"), this.#condition === "runaway");
    const count = this.#vehicles.length;
    show(get("estop-all"), count > 1);
    say(get("estop-all-detail"), stopAllWords(this.#vehicles, this.#wantedAll));
    mark(get("estop-all"), "data-wanted", this.#wantedAll ? "yes" : null);
    show(get("latch"), this.#latched);
    get("latch-clear").disabled = !this.#clears;
    const stopped = this.#vehicles.filter(({ state }) => state === "emergency").length;
    show(get("clear-all"), stopped > 1 || this.#latched);
    show(get("estop-clear"), this.#condition !== null && this.#clears);
    show(get("clear-any"), this.#ofOthers && this.#clearsAny);
    if (this.#condition === null) show(get("clear-sheet"), false);
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
    const reason = await this.#link.ask(request);
    if (reason === null) toast("good", request.type === "emergency" ? "Emergency cleared." : "All emergencies cleared.");
    else toast("bad", reason);
  }
}
