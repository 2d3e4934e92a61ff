// Handing over control between operators: shows another operator's request, takes the answer, and
// shows how control changed.

import { get, list, plain, say, show, toast } from "./dom.js";

export class Handover {
  #ask;
  #request = null;
  #shown = "";

  /** Sends answers by `ask`. */
  constructor(ask) {
    this.#ask = ask;
    get("handover-yes").addEventListener("click", () => this.#answer(true));
    get("handover-no").addEventListener("click", () => this.#answer(false));
  }

  /** Takes a state; `operable` says whether this page may answer. */
  update(state, operable) {
    const { requests, handover } = state.control ?? {};
    const ending = plain(handover, 200);
    if (ending && ending !== this.#shown) toast("warn", ending.replace(/^./, (letter) => letter.toUpperCase()));
    this.#shown = ending;
    const [first] = list(requests, 8);
    this.#request = first ? { part: plain(first.part, 16), operator: plain(first.operator, 16) } : null;
    show(get("handover"), operable && this.#request !== null);
    if (this.#request === null) return;
    const why = plain(first.explanation, 120);
    say(get("handover-text"), `${this.#request.operator} requests control (authority ${first.authority})${why ? `: ${why}` : ""}`);
  }

  #answer(grant) {
    if (this.#request !== null) this.#ask({ type: "handover", ...this.#request, grant });
  }
}
