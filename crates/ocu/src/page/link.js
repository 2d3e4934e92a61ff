// The connection to jaus-ocu: opens the WebSocket, opens it again with growing pauses, carries
// requests and their answers, and knows how old the last state is.

import { number, plain } from "./dom.js";

const FIRST_PAUSE = 500;
const LONGEST_PAUSE = 8_000;
/** A state older than this is stale. */
export const STALE = 1_000;
/** A connection that says nothing for so long is given up. */
const DEAD = 5_000;
/** More waiting than this means that the network does not take what we say. */
const BACKLOG = 16_384;
const KEY = "jaus-token";

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
  #token = takeToken();
  /** The vehicle that the page shows: what is asked is meant for it. */
  #vehicle = null;
  /** Resolves to whether the page may connect. */
  #admit;
  /** Number of tries to connect: an earlier one that is still waiting gives up. */
  #tries = 0;
  /** Whether the page may not connect before the user has logged in. */
  #barred = false;
  /** Whether the server's first frame has arrived and, if it requires a token, it has checked ours. */
  settled = false;

  constructor(admit) {
    super();
    this.#admit = admit;
  }

  /** `barred`, `connecting`, `live`, `stale` or `lost`. */
  get condition() {
    if (this.#barred) return "barred";
    if (this.open && this.#stateAt > this.#opened) return this.age > STALE ? "stale" : "live";
    return this.#retryAt || this.#stateAt ? "lost" : "connecting";
  }

  get open() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Milliseconds since the last state; infinite if there was none. */
  get age() {
    return this.#stateAt ? performance.now() - this.#stateAt : Infinity;
  }

  /** Milliseconds until the next try to connect. */
  get retryIn() {
    return Math.max(0, this.#retryAt - performance.now());
  }

  get token() {
    return this.#token;
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

  /** Sends a request; resolves to null when it is done, or to the reason why not. */
  ask(request) {
    if (!this.open) return Promise.resolve("No connection: not sent.");
    const id = ++this.#ids;
    this.#transmit({ vehicle: this.#vehicle, ...request, id });
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.#answer(id, "No answer from the operator's node."), 5_000);
      this.#waiting.set(id, { resolve, timer });
    });
  }

  /** Sends what needs no answer; false if it could not be sent at once. */
  send(request) {
    return this.#transmit({ vehicle: this.#vehicle, ...request });
  }

  /** Sends a setpoint of manual drive, each part from -1 to 1; false if it could not be sent at once. */
  setpoint({ forward, turn }) {
    return this.send({ type: "drive", forward, turn });
  }

  /** Ends manual drive. */
  release() {
    return this.send({ type: "drive_end" });
  }

  /** Uses a token from now on; resolves like `ask`. */
  async useToken(token) {
    const reason = await this.ask({ type: "token", token });
    if (reason === null) {
      this.#token = token;
      sessionStorage.setItem(KEY, token);
    } else if (token === this.#token) {
      this.#token = "";
      sessionStorage.removeItem(KEY);
    }
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
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(`${scheme}//${location.host}/ws`);
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
        this.#emit("hello", frame);
        break;
      case "state":
        this.#stateAt = performance.now();
        this.#pause = FIRST_PAUSE;
        this.#retryAt = 0;
        this.#vehicle = number(frame.vehicle?.subsystem);
        this.#emit("state", frame);
        break;
      case "fleet":
      case "tree":
        this.#emit(frame.type, frame);
        break;
      case "done":
        this.#answer(number(frame.id), null);
        break;
      case "refused": {
        const reason = plain(frame.reason, 300) || "Refused without a reason.";
        if (!this.#answer(number(frame.id), reason)) this.#emit("refused", reason);
        break;
      }
      case "message":
      case "lost":
        this.#emit(frame.type, frame);
    }
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

  #lose() {
    const socket = this.#socket;
    this.#socket = null;
    if (socket && socket.readyState !== WebSocket.CLOSED) socket.close();
    for (const id of [...this.#waiting.keys()]) this.#answer(id, "The connection was lost before an answer arrived.");
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

/** The token of the address's fragment, which is wiped from the address, or of this tab's past. */
function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) {
    sessionStorage.setItem(KEY, given);
    history.replaceState(null, "", location.pathname);
  }
  return given || sessionStorage.getItem(KEY) || "";
}
