// Handing over control between operators: shows another operator's request, takes the answer, and
// shows how control changed.

import { get, objects, plain, say, show, toast } from "./dom.js";

/** A request that has just appeared is not answered by a click that was meant for the one before, in milliseconds. */
const UNREAD = 1_000;

export class Handover {
  #ask;
  #now;
  #request = null;
  /** Since when it is shown. */
  #since = 0;
  #shown = "";

  /** Sends answers by `ask`. */
  constructor(ask, now = () => performance.now()) {
    [this.#ask, this.#now] = [ask, now];
    get("handover-yes").addEventListener("click", () => this.#answer(true));
    get("handover-no").addEventListener("click", () => this.#answer(false));
  }

  /** Takes a state; `operable` says whether this page may answer. */
  update(state, operable) {
    const { requests, handover } = state.control ?? {};
    const ending = plain(handover, 200);
    if (ending && ending !== this.#shown) toast("warn", ending.replace(/^./, (letter) => letter.toUpperCase()));
    this.#shown = ending;
    const waiting = objects(requests, 8);
    const isShown = ({ part, operator }) => plain(part, 16) === this.#request?.part && plain(operator, 16) === this.#request?.operator;
    const known = waiting.find(isShown);
    const request = known ?? waiting[0];
    if (!known) this.#since = this.#now();
    this.#request = request ? { part: plain(request.part, 16), operator: plain(request.operator, 16) } : null;
    show(get("handover"), operable && this.#request !== null);
    for (const id of ["handover-yes", "handover-no"]) get(id).disabled = this.#isUnread;
    if (this.#request === null) return;
    const why = plain(request.explanation, 120);
    say(get("handover-text"), `${this.#request.operator} requests control (authority ${request.authority})${why ? `: ${why}` : ""}`);
  }

  get #isUnread() {
    return this.#now() - this.#since < UNREAD;
  }

  #answer(grant) {
    if (this.#request === null || this.#isUnread) return;
    this.#ask({ type: "handover", ...this.#request, grant });
  }
}
