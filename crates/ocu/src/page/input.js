// Who drives: one source at a time, and only while it renews itself. Without document and
// without clock: times are arguments, in milliseconds of `performance.now()`; `time` is when something
// happened (`event.timeStamp`), `now` is when the page learned of it.

import { GamepadSource, KeySource, PointerSource } from "./sources.js";

/** After a pause of the page of this length, in milliseconds, nobody knows what was let go meanwhile. */
const LATE = 300;

/** How a notice of the end of a drive begins. */
export const ENDED = "Driving ended: ";

export class Input {
  #keys = new KeySource();
  #mouse = new PointerSource("Mouse");
  #touch = new PointerSource("Touch");
  #gamepad = new GamepadSource();
  #sources = [this.#keys, this.#mouse, this.#touch, this.#gamepad];
  /** The source that drives. */
  #owner = null;
  #polledAt = 0;
  #obstacle = "No reports from the vehicle yet.";
  #ending = "";
  #notice = "";

  /** The name of the source that drives, or null. */
  get owner() {
    return this.#owner?.name ?? null;
  }

  /** What ended the last drive, if the operator did not simply let go; empty otherwise. */
  get ending() {
    return this.#ending;
  }

  /** The pointer that drives, or null. */
  get pointer() {
    return this.#mouse.id ?? this.#touch.id;
  }

  /** When the proof of what drives expires; infinite if nothing drives, or if its proof does not. */
  get expiry() {
    return this.#owner?.expiry ?? Infinity;
  }

  /** Something that the operator has to be told, once; empty if there is nothing. */
  takeNotice() {
    const notice = this.#notice;
    this.#notice = "";
    return notice;
  }

  /** Nothing may drive as long as there is an obstacle; empty if there is none. */
  hinder(obstacle, now) {
    this.#obstacle = obstacle;
    if (obstacle && this.#owner) this.end(obstacle, now);
  }

  /** An event after which nothing that is held counts. */
  end(reason, now) {
    if (this.#owner) this.#ending = reason;
    this.#owner = null;
    for (const source of this.#sources) source.end(now);
  }

  handleKeyDown({ code, repeat }, time, now) {
    const at = Math.min(time, now);
    if (this.#keys.handleDown(code, repeat, at)) this.#take(this.#keys, at, now);
    else if (!repeat && KeySource.drives(code)) this.#notice = "Let go of the key and press it again.";
  }

  handleKeyUp(code, time, now) {
    this.#keys.handleUp(code, Math.min(time, now));
    this.#settle();
  }

  /** The page can be reached by keys again. */
  handleFocus(now) {
    this.#keys.handleFocus(now);
  }

  /** A pointer went down on the stick: `isMouse`, `id`, `isPrimary`, `x` and `y` in CSS pixels. */
  handlePointerDown(pointer, time, now) {
    if (this.pointer !== null) return this.#refuse("two pointers on the stick", now);
    const source = pointer.isMouse ? this.#mouse : this.#touch;
    if (source.handleDown(pointer)) this.#take(source, Math.min(time, now), now);
    else this.#notice = "Lift the other finger first.";
  }

  handlePointerMove(pointer) {
    for (const source of [this.#mouse, this.#touch]) source.handleMove(pointer);
    this.#settle();
  }

  /** A pointer was let go, cancelled, or lost its capture. */
  handlePointerUp(id) {
    for (const source of [this.#mouse, this.#touch]) source.handleUp(id);
    this.#settle();
  }

  /** Gamepads as the browser lists them. */
  handlePads(pads, now) {
    const isNew = this.#gamepad.handlePads(pads, now);
    this.#settle();
    if (isNew) this.#take(this.#gamepad, Math.min(this.#gamepad.timestamp, now), now);
  }

  /**
   * The setpoint to send now: its source, and ahead and right from -1 to 1; null if nothing drives any more.
   * `captured` is the pointer whose capture the browser holds.
   */
  poll(now, captured) {
    if (!this.#owner) return null;
    const late = now - this.#polledAt;
    const reason = late > LATE ? `the page stood still for ${(late / 1000).toFixed(1)} s` : this.#owner.expired(now, captured);
    if (reason) {
      this.#refuse(reason, now);
      return null;
    }
    this.#polledAt = now;
    return { source: this.#owner.name, vector: this.#owner.step() };
  }

  /** A source was taken up: it drives, if it may and nothing else does. */
  #take(source, time, now) {
    if (this.#owner === source) return;
    if (this.#owner) return this.#refuse(`${this.#owner.name} and ${source.name} at once: take up one of them`, now);
    if (this.#obstacle) {
      source.end(now);
      this.#notice = this.#obstacle;
      return;
    }
    // What the page learns of so late may be let go already.
    if (now - time > LATE) {
      source.end(now);
      this.#notice = `The page stood still for ${((now - time) / 1000).toFixed(1)} s: press again.`;
      return;
    }
    [this.#owner, this.#polledAt, this.#ending, this.#notice] = [source, now, "", ""];
  }

  #refuse(reason, now) {
    if (this.#owner) this.#notice = `${ENDED}${reason}.`;
    this.end(reason, now);
  }

  /** The source that drives may have been let go. */
  #settle() {
    if (this.#owner && !this.#owner.held) [this.#owner, this.#ending] = [null, ""];
  }
}
