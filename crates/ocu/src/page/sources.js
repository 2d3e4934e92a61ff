// The sources of manual drive: keys, mouse or touch, gamepad. Each is a state machine without document
// and without clock: times are arguments, in milliseconds of `performance.now()` and `event.timeStamp`.
//
// A source drives only while it renews itself. After `end` nothing that was held counts:
// it must come to rest and be taken up anew.

/** What each key asks for: ahead and right. */
const KEYS = new Map([
  ["KeyW", [1, 0]], ["ArrowUp", [1, 0]],
  ["KeyS", [-1, 0]], ["ArrowDown", [-1, 0]],
  ["KeyA", [0, -1]], ["ArrowLeft", [0, -1]],
  ["KeyD", [0, 1]], ["ArrowRight", [0, 1]],
]);
/** How much a key adds with each setpoint, so that a touch of it is a touch. */
const KEY_STEP = 0.2;
/** The first repeat comes so long after the press at the latest: systems wait 0.25 to 0.66 s. */
const FIRST_REPEAT = 700;
/** The next repeat comes so long after the one before at the latest: systems repeat 3 to 40 times a second. The way
 * to the motor has the rest of half a second. */
const NEXT_REPEAT = 400;

/** Keys: alive by the system's own repetition. */
export class KeySource {
  name = "Keys";
  #held = new Set();
  /** Keys that were held at an end, with the time of their last sign: they may still be down. */
  #doubtful = new Map();
  /** When the last proof expires. */
  #until = 0;
  /** Whether the system repeats keys, as far as the page has seen. */
  #hasRepeats = false;
  #reached = [0, 0];

  /** Whether a key drives. */
  static drives(code) {
    return KEYS.has(code);
  }

  get held() {
    return this.#held.size > 0;
  }

