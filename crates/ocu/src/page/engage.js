// From arrival to driving by hand with one button: takes control, also from a mission, makes the
// vehicle ready, and then leaves it to the stick and the keys.

import { get, mark, plain, say, show, toast } from "./dom.js";
import { part } from "./status.js";

/** How long the station may take to show the effect of a request, in milliseconds. */
const GRACE = 2_000;

export class Engage {
  #ask;
  #ready;
  /** When control or Resume was asked for last; null while the button is not at work. */
  #asked = null;
  #resumed = false;
  #tookOver = false;

  /** Sends requests by `ask`, and calls `ready` when the vehicle can be driven. */
  constructor(ask, ready) {
    this.#ask = ask;
    this.#ready = ready;
    get("by-hand").addEventListener("click", () => this.#begin());
  }

  /** Takes a state; `obstacle` says what prevents driving even after control and Resume, or is empty. */
  update(state, operable, obstacle) {
    const { held, wanted, asking, planner_drives: planned } = state?.control ?? {};
    const mode = part(state, "primitive_driver")?.state;
    if (this.#asked !== null) this.#go(Boolean(held || wanted || asking), held, planned ? "planned" : mode, operable, obstacle);
    const done = held && mode === "ready" && !planned;
    const button = get("by-hand");
    show(button, operable && Boolean(mode) && !obstacle && !done && (planned || document.body.dataset.mission !== "under-way"));
    button.disabled = this.#asked !== null;
    say(button, this.#asked === null ? (planned ? "Take over" : "Drive by hand") : asking ? "Requesting control" : "Taking control");
    mark(button, "aria-busy", this.#asked === null ? null : "true");
  }

  #begin() {
    [this.#asked, this.#resumed, this.#tookOver] = [performance.now(), false, false];
    this.#request({ type: "control", on: true });
  }

  /** The next step, once the one before has shown its effect. */
  #go(isOurs, held, mode, operable, obstacle) {
    if (!operable || obstacle) return this.#end(obstacle);
    if (!isOurs) return performance.now() - this.#asked > GRACE ? this.#end("Control was not granted") : undefined;
    if (!held) return;
    if (mode === "planned") {
      if (this.#tookOver) return;
      this.#tookOver = true;
      this.#request({ type: "take_over" });
    } else if (mode === "ready") {
      this.#end("");
      this.#ready();
    } else if (mode === "standby" && !this.#resumed) {
      this.#resumed = true;
      this.#request({ type: "resume" });
    }
  }

  async #request(request) {
    if ((await this.#ask(request)) !== null) this.#end("");
    else if (this.#asked !== null) this.#asked = performance.now();
  }

  #end(reason) {
    this.#asked = null;
    if (reason) toast("warn", plain(reason, 140));
  }
}
