// Manual drive: shows what drives, and sends its setpoint every 100 ms for as long as input.js says that
// somebody holds it.

import { get, mark, plain, say, toast } from "./dom.js";
import { DriveEnd } from "./drive_end.js";
import { Gamepads } from "./gamepad.js";
import { ENDED, Input } from "./input.js";
import { InputEvents } from "./input_events.js";

const PERIOD = 100;
/** Within this time, in milliseconds, two ends are those of one drive. */
const ONCE = 2_000;
/** Distance of the knob's middle from the stick's rim, in CSS pixels. */
const RIM = 36;

export class Drive {
  #link;
  #limit = 0.5;
  #input = new Input();
  #events;
  #timer = 0;
  /** So long the hand counts by the last setpoint. */
  #toldExpiry = Infinity;
  #obstacle = "No reports from the vehicle yet.";
  #isShown = false;
  #confirmed = null;
  /** Why the station ended driving although nothing was let go. */
  #halt = "";
  #end = new DriveEnd();
  /** When the end of a drive was told last. */
  #toldAt = -Infinity;
  /** Why a driver of the vehicle holds it; empty if none does. */
  #holdReason = "";

  constructor(link, emergency) {
    this.#link = link;
    this.#events = new InputEvents(this.#input, get("stick"), () => this.#handleInput());
    new Gamepads((pads) => this.#events.handlePads(pads), () => {
      this.end("emergency stop");
      emergency();
    });
    for (const button of get("limit").querySelectorAll("button")) {
      button.addEventListener("click", () => this.#setLimit(Number(button.dataset.limit)));
    }
    this.#render([0, 0], null);
  }

  /** Takes a state; `obstacle` says why the vehicle cannot be driven now, or is empty. */
  update(state, obstacle) {
    this.#obstacle = obstacle;
    this.#confirmed = state?.drive ?? null;
    const ended = this.#end.update(state);
    if (ended) this.#tellEnd("bad", `${ENDED}${ended}`);
    this.#halt = plain(state?.drive?.reason, 200);
    this.#holdReason = plain(state?.vehicle?.held?.reason, 200);
    mark(get("stick"), "aria-disabled", String(Boolean(obstacle)));
    this.#hinder();
    if (!this.#timer) this.#render([0, 0], null);
  }

  /** Says whether the Drive view is shown: nothing drives in another one. */
  show(isShown) {
    if (!isShown) this.#events.end("the Drive view was left");
    this.#isShown = isShown;
    this.#hinder();
  }

  /** Ends driving: what is held has to be let go and taken up again. */
  end(reason) {
    this.#events.end(reason);
  }

  /** A key that went down; true if it drives. */
  keyDown(event) {
    return this.#isShown && this.#events.keyDown(event);
  }

  /** Page and station may both notice what ended a drive: the first one says so. */
  #tellEnd(level, text) {
    const now = performance.now();
    if (now - this.#toldAt > ONCE) toast(level, text);
    this.#toldAt = now;
  }

  #hinder() {
    const obstacle = this.#events.isCovered ? "Close the dialog first." : this.#isShown ? this.#obstacle : "Open the Drive view to drive.";
    this.#input.hinder(obstacle, performance.now());
    this.#handleInput();
  }

  /** Something was taken up, or a drive may be over. */
  #handleInput() {
    if (this.#input.owner && (!this.#timer || this.#isRenewed())) {
      this.#tick();
    } else if (!this.#input.owner && this.#timer) {
      clearTimeout(this.#timer);
      this.#timer = 0;
      this.#link.release();
      this.#render([0, 0], null);
    }
    const notice = this.#input.takeNotice();
    if (notice.startsWith(ENDED)) this.#tellEnd("warn", notice);
    else if (notice) toast("warn", notice);
  }

  /** Whether the hand has given a sign, and the one of which the station knows expires before the next setpoint. */
  #isRenewed() {
    return this.#toldExpiry - performance.now() < PERIOD && this.#input.expiry > this.#toldExpiry;
  }

  #tick() {
    clearTimeout(this.#timer);
    const now = performance.now();
    const setpoint = this.#input.poll(now, this.#events.captured);
    // A proof that expires ends the drive then, not with the next setpoint. A timer may be early by a fraction.
    this.#timer = setTimeout(() => this.#tick(), Math.min(PERIOD, this.#input.expiry - now + 1));
    if (!setpoint) return this.#handleInput();
    const [forward, turn] = setpoint.vector.map((value) => Math.round(value * this.#limit * 1000) / 1000);
    this.#toldExpiry = this.#input.expiry;
    if (!this.#link.setpoint({ forward, turn, expiry: this.#toldExpiry })) return this.end("the connection takes no commands");
    this.#render([forward, turn], setpoint.source);
  }

  #setLimit(limit) {
    this.#limit = limit;
    for (const button of get("limit").querySelectorAll("button")) {
      mark(button, "aria-pressed", String(Number(button.dataset.limit) === limit));
    }
  }

  #render([forward, turn], source) {
    const knob = get("stick-knob");
    const scale = (get("stick").clientWidth / 2 - RIM) / this.#limit;
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
    if (!this.#isShown) return "Keys and gamepad are off: touch here to use them";
    const ending = this.#input.ending || this.#halt;
    return ending ? `Stopped: ${ending}` : "Ready: nothing is sent until you hold something";
  }
}

/** A meter to both sides of its middle. */
function bar(element, output, value) {
  element.style.transform = `scaleX(${value})`;
  const percent = Math.round(value * 100);
  say(output, `${percent < 0 ? "−" : ""}${Math.abs(percent)} %`);
}
