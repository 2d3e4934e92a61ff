// Connections that carry nothing but stops, kept open beside the one of link.js. A stop is sent on
// all of them at once, so that it waits for no other frame and for no lost packet of another
// connection. Each is repeated until it is cancelled, over reconnections as well.

import { number } from "./dom.js";

const FIRST_PAUSE = 250;
const LONGEST_PAUSE = 4_000;
/** The station says something every 10 s, which a slow link delays. A connection that is silent for so long is given up. */
const DEAD = 25_000;
/** A connection that does not open within this is given up: browsers open one at a time, and others wait for it. */
const SLOWEST = 8_000;
/** What has been silent for longer than the station's interval does not outlive a new connection of link.js. */
const SILENT = 11_000;
/** Pauses between the repetitions of a stop in milliseconds; the last one goes on. */
const REPEATS = [50, 100, 200, 500];
/** With one packet in three lost, two connections bring a stop through in time. */
const CONNECTIONS = 2;

/** Sends stops to the station. Emits `refused` with the reason. */
export class StopLink extends EventTarget {
  #link;
  #channels;
  /** The stops that are repeated, by subsystem or `all`: each as a frame here and as a request of `link`, with
   * its press, and how many stops the station had taken with it, once it says so. */
  #stops = new Map();
  #timer = 0;
  #repeats = 0;
  /** A number of this page, and how often a stop was pressed: a copy that is late is known by it. */
  #press = [Math.floor(Math.random() * 2 ** 32), 0];

