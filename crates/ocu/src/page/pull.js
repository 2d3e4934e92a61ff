// Fetches from the station what a page shows beside the state: one request at a time, and the next
// only after several times the time that the last one took, so that a slow link is not filled.

/** A request takes up the link for at most one part in this many of the time. */
const SHARE = 4;
const RETRY = 2_000;

export class Pull {
  #period;
  #busy = false;
  #notBefore = 0;
  /** Answers to requests before this number are out of date. */
  #era = 0;
  #fetch;
  #now;

  /** Fetches at most once in `period` milliseconds. Tests give another clock and network. */
  constructor(period, fetch = (...given) => globalThis.fetch(...given), now = () => performance.now()) {
    this.#period = period;
    this.#fetch = fetch;
    this.#now = now;
  }

  /** Fetches JSON if it is time to, and gives it to `take`; true if a request was sent. */
  get(request, token, take) {
    if (this.#busy || this.#now() < this.#notBefore) return false;
    this.#busy = true;
    this.#load(request, token, take);
    return true;
  }

  /** Drops the answer that is awaited: it would be about something else. */
  forget() {
    this.#era++;
    this.#notBefore = 0;
  }

  async #load(request, token, take) {
    const [begun, era] = [this.#now(), this.#era];
    const headers = token ? { Authorization: `Bearer ${token}` } : {};
    let pause = RETRY;
    try {
      const answer = await this.#fetch(request, { headers, cache: "no-store" });
      const content = answer.ok ? await answer.json() : null;
      pause = Math.max(answer.ok ? this.#period : RETRY, (this.#now() - begun) * SHARE);
      if (content !== null && typeof content === "object" && era === this.#era) take(content);
    } catch {
      // The state says that there is no connection. The next attempt follows.
    }
    this.#busy = false;
    if (era === this.#era) this.#notBefore = this.#now() + pause;
  }
}
