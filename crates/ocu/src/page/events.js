// The log of events: what happened to the vehicles, when, and by whom. It is fetched while it is
// shown, and only what is new.

import { duration, get, list, make, mark, number, plain, say, show } from "./dom.js";
import { Pull } from "./pull.js";

const PERIOD = 1_000;
const MOST = 500;

export class Events {
  #pull;
  #events = [];
  #latest = 0;
  #filter = "";
  #shown = "";

  constructor(pull = new Pull(PERIOD)) {
    this.#pull = pull;
    get("events-vehicle").addEventListener("change", (event) => {
      this.#filter = event.target.value;
      this.#render();
    });
  }

  /** Takes a state, whether it is live, and the list of vehicles. */
  update(state, live, vehicles, token) {
    const latest = number(state?.events) ?? 0;
    // A station that has started anew counts from 1 again.
    if (latest < this.#latest) this.reset();
    this.#offer(vehicles);
    const isShown = get("events").getClientRects().length > 0;
    if (isShown && live && latest > this.#latest) {
      this.#pull.get(`/events?after=${this.#latest}`, token, (answer) => this.#take(answer));
    }
    if (isShown) this.#render();
  }

  /** Another station has another log. */
  reset() {
    this.#pull.forget();
    [this.#events, this.#latest] = [[], 0];
  }

  #take(answer) {
    const now = performance.now();
    for (const event of list(answer.events, MOST)) {
      if (number(event?.number) === null || event.number <= this.#latest) continue;
      this.#events.push({ ...readable(event), at: now - (number(event.age_ms) ?? 0) });
    }
    this.#latest = Math.max(this.#latest, number(answer.latest) ?? 0);
    this.#events.splice(0, Math.max(0, this.#events.length - MOST));
    this.#render();
  }

  /** Offers the vehicles as a filter. */
  #offer(vehicles) {
    const numbers = new Set(vehicles.map(({ subsystem }) => String(subsystem)));
    for (const { vehicle } of this.#events) numbers.add(vehicle);
    const wanted = ["", ...[...numbers].sort((a, b) => a - b)];
    const select = get("events-vehicle");
    if ([...select.options].map(({ value }) => value).join() === wanted.join()) return;
    select.replaceChildren(...wanted.map((value) => make("option", { value }, value || "All vehicles")));
    if (!wanted.includes(this.#filter)) this.#filter = "";
    select.value = this.#filter;
  }

  #render() {
    const events = this.#events.filter(({ vehicle }) => !this.#filter || vehicle === this.#filter);
    say(get("events-count"), events.length === 1 ? "1 event" : `${events.length} events`);
    show(get("events-empty"), events.length === 0);
    const shown = `${this.#filter} ${events.at(-1)?.number} ${events.length}`;
    if (shown !== this.#shown) {
      this.#shown = shown;
      get("events").replaceChildren(...events.map(row).reverse());
    }
    for (const element of get("events").children) {
      const { at } = this.#events.find(({ number: id }) => String(id) === element.dataset.number) ?? {};
      if (at !== undefined) mark(element, "title", `${duration(performance.now() - at)} ago`);
    }
  }
}

function readable({ number: id, time, vehicle, kind, level, text }) {
  const clock = new Date(plain(time, 40));
  return {
    number: id,
    clock: Number.isNaN(clock.getTime()) ? "" : clock.toTimeString().slice(0, 8),
    vehicle: plain(vehicle, 8),
    kind: plain(kind, 16),
    level: ["warn", "bad"].includes(level) ? level : "info",
    text: plain(text, 300),
  };
}

function row({ number: id, clock, vehicle, kind, level, text }) {
  const item = make(
    "li",
    { className: "event" },
    make("time", {}, clock),
    make("span", { className: "event-vehicle" }, `${vehicle} · ${kind}`),
    make("p", {}, text.replace(/^./, (letter) => letter.toUpperCase())),
  );
  [item.dataset.number, item.dataset.level] = [String(id), level];
  return item;
}
