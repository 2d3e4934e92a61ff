// The message view: what the parts of the system say to each other, newest first, filtered by the
// server, bounded, and honest about what was lost on the way here.

import { get, make, mark, number, plain, say, show } from "./dom.js";

const KEPT = 300;
/** Messages that wait to be shown; a browser that is too slow for more loses them, counted. */
const WAITING = 400;
const PERIOD = 200;

export class Messages {
  #link;
  #on = false;
  #paused = false;
  #waiting = [];
  #lost = 0;
  #filterTimer = 0;

  constructor(link) {
    this.#link = link;
    link.addEventListener("message", (event) => this.#take(event.detail));
    link.addEventListener("lost", (event) => this.#lose(number(event.detail.count) ?? 0));
    link.addEventListener("hello", () => this.#on && this.#subscribe());
    get("messages-on").addEventListener("click", () => this.#setOn(!this.#on));
    get("messages-pause").addEventListener("click", () => this.#setPaused(!this.#paused));
    get("messages-clear").addEventListener("click", () => this.#clear());
    const filters = get("filters");
    filters.addEventListener("submit", (event) => event.preventDefault());
    filters.addEventListener("input", () => {
      clearTimeout(this.#filterTimer);
      this.#filterTimer = setTimeout(() => this.#on && this.#subscribe(), 300);
    });
    setInterval(() => this.#flush(), PERIOD);
  }

  #subscribe() {
    const filter = Object.fromEntries([...new FormData(get("filters"))].map(([name, value]) => [name, value.trim()]));
    this.#link.send({ type: "messages", on: this.#on, filter });
  }

  #setOn(on) {
    this.#on = on;
    const button = get("messages-on");
    mark(button, "aria-pressed", String(on));
    say(button, on ? "Listening" : "Listen");
    get("messages-pause").disabled = !on;
    if (!on) this.#setPaused(false);
    this.#subscribe();
    this.#note();
  }

  /** While paused the list stands still; what comes waits, as much as there is room for. */
  #setPaused(paused) {
    this.#paused = paused;
    mark(get("messages-pause"), "aria-pressed", String(paused));
    say(get("messages-pause"), paused ? "Go on" : "Pause");
    this.#note();
  }

  #clear() {
    get("message-list").replaceChildren();
    this.#waiting = [];
    this.#lost = 0;
    show(get("lost"), false);
    this.#note();
  }

  #take(message) {
    this.#waiting.push(message);
    if (this.#waiting.length > WAITING) {
      this.#waiting.shift();
      this.#lose(1);
    }
  }

  #lose(count) {
    this.#lost += Math.max(0, count);
    show(get("lost"), this.#lost > 0);
    say(get("lost"), `${this.#lost.toLocaleString("en")} lost`);
  }

  #flush() {
    if (this.#paused || !this.#waiting.length) return;
    const list = get("message-list");
    const rows = this.#waiting.splice(0).slice(-KEPT).reverse().map(row);
    list.prepend(...rows);
    while (list.children.length > KEPT) list.lastChild.remove();
    this.#note();
  }

  #note() {
    const empty = !get("message-list").children.length;
    show(get("messages-note"), empty);
    say(get("messages-note"), this.#on ? "No message has matched the filter yet." : "Press Listen to see the messages between the vehicle's components.");
  }
}

/** A message as one line that unfolds into its fields. */
function row(message) {
  const details = make(
    "details",
    {},
    make(
      "summary",
      {},
      make("time", {}, plain(message.time, 40).slice(11, 23)),
      make("b", {}, plain(message.name, 60) || "Unknown"),
      make("code", {}, plain(message.code, 6)),
      make("span", { className: "route" }, `${plain(message.source, 16)} → ${plain(message.destination, 16)}`),
    ),
  );
  // Fields are written out only for those who look.
  details.addEventListener("toggle", () => {
    if (details.open && details.children.length === 1) {
      const service = plain(message.service, 160);
      const text = JSON.stringify(message.value ?? null, null, 2).slice(0, 8_000);
      details.append(make("p", { className: "hint" }, service), make("pre", {}, text));
    }
  });
  return make("li", {}, details);
}
