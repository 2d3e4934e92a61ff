// Gamepads: the left stick drives while a shoulder button is held; B (or the circle) is emergency
// stop. Browsers have no events for them, so they are looked at with every frame while one is there.

import { toast } from "./dom.js";

const SHOULDERS = [4, 5, 6, 7];
const EMERGENCY = 1;
/** Worn sticks do not rest in the middle. */
const DEAD_ZONE = 0.14;

export class Gamepads {
  #held = false;
  #axes = [0, 0];
  #emergencyHeld = false;
  #watching = false;
  #changed;
  #emergency;

  /** Calls `changed` when a shoulder button goes down or up, and `emergency` for B. */
  constructor(changed, emergency) {
    this.#changed = changed;
    this.#emergency = emergency;
    addEventListener("gamepadconnected", () => {
      toast("info", "Gamepad connected: hold a shoulder button to drive.");
      if (!this.#watching) requestAnimationFrame(() => this.#look());
      this.#watching = true;
    });
    addEventListener("gamepaddisconnected", () => toast("warn", "Gamepad disconnected."));
  }

  /** Whether a shoulder button is down. */
  get held() {
    return this.#held;
  }

  /** Ahead and right, each -1 to 1. */
  get axes() {
    return this.#axes;
  }

  #look() {
    const pads = [...navigator.getGamepads()].filter((pad) => pad?.connected);
    const down = (pad, index) => Boolean(pad.buttons[index]?.pressed);
    const driving = pads.find((pad) => SHOULDERS.some((index) => down(pad, index)));
    if (driving) this.#axes = [live(-driving.axes[1]), live(driving.axes[0])];
    const emergency = pads.some((pad) => down(pad, EMERGENCY));
    if (emergency && !this.#emergencyHeld) this.#emergency();
    this.#emergencyHeld = emergency;
    if (Boolean(driving) !== this.#held) {
      this.#held = Boolean(driving);
      this.#changed();
    }
    this.#watching = pads.length > 0;
    if (this.#watching) requestAnimationFrame(() => this.#look());
  }
}

/** Takes the dead zone out, and starts from zero behind it. */
function live(value) {
  const size = Math.abs(value || 0);
  return size < DEAD_ZONE ? 0 : Math.sign(value) * Math.min(1, (size - DEAD_ZONE) / (1 - DEAD_ZONE));
}