  /** Stops also by requests of `link`, whose token it shows to the station. */
  constructor(link, connect = () => link.socketTo("/stop")) {
    super();
    this.#link = link;
    link.addEventListener("stopped", ({ detail: { press, stops } }) => this.#note(String(press?.join?.(".")), stops));
    const events = {
      connect,
      token: () => link.token,
      opened: (channel) => channel.send(this.#frames),
      isPressing: () => this.#stops.size > 0,
      taken: (press, stops) => this.#note(press, stops),
      refused: (reason) => this.dispatchEvent(new CustomEvent("refused", { detail: reason })),
    };
    this.#channels = Array.from({ length: CONNECTIONS }, () => new Channel(events));
  }

  /** Opens the connections and keeps them open: to a station that may count its stops from the start. */
  start() {
    for (const stop of this.#stops.values()) stop.count = Infinity;
    for (const channel of this.#channels) channel.start();
  }

  /** Closes the connections. */
  close() {
    for (const channel of this.#channels) channel.close();
  }

  /** Whether a stop can be sent. */
  get open() {
    return this.#channels.some((channel) => channel.open);
  }

  /** Stops a vehicle until `cancel`. */
  stop(subsystem) {
    this.#begin(subsystem, `stop ${subsystem}`, { type: "emergency", vehicle: subsystem });
  }

  /** Stops all vehicles until `cancel`. */
  stopAll() {
    this.#begin("all", "stop-all", { type: "emergency_all" });
  }

  /** The last press: with its clearing, the station ignores what comes late of it and of those before. */
  get press() {
    return [...this.#press];
  }

  /** Whether the stop of a subsystem or `all` is repeated. */
  wants(target) {
    return this.#stops.has(target);
  }

  /** The station has the stop of a subsystem or `all` in force, as it says of a moment when it had taken so many
   * stops. Said of a moment before, it was another stop. */
  confirm(target, stops) {
    if (number(stops) !== null && stops >= (this.#stops.get(target)?.count ?? Infinity)) this.cancel(target);
  }

  /** Ends the repetitions for a subsystem or `all`. */
  cancel(target) {
    this.#stops.delete(target);
    if (this.#stops.size === 0) clearTimeout(this.#timer);
  }

  /** Ends all repetitions. */
  cancelAll() {
    this.#stops.clear();
    clearTimeout(this.#timer);
  }

  get #frames() {
    return [...this.#stops.values()].map(({ frame }) => frame);
  }

  #begin(target, frame, request) {
    clearTimeout(this.#timer);
    this.#press[1] += 1;
    const press = this.press.join(".");
    const what = { frame: `${frame} ${press}`, request: { ...request, on: true, press: this.press } };
    const stop = { ...what, press, count: Infinity };
    this.#stops.set(target, stop);
    this.#repeats = 0;
    this.#repeat([stop]);
  }

  /** The station has taken a press, which was so many stops in all; null if somebody has cleared it since. */
  #note(press, stops) {
    for (const [target, stop] of this.#stops) {
      if (stop.press !== press) continue;
      if (stops === null) this.cancel(target);
      else if (number(stops) !== null) stop.count = stops;
    }
  }

  /** Sends stops: all that are repeated, or one that is new. */
  #repeat(stops = [...this.#stops.values()]) {
    const isNew = this.#repeats === 0;
    const frames = stops.map(({ frame }) => frame);
    const sent = this.#channels.map((channel) => channel.send(frames, isNew));
    // The other connection comes second: it may be busy, and this one is enough on a good network.
    if (!sent.includes(true) || !isNew) for (const { request } of stops) this.#link.send(request);
    const pause = REPEATS[Math.min(this.#repeats++, REPEATS.length - 1)];
    this.#timer = setTimeout(() => this.#repeat(), pause);
  }
}

/** One connection for stops, which opens again by itself. */
class Channel {
  #events;
  #socket = null;
  #pause = FIRST_PAUSE;
  #timer = 0;
  #heardAt = 0;

  constructor(events) {
    this.#events = events;
  }

  /** Opens it, or again if it is open and silent. */
  start() {
    if (this.open && performance.now() - this.#heardAt > SILENT) this.close();
    if (this.#socket) return;
    clearTimeout(this.#timer);
    this.#pause = FIRST_PAUSE;
    this.#open();
  }

  close() {
    clearTimeout(this.#timer);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }

  get open() {
    return this.#socket?.readyState === 1;
  }

  /** Sends frames; copies only if earlier ones have left the browser. False if they cannot be sent. */
  send(frames, isNew = true) {
    if (!this.open) return false;
    if (isNew || this.#socket.bufferedAmount === 0) frames.forEach((frame) => this.#socket.send(frame));
    return true;
  }

  #open() {
    const socket = this.#events.connect();
    /** What the first frame is to prove. */
    let { answer } = socket;
    this.#socket = socket;
    this.#watch(socket, SLOWEST);
    socket.addEventListener("open", () => {
      if (socket !== this.#socket) return;
      this.#pause = FIRST_PAUSE;
      this.#hear(socket);
      const token = this.#events.token();
      if (token) socket.send(`token ${token}`);
      this.#events.opened(this);
    });
    socket.addEventListener("message", ({ data }) => {
      if (socket !== this.#socket) return;
      if (answer && data !== answer) {
        // Another program than the station confirms nothing.
        socket.close();
        return this.#retry();
      }
      answer = "";
      this.#hear(socket);
      const [word, , press, stops] = String(data).split(" ", 4);
      if (word === "ok") this.#events.taken(press, Number(stops));
      if (word === "cleared") this.#events.taken(press, null);
      if (word === "no") this.#events.refused(String(data).slice(3, 200));
    });
    socket.addEventListener("close", () => socket === this.#socket && this.#retry());
  }

  #hear(socket) {
    this.#heardAt = performance.now();
    this.#watch(socket, DEAD);
  }

  /** Gives the connection up unless the station says something in time. */
  #watch(socket, patience) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.#socket = null;
      socket.close();
      this.#retry();
    }, patience);
  }

  #retry() {
    clearTimeout(this.#timer);
    this.#socket = null;
    const pause = this.#events.isPressing() ? FIRST_PAUSE : this.#pause;
    this.#timer = setTimeout(() => this.#open(), pause);
    this.#pause = Math.min(this.#pause * 2, LONGEST_PAUSE);
  }
}