  /** A key went down at `time`. Returns whether that is a new act: a press, not a repeat. */
  handleDown(code, repeat, time) {
    if (repeat) {
      this.#hasRepeats = true;
      this.#doubt(code, time);
      // A system repeats only the key that went down last: its repeat speaks for all that are held.
      if (this.#held.has(code)) this.#until = Math.max(this.#until, time + NEXT_REPEAT);
      return false;
    }
    if (!KEYS.has(code)) return false;
    // After a change of focus some systems deliver the repeats of a key that is still down as presses.
    // A key that has been silent for longer than a repeat takes was let go.
    if (time - (this.#doubtful.get(code) ?? -Infinity) < FIRST_REPEAT) {
      this.#doubt(code, time);
      return false;
    }
    this.#doubtful.delete(code);
    this.#held.add(code);
    this.#until = time + FIRST_REPEAT;
    return true;
  }

  /** A key was let go. */
  handleUp(code, time) {
    this.#doubtful.delete(code);
    // If it was the key that repeats, no system goes on with another one.
    if (this.#held.delete(code)) this.#until = Math.min(this.#until, time + NEXT_REPEAT);
    if (!this.held) this.#reached = [0, 0];
  }

  /** Keys can reach the page again: one that is still down repeats from now on. */
  handleFocus(time) {
    for (const code of this.#doubtful.keys()) this.#doubt(code, time);
  }

  /** When what is held proves nothing any more, unless there is a new proof before. */
  get expiry() {
    return this.#until;
  }

  /** Why the keys that are held prove nothing any more; empty if they do. */
  expired(now) {
    if (now < this.#until) return "";
    if (this.#hasRepeats) return "no key repeats any more: press again";
    return "this system sends no key repeats, so keys cannot drive: use the stick or a gamepad";
  }

  /** The setpoint to send now: towards more in steps, towards less at once. */
  step() {
    const target = [0, 0];
    for (const code of this.#held) KEYS.get(code).forEach((value, axis) => (target[axis] += value));
    this.#reached = this.#reached.map((value, axis) => {
      const wanted = Math.sign(target[axis]);
      if (wanted === 0 || Math.sign(value) === -wanted) return wanted * KEY_STEP;
      return wanted * Math.min(1, Math.abs(value) + KEY_STEP);
    });
    return this.#reached;
  }

  end(time) {
    for (const code of this.#held) this.#doubtful.set(code, time);
    this.#held.clear();
    this.#reached = [0, 0];
  }

  #doubt(code, time) {
    if (this.#doubtful.has(code)) this.#doubtful.set(code, time);
  }
}

/** How far the pointer moves for all of the speed limit, in CSS pixels. */
const REACH = 60;
/** A little way from the middle is still the middle. */
const QUIET = 0.08;

/** A mouse or a finger: alive while the browser holds its capture, for which it sends no events. */
export class PointerSource {
  #id = null;
  #origin = [0, 0];
  #vector = [0, 0];

  /** `name` is what the page calls it. */
  constructor(name) {
    this.name = name;
  }

  /** The pointer that is held, or null. */
  get id() {
    return this.#id;
  }

  get held() {
    return this.#id !== null;
  }

  /** A pointer went down. Returns whether that is a new act. Where it went down is the stick's centre. */
  handleDown({ id, isPrimary, x, y }) {
    if (this.held || !isPrimary) return false;
    [this.#id, this.#origin, this.#vector] = [id, [x, y], [0, 0]];
    return true;
  }

  /** It moved. Without a button that is down, its release got lost. */
  handleMove({ id, buttons, x, y }) {
    if (id !== this.#id) return;
    if (buttons === 0) return this.handleUp(id);
    const [right, down] = [(x - this.#origin[0]) / REACH, (y - this.#origin[1]) / REACH];
    const far = Math.max(1, Math.hypot(right, down));
    this.#vector = [quiet(-down / far), quiet(right / far)];
  }

  /** It was let go, cancelled, or lost its capture. */
  handleUp(id) {
    if (id === this.#id) this.end();
  }

  /** The capture of a pointer does not expire: the browser ends it. */
  get expiry() {
    return Infinity;
  }

  /** Why the pointer proves nothing any more; `captured` is the pointer whose capture the browser holds. */
  expired(_now, captured) {
    return captured === this.#id ? "" : "the pointer was lost";
  }

  step() {
    return this.#vector;
  }

  end() {
    [this.#id, this.#vector] = [null, [0, 0]];
  }
}

const quiet = (value) => (Math.abs(value) < QUIET ? 0 : value);

const SHOULDERS = [4, 5, 6, 7];
/** Worn sticks do not rest in the middle. */
const DEAD_ZONE = 0.14;
/** Gamepads are read with every frame: so long without one, the page is hidden or stuck. */
const UNREAD = 300;
/**
 * A gamepad says something new so often at least. Chromium dates a pad on Linux and macOS when the pad has
 * sent something, on Android and Windows each time that it reads it. So a pad out of range whose last word
 * was "shoulder down" is noticed on the former here, and on the latter when the system drops it. The price
 * is that a pad that reports changes alone, held quite still, stops: the operator moves the stick a little.
 */
const UNCHANGED = 400;

/** Gamepads: alive by readings whose time stamp changes. The left stick drives while a shoulder button is held. */
export class GamepadSource {
  name = "Gamepad";
  /** Index of the gamepad that is held, or null. */
  #index = null;
  /** Gamepads that have been seen with their shoulder buttons up since the last end. */
  #rested = new Set();
  #vector = [0, 0];
  #timestamp = 0;
  #changedAt = 0;
  #readAt = 0;

  get held() {
    return this.#index !== null;
  }

  /** When the gamepad that is held has last sent something. */
  get timestamp() {
    return this.#timestamp;
  }

  /** The gamepads as read at `time`. Returns whether there is a new act: a shoulder button was pressed. */
  handlePads(pads, time) {
    // What was pressed while the page stood still may be released since.
    if (this.#readAt + UNREAD <= time) this.#rested.clear();
    this.#readAt = time;
    const present = pads.filter((pad) => pad?.connected);
    const own = present.find((pad) => pad.index === this.#index);
    if (!own || !isHeld(own)) this.#drop();
    for (const index of this.#rested) {
      if (!present.some((pad) => pad.index === index)) this.#rested.delete(index);
    }
    const pressed = present.find((pad) => isHeld(pad) && this.#rested.has(pad.index));
    for (const pad of present) isHeld(pad) ? this.#rested.delete(pad.index) : this.#rested.add(pad.index);
    if (this.held) {
      this.#read(own, time);
      return false;
    }
    if (!pressed) return false;
    this.#index = pressed.index;
    this.#changedAt = time;
    this.#read(pressed, time);
    return true;
  }

  get expiry() {
    return Math.min(this.#readAt + UNREAD, this.#changedAt + UNCHANGED);
  }

  expired(now) {
    if (now < this.expiry) return "";
    return this.#readAt + UNREAD <= now ? "the gamepad was not read" : "the gamepad sends nothing new: press again and keep the stick moving";
  }

  step() {
    return this.#vector;
  }

  /** Nothing that is held counts any more, nor what was pressed since the last reading. */
  end() {
    this.#drop();
    this.#rested.clear();
  }

  #drop() {
    [this.#index, this.#vector] = [null, [0, 0]];
  }

  #read(pad, time) {
    if (pad.timestamp !== this.#timestamp) this.#changedAt = time;
    this.#timestamp = pad.timestamp;
    this.#vector = [beyond(-pad.axes[1]), beyond(pad.axes[0])];
  }
}

const isHeld = (pad) => SHOULDERS.some((index) => pad.buttons[index]?.pressed);

/** Takes the dead zone out, and starts from zero behind it. */
function beyond(value) {
  const size = Math.abs(value || 0);
  return size < DEAD_ZONE ? 0 : Math.sign(value) * Math.min(1, (size - DEAD_ZONE) / (1 - DEAD_ZONE));
}
