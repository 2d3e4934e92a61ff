// What ended the last drive, told once: to the page that saw it, and not again while it remains the
// station's last word on driving.

import { plain } from "./dom.js";

export class DriveEnd {
  #vehicle = null;
  #reason = "";
  /** Whether the state of the drive before is known: a drive that ended earlier is no news. */
  #known = false;

  /** Takes a state; returns why the drive has ended if that is news, or an empty text. */
  update(state) {
    if (!state) return "";
    const vehicle = state.vehicle?.subsystem ?? null;
    if (vehicle !== this.#vehicle) this.#known = false;
    const reason = plain(state.drive?.reason, 200);
    const isNews = this.#known && reason !== "" && kind(reason) !== kind(this.#reason);
    [this.#vehicle, this.#reason, this.#known] = [vehicle, reason, true];
    return isNews ? reason : "";
  }

  /** Forgets what was seen: the page was not connected for a while. */
  forget() {
    this.#known = false;
  }
}

/** A reason without its numbers, which change while it lasts. */
const kind = (reason) => reason.replace(/\d+([.,]\d+)?/g, "#");
