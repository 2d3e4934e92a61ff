// From arrival to driving by hand with one button: takes control, makes the vehicle ready, and then
// leaves it to the stick and the keys. While a mission drives, taking over from it is a button of its own, which
// stops the mission first: no stick and no key does that.

import { get, mark, plain, say, show, toast } from "./dom.js";
import { part } from "./status.js";

/** How long the station may take to show the effect of a request, in milliseconds. */
const GRACE = 2_000;

/** Whether the vehicle waits for Resume from this station. */
export function awaitsResume(state) {
  const mode = part(state, "primitive_driver")?.state;
  return mode === "standby" || (mode === "ready" && state?.control?.resumed === false);
}

export class Engage {
  #ask;
  #mission;
  #ready;
  /** When control or Resume was asked for last; null while the button is not at work. */
  #asked = null;
  #resumed = false;
  /** The vehicle that the page shows, and the one that was asked for. */
  #shown = null;
  #vehicle = null;
  /** Whether a mission is being stopped first. */
  #isTakingOver = false;

  /** Sends requests by `ask`, and calls `ready` when the vehicle can be driven. */
  constructor(ask, mission, ready) {
    this.#ask = ask;
    this.#mission = mission;
    this.#ready = ready;
    get("by-hand").addEventListener("click", () => this.#begin({ type: "control", on: true }));
    get("take-over").addEventListener("click", () => {
      this.#isTakingOver = true;
      this.#begin({ type: "take_over" });
    });
  }

  /** Takes a state; `obstacle` says what prevents driving even after control and Resume, or is empty. */
  update(state, operable, obstacle) {
    const { held, wanted, asking } = state?.control ?? {};
    const driver = part(state, "primitive_driver");
    // As another client has left it, the vehicle may be ready before it is resumed for this station.
    const mode = awaitsResume(state) ? "standby" : driver?.state;
    this.#shown = state?.vehicle?.subsystem ?? null;
    if (this.#asked !== null && this.#shown !== this.#vehicle) this.#end("");
    if (this.#asked !== null && this.#isTakingOver) this.#stopMission(operable, obstacle);
    else if (this.#asked !== null) this.#go(Boolean(held || wanted || asking), held && driver?.ours, mode, operable, obstacle);
    const canTakeOver = Boolean(operable && held && !obstacle && (this.#mission.drives || this.#isTakingOver));
    show(get("take-over"), canTakeOver);
    get("take-over").disabled = this.#asked !== null;
    show(get("limit"), !canTakeOver);
    const done = held && mode === "ready";
    const button = get("by-hand");
    show(button, operable && Boolean(mode) && !obstacle && !done && document.body.dataset.mission !== "under-way");
    button.disabled = this.#asked !== null;
    say(button, this.#asked === null ? "Drive by hand" : asking ? "Requesting control" : "Taking control");
    mark(button, "aria-busy", this.#asked === null ? null : "true");
  }

  #begin(request) {
    [this.#asked, this.#resumed, this.#vehicle] = [performance.now(), false, this.#shown];
    this.#request(request);
  }

  /** Goes on by hand once the mission is over. */
  #stopMission(operable, obstacle) {
    if (this.#mustEnd(operable, obstacle)) return;
    if (operable && !this.#mission.drives) {
      this.#isTakingOver = false;
      this.#begin({ type: "control", on: true });
    } else if (this.#isLate) {
      this.#end("The mission did not stop");
    }
  }

  /** The next step, once the one before has shown its effect. */
  #go(isOurs, held, mode, operable, obstacle) {
    if (this.#mustEnd(operable, obstacle) || !operable) return;
    if (!isOurs) return this.#isLate ? this.#end("Control was not granted") : undefined;
    if (!held) return;
    if (mode === "ready") {
      this.#end("");
      this.#ready();
    } else if (mode === "standby" && !this.#resumed) {
      this.#resumed = true;
      this.#request({ type: "resume" });
    } else if (this.#isLate) {
      // Somebody has stopped it meanwhile, for example.
      this.#end("The vehicle did not get ready: press again");
    }
  }

  get #isLate() {
    return performance.now() - this.#asked > GRACE;
  }

  /** Ends for an obstacle, or for a connection that stays lost: a late packet does not take the operator's word back. */
  #mustEnd(operable, obstacle) {
    const isLost = !operable && this.#isLate;
    if (obstacle || isLost) this.#end(obstacle || "The connection was lost: press again");
    return Boolean(obstacle || isLost);
  }

  async #request(request) {
    if ((await this.#ask(request)) !== null) this.#end("");
    else if (this.#asked !== null) this.#asked = performance.now();
  }

  #end(reason) {
    [this.#asked, this.#isTakingOver] = [null, false];
    if (reason) toast("warn", plain(reason, 140));
  }
}
