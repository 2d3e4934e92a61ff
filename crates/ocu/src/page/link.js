// The connection to jaus-ocu: opens the WebSocket, opens it again with growing pauses, carries
// setpoints, requests and their answers, and knows how old the last state is.

import { changed } from "./changes.js";
import { number, plain } from "./dom.js";
import { Flow } from "./flow.js";

const FIRST_PAUSE = 500;
const LONGEST_PAUSE = 4_000;
/** A state older than this is stale. */
export const STALE = 1_000;
/** A connection that says nothing for so long is given up. */
const DEAD = 10_000;
/** More waiting than this means that the network does not take what we say. */
const BACKLOG = 16_384;
/** A state is not waited for to be drawn longer than this. */
const DRAWN = 500;
/** Answers of this page itself: the station has not spoken. */
const UNSENT = "No connection: not sent.";
const UNANSWERED = "No answer from the operator's node.";
const LOST = "The connection was lost before an answer arrived.";
const VEHICLE = "jaus-vehicle";

export class Link extends EventTarget {
  #socket = null;
  #pause = FIRST_PAUSE;
  #retryAt = 0;
  #retryTimer = 0;
  #opened = 0;
  #receivedAt = 0;
  #stateAt = 0;
  #ids = 0;
  #waiting = new Map();
  /** What the page shows to the station. */
  #pass;
  /** The vehicle that the page shows: what is asked is meant for it. */
  #vehicle = number(Number(sessionStorage.getItem(VEHICLE) ?? NaN));
  /** The number of this page at the station; null before the first connection. */
  #page = null;
  /** What the station has told this page alone: it shows that to replace its connection. */
  #secret = "";
  #quality = null;
  /** The last state of this connection. Each says what has changed. */
  #state = null;
  #flow = new Flow((frame) => this.#transmit(frame));
  /** Resolves to whether the page may connect. */
  #admit;
  /** Number of tries to connect: an earlier one that is still waiting gives up. */
  #tries = 0;
  /** Whether the page may not connect before the user has logged in. */
  #barred = false;
  /** How often in a row the other side did not prove to be the station: it may have restarted meanwhile. */
  #doubts = 0;
  /** Whether the server's first frame has arrived and, if it requires a token, it has checked ours. */
  settled = false;

  constructor(admit, pass) {
    super();
    this.#admit = admit;
    this.#pass = pass;
  }

