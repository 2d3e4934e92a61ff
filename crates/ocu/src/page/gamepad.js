// Reads the gamepads. Browsers have no events for them, so they are read with every frame while one is
// there. B (or the circle) is emergency stop.

import { toast } from "./dom.js";

const EMERGENCY = 1;

export class Gamepads {
  #isEmergency = false;
  #isReading = false;
  #read;
  #emergency;

  /** Calls `read` with the gamepads of each frame, and `emergency` for B. */
  constructor(read, emergency) {
    this.#read = read;
    this.#emergency = emergency;
    addEventListener("gamepadconnected", () => {
      toast("info", "Gamepad connected: hold a shoulder button to drive.");
      if (!this.#isReading) requestAnimationFrame(() => this.#look());
      this.#isReading = true;
    });
    addEventListener("gamepaddisconnected", () => toast("warn", "Gamepad disconnected."));
  }

  #look() {
    const pads = [...navigator.getGamepads()].filter((pad) => pad?.connected);
    const isEmergency = pads.some((pad) => pad.buttons[EMERGENCY]?.pressed);
    if (isEmergency && !this.#isEmergency) this.#emergency();
    this.#isEmergency = isEmergency;
    this.#read(pads);
    this.#isReading = pads.length > 0;
    if (this.#isReading) requestAnimationFrame(() => this.#look());
  }
}
