// Emergency stop of the selected vehicle and of all: one touch or key, from anywhere, in any
// condition. The request is repeated until the vehicles report that they have stopped, over
// reconnections as well. Clearing it takes two.

import { get, mark, say, show, toast } from "./dom.js";
import { StopLink } from "./stop_link.js";

const touch = matchMedia("(hover: none)");

export class Emergency {
  #link;
  #stops;
  /** Whether the operator has stopped the vehicle and it has not confirmed that yet. */
  #wanted = false;
  #confirmed = false;
  #refusal = "";
  /** The same for all vehicles. */
  #wantedAll = false;
  #vehicles = [];
  /** Why the station takes no requests from this page; empty if it does. */
  #barred = "";
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
    get("clear-yes").addEventListener("click", () => this.#clear("emergency"));
    get("clear-all").addEventListener("click", () => this.#clear("emergency_all"));
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

  /** Takes a state, the list of vehicles, and why the station takes no requests. */
  update(state, vehicles, barred) {
    this.#vehicles = vehicles;
    this.#barred = barred;
    this.#confirmed = state?.vehicle?.emergency === true;
    if (this.#confirmed) this.#wanted = false;
    if (this.#moving() === 0) this.#wantedAll = false;
    if (!this.#wanted && !this.#wantedAll) this.#stops.cancel();
    this.#render();
  }

  /** How many of the vehicles that are present have not reported their emergency. */
  #moving() {
    return this.#vehicles.filter(({ presence, state }) => presence === "present" && state !== "emergency").length;
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
    const how = this.#confirmed ? "stopped" : this.#wanted ? "wanted" : this.#barred ? "barred" : "ready";
    document.body.dataset.emergency = how;
    const [word, detail] = {
      ready: ["Emergency stop", touch.matches ? "stops the vehicle at once" : "Esc or Space"],
      barred: ["Emergency stop", this.#barred],
      wanted: ["Stopping", this.#link.open ? this.#refusal || "not confirmed yet" : "NOT SENT: no connection"],
      stopped: ["Emergency", "the vehicle is stopped"],
    }[how];
    say(get("estop-word"), word);
    say(get("estop-detail"), detail);
    mark(get("estop"), "aria-pressed", String(["wanted", "stopped"].includes(how)));
    const [count, moving] = [this.#vehicles.length, this.#moving()];
    show(get("estop-all"), count > 1);
    const all = this.#wantedAll ? `${moving} not stopped yet` : moving === 0 ? "all are stopped" : `${count} vehicles`;
    say(get("estop-all-detail"), all);
    mark(get("estop-all"), "data-wanted", this.#wantedAll ? "yes" : null);
    show(get("clear-all"), count - moving > 1);
    show(get("estop-clear"), this.#confirmed && !this.#barred);
    if (!this.#confirmed) show(get("clear-sheet"), false);
  }

  #openSheet() {
    show(get("clear-sheet"), true);
    get("clear-no").focus();
  }

  #closeSheet() {
    const sheet = get("clear-sheet");
    if (sheet.contains(document.activeElement)) get("estop").focus();
    show(sheet, false);
  }

  async #clear(type) {
    this.#closeSheet();
    const reason = await this.#link.ask({ type, on: false });
    if (reason === null) toast("good", "Emergency cleared.");
    else toast("bad", reason);
  }
}