  /** `barred`, `connecting`, `live`, `stale` or `lost`. */
  get condition() {
    if (this.#barred) return "barred";
    if (this.open && this.#stateAt > this.#opened) return this.age > STALE || !this.#returns ? "stale" : "live";
    return this.#retryAt || this.#stateAt ? "lost" : "connecting";
  }

  get open() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Milliseconds since the last state; infinite if there was none. */
  get age() {
    return this.#stateAt ? performance.now() - this.#stateAt : Infinity;
  }

  /** The subsystem number of the vehicle that the page shows; null if there is none. */
  get vehicle() {
    return this.#vehicle;
  }

  /** The number of this page at the station; null before the first connection. */
  get page() {
    return this.#page;
  }

  /** What the station has measured: round trips in milliseconds and losses in percent of the hop from
   * page to station and of the one from station to vehicle, null if unknown, and whether the way back to
   * the station works. Null before the first measurement. */
  get quality() {
    return this.#quality;
  }

  /** Whether the station receives what this page says, early enough to drive by. */
  get #returns() {
    const { wayBack, roundTripMs } = this.#quality ?? { wayBack: true };
    return wayBack && (roundTripMs ?? 0) <= STALE;
  }

  /** Milliseconds until the next try to connect. */
  get retryIn() {
    return Math.max(0, this.#retryAt - performance.now());
  }

  /** The token or what stands for it. */
  get token() {
    return this.#pass.shown;
  }

  /** Opens a WebSocket. Its subprotocols show the token, so that the station takes the page for one of those that may
   * drive from the start, and the query asks the station to prove that it is the one; the proof is awaited in `answer`. */
  socketTo(path, query = new URLSearchParams()) {
    const { shown, nonce, answer } = this.#pass;
    if (nonce) query.set("nonce", nonce);
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const protocols = shown ? ["jaus.4", `token.${shown}`] : ["jaus.4"];
    return Object.assign(new WebSocket(`${scheme}//${location.host}${path}?${query}`, protocols), { answer });
  }

  start() {
    setInterval(() => this.#watch(), 500);
    addEventListener("online", () => this.#hurry());
    document.addEventListener("visibilitychange", () => document.hidden || this.#hurry());
    this.#connect();
  }

  /** Connects anew, as another user. */
  restart() {
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
    this.#emit("close", null);
    this.#hurry();
  }

  /** Sends a request; resolves to null when it is done, to what was asked for, or to the reason why not. */
  ask(request) {
    if (!this.open) return Promise.resolve(UNSENT);
    const id = ++this.#ids;
    this.#transmit({ vehicle: this.#vehicle, ...request, id });
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.#answer(id, UNANSWERED), 5_000);
      this.#waiting.set(id, { resolve, timer });
    });
  }

  /** Sends what needs no answer; false if it could not be sent at once. */
  send(request) {
    return this.#transmit({ vehicle: this.#vehicle, ...request });
  }

  /** Drives the vehicle, each axis from -1 to 1. Repeated every 100 ms while something is held. The
   * newest setpoint replaces one that waits; false if the station cannot be reached. */
  setpoint(push) {
    return this.open && this.#flow.setpoint(push);
  }

  /** Ends driving. */
  release() {
    this.#flow.release();
  }

  /** Uses a token from now on; resolves like `ask`. */
  async useToken(token) {
    if (!(await this.#pass.use(token))) return "it is no token of a station";
    if (!this.open) {
      this.#doubts = 1;
      this.restart();
      return null;
    }
    const reason = await this.ask({ type: "token", token: this.token });
    // The station has yet to prove that it is the one.
    if (reason === null && this.#pass.answer) this.restart();
    else if (reason !== null && ![UNSENT, UNANSWERED, LOST].includes(reason)) await this.#pass.forget();
    return reason;
  }

  #transmit(request) {
    if (!this.open) return false;
    if (this.#socket.bufferedAmount > BACKLOG) {
      // Commands that arrive late are worse than none.
      this.#lose();
      return false;
    }
    this.#socket.send(JSON.stringify(request));
    return true;
  }

  async #connect() {
    clearTimeout(this.#retryTimer);
    const number = ++this.#tries;
    try {
      this.#barred = !(await this.#admit());
    } catch {
      if (number !== this.#tries) return;
      this.#barred = false;
      return this.#lose();
    }
    if (number !== this.#tries) return;
    if (this.#barred) return this.#emit("barred", null);
    const query = new URLSearchParams();
    if (this.#vehicle !== null) query.set("vehicle", this.#vehicle);
    // The station may not have noticed yet that the connection before is gone.
    if (this.#page !== null) {
      query.set("replaces", this.#page);
      query.set("secret", this.#secret);
    }
    const socket = this.socketTo("/ws", query);
    this.#socket = socket;
    this.#receivedAt = performance.now();
    this.settled = false;
    socket.addEventListener("open", () => {
      this.#opened = this.#receivedAt = performance.now();
    });
    socket.addEventListener("message", (event) => socket === this.#socket && this.#handle(event.data));
    socket.addEventListener("close", () => socket === this.#socket && this.#lose());
  }

  #handle(text) {
    this.#receivedAt = performance.now();
    let frame;
    try {
      frame = JSON.parse(text);
    } catch {
      return;
    }
    if (frame === null || typeof frame !== "object") return;
    switch (frame.type) {
      case "hello":
        if (this.#socket.answer && frame.answer !== this.#socket.answer) return this.#doubt();
        this.#doubts = 0;
        this.#state = null;
        this.#page = number(frame.page);
        this.#secret = plain(frame.secret, 64);
        this.#flow.reset();
        this.#quality = null;
        this.#emit("hello", frame);
        break;
      case "state":
        frame = this.#state = changed(this.#state, frame);
        this.#stateAt = performance.now();
        this.#pause = FIRST_PAUSE;
        this.#retryAt = 0;
        this.#note(number(frame.vehicle?.subsystem));
        this.#emit("state", frame);
        this.#show(number(frame.seq));
        break;
      case "ok":
        this.#flow.confirmed();
        break;
      case "link":
        this.#quality = {
          roundTripMs: number(frame.round_trip_ms),
          vehicleRoundTripMs: number(frame.vehicle_round_trip_ms),
          lossPercent: number(frame.loss_percent),
          vehicleLossPercent: number(frame.vehicle_loss_percent),
          wayBack: frame.way_back === true,
        };
        this.#flow.estimate(this.#quality.roundTripMs);
        break;
      case "fleet":
      case "tree":
        this.#emit(frame.type, frame);
        break;
      case "overlay":
        this.#answer(number(frame.id), frame.overlay ?? null);
        break;
      case "done":
        this.#answer(number(frame.id), null);
        break;
      case "refused": {
        const reason = plain(frame.reason, 300) || "Refused without a reason.";
        if (!this.#answer(number(frame.id), reason)) this.#emit("refused", reason);
        break;
      }
      case "stopped":
      case "message":
      case "lost":
        this.#emit(frame.type, frame);
    }
  }

  /** Confirms a state once it is drawn. */
  #show(seq) {
    // A hidden page draws nothing, but still gets states: an alarm sounds there too.
    if (document.hidden) return this.#flow.received(seq);
    const [socket, arrivedAt] = [this.#socket, performance.now()];
    const drawn = (isShown) => {
      clearTimeout(timer);
      cancelAnimationFrame(frame);
      if (socket !== this.#socket) return;
      isShown ? this.#flow.shown(seq, arrivedAt) : this.#flow.received(seq);
    };
    const timer = setTimeout(() => drawn(false), DRAWN);
    const frame = requestAnimationFrame(() => drawn(true));
  }

  #note(vehicle) {
    if (vehicle === null || vehicle === this.#vehicle) return;
    this.#vehicle = vehicle;
    sessionStorage.setItem(VEHICLE, vehicle);
  }

  #answer(id, reason) {
    const request = this.#waiting.get(id);
    if (!request) return false;
    clearTimeout(request.timer);
    this.#waiting.delete(id);
    request.resolve(reason);
    return true;
  }

  #watch() {
    if (this.#socket && performance.now() - this.#receivedAt > DEAD) this.#lose();
  }

  /** Another program than the station answers, or the station has another token. */
  #doubt() {
    this.#lose();
    if (++this.#doubts === 2) this.#emit("doubt", null);
  }

  #lose() {
    const socket = this.#socket;
    this.#socket = null;
    if (socket && socket.readyState !== WebSocket.CLOSED) socket.close();
    for (const id of [...this.#waiting.keys()]) this.#answer(id, LOST);
    this.#retryAt = performance.now() + this.#pause;
    this.#retryTimer = setTimeout(() => this.#connect(), this.#pause);
    this.#pause = Math.min(this.#pause * 1.7, LONGEST_PAUSE);
    this.#emit("close", null);
  }

  /** The page is visible again, or the network is back: try at once. */
  #hurry() {
    if (this.#socket) return;
    this.#pause = FIRST_PAUSE;
    this.#connect();
  }

  #emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
