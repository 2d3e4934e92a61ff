// Manual drive. Something must be held all the time: a finger on the stick, a key, a shoulder
// button of the gamepad. While it is, the setpoint is repeated every 100 ms; when it is let go, or the
// page is hidden, loses the connection or the control, driving ends at once and does not begin
// again before everything has been let go.

import { get, mark, plain, say, toast } from "./dom.js";
import { DriveEnd } from "./drive_end.js";
import { Gamepads } from "./gamepad.js";

const PERIOD = 100;
/** How much a key adds with each repetition, so that a touch of it is a touch. */
const KEY_STEP = 0.2;
const KEYS = new Map([
  ["KeyW", [1, 0]], ["ArrowUp", [1, 0]],
  ["KeyS", [-1, 0]], ["ArrowDown", [-1, 0]],
  ["KeyA", [0, -1]], ["ArrowLeft", [0, -1]],
  ["KeyD", [0, 1]], ["ArrowRight", [0, 1]],
]);

export class Drive {
  #link;
  #limit = 0.5;
  #stick = null;
  #stickPointer = null;
  #keys = new Set();
  #keyed = [0, 0];
  #gamepads;
  #timer = 0;
  /** Whether all must be let go before driving may begin. */
  #locked = false;
  #obstacle = "No reports from the vehicle yet.";
  #confirmed = null;
  /** Why the station ended driving although nothing was let go. */
  #halt = "";
  #end = new DriveEnd();
  /** Why a driver of the vehicle holds it; empty if none does. */
  #holdReason = "";

  constructor(link, emergency) {
    this.#link = link;
    this.#gamepads = new Gamepads(() => this.#input(), emergency);
    this.#listenStick();
    for (const button of get("limit").querySelectorAll("button")) {
      button.addEventListener("click", () => this.#setLimit(Number(button.dataset.limit)));
    }
    addEventListener("keyup", (event) => this.#keyUp(event.code));
    addEventListener("blur", () => this.release());
    addEventListener("pagehide", () => this.release());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
    this.#render([0, 0], null);
  }

  /** Takes a state; `obstacle` says why the vehicle cannot be driven now, or is empty. */
  update(state, obstacle) {
    this.#obstacle = obstacle;
    this.#confirmed = state?.drive ?? null;
    const ended = this.#end.update(state);
    if (ended) toast("bad", `Driving ended: ${ended}`);
    this.#halt = plain(state?.drive?.reason, 200);
    this.#holdReason = plain(state?.vehicle?.held?.reason, 200);
    mark(get("stick"), "aria-disabled", String(Boolean(obstacle)));
    if (obstacle && this.#timer) this.release();
    if (!this.#timer) this.#render([0, 0], null);
  }

  /** Lets go of everything: driving ends. */
  release() {
    this.#locked = this.#held();
    this.#stop();
  }

  /** A key that went down; true if it drives. */
  keyDown(event) {
    if (!KEYS.has(event.code) || event.ctrlKey || event.altKey || event.metaKey) return false;
    if (!event.repeat) {
      this.#keys.add(event.code);
      this.#input();
    }
    return true;
  }

  #keyUp(code) {
    if (this.#keys.delete(code)) this.#input();
  }

  #held() {
    return this.#stick !== null || this.#keys.size > 0 || this.#gamepads.held;
  }

  /** Something was taken up or let go. */
  #input() {
    if (!this.#held()) {
      this.#locked = false;
      this.#stop();
    } else if (!this.#locked && !this.#timer) {
      this.#start();
    }
  }

  #start() {
    if (this.#obstacle) {
      this.#locked = true;
      toast("warn", this.#obstacle);
      return;
    }
    this.#timer = setInterval(() => this.#tick(), PERIOD);
    this.#tick();
  }

  #stop() {
    this.#keyed = [0, 0];
    if (this.#timer) {
      clearInterval(this.#timer);
      this.#timer = 0;
      this.#link.release();
    }
    this.#render([0, 0], null);
  }

  #tick() {
    const [direction, source] = this.#direction();
    const [forward, turn] = direction.map((value) => Math.round(value * this.#limit * 1000) / 1000);
    if (!this.#link.setpoint({ forward, turn })) {
      this.release();
      return;
    }
    this.#render([forward, turn], source);
  }

  /** Where the operator wants to go, each -1 to 1, and by what. */
  #direction() {
    if (this.#stick) return [this.#stick, "Stick"];
    if (this.#keys.size) {
      const target = [0, 0];
      for (const code of this.#keys) KEYS.get(code).forEach((value, axis) => (target[axis] += value));
      this.#keyed = this.#keyed.map((value, axis) => {
        const wanted = Math.sign(target[axis]);
        // Towards more in steps, towards less at once.
        if (wanted === 0 || Math.sign(value) === -wanted) return wanted * KEY_STEP;
        return wanted * Math.min(1, Math.abs(value) + KEY_STEP);
      });
      return [this.#keyed, "Keys"];
    }
    return [this.#gamepads.axes, "Gamepad"];
  }

  #setLimit(limit) {
    this.#limit = limit;
    for (const button of get("limit").querySelectorAll("button")) {
      mark(button, "aria-pressed", String(Number(button.dataset.limit) === limit));
    }
  }

  #listenStick() {
    const stick = get("stick");
    const move = (event) => {
      const box = stick.getBoundingClientRect();
      const reach = box.width / 2 - 36;
      const x = (event.clientX - box.left - box.width / 2) / reach;
      const y = (event.clientY - box.top - box.height / 2) / reach;
      const far = Math.max(1, Math.hypot(x, y));
      this.#stick = [quiet(-y / far), quiet(x / far)];
    };
    stick.addEventListener("pointerdown", (event) => {
      if (this.#stickPointer !== null || event.button > 0) return;
      event.preventDefault();
      stick.focus({ preventScroll: true });
      stick.setPointerCapture(event.pointerId);
      this.#stickPointer = event.pointerId;
      move(event);
      this.#input();
    });
    stick.addEventListener("pointermove", (event) => event.pointerId === this.#stickPointer && move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      stick.addEventListener(end, (event) => {
        if (event.pointerId !== this.#stickPointer) return;
        this.#stickPointer = this.#stick = null;
        this.#input();
      });
    }
    stick.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  #render([forward, turn], source) {
    const knob = get("stick-knob");
    const reach = get("stick").clientWidth / 2 - 36;
    const scale = reach / this.#limit;
    knob.style.transform = `translate(${turn * scale}px, ${-forward * scale}px)`;
    bar(get("forward-bar"), get("forward-value"), forward);
    bar(get("turn-bar"), get("turn-value"), turn);
    const tag = get("drive-source");
    say(tag, source ?? "Idle");
    mark(tag, "data-on", source ? "yes" : null);
    mark(get("stick"), "data-on", source ? "yes" : null);
    say(get("drive-line"), this.#line(source));
    mark(get("drive-line"), "data-held", source && this.#holdReason ? "yes" : null);
  }

  #line(source) {
    if (source && this.#holdReason) return `Held: ${this.#holdReason}`;
    if (source) return this.#confirmed?.active ? "Driving: commands are being sent" : "Sending";
    if (this.#obstacle) return this.#obstacle;
    return this.#halt ? `Stopped: ${this.#halt}` : "Ready: nothing is sent until you hold something";
  }
}

/** A meter to both sides of its middle. */
function bar(element, output, value) {
  element.style.transform = `scaleX(${value})`;
  const percent = Math.round(value * 100);
  say(output, `${percent < 0 ? "−" : ""}${Math.abs(percent)} %`);
}

/** A little way from the middle is still the middle. */
const quiet = (value) => (Math.abs(value) < 0.08 ? 0 : value);
