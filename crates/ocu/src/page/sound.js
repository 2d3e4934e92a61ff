// Sound and vibration for alarms. Browsers allow sound only after the operator has touched the page
// or pressed a key. Muting is kept on this device.

import { get, mark, toast } from "./dom.js";
import { Alarms } from "./alarms.js";

const KEY = "jaus-muted";
/** Tones of an alarm: frequency in hertz, and length in seconds. */
const TONES = {
  runaway: [[988, 0.16], [659, 0.16], [988, 0.16], [659, 0.16]],
  bad: [[880, 0.18], [587, 0.28]],
  warn: [[659, 0.14]],
};
/** Vibration: on, off, on, … in milliseconds. */
const BUZZ = { runaway: [300, 80, 300, 80, 300], bad: [200, 80, 200], warn: [90] };
/** A runaway sounds again after this time, in milliseconds, while it lasts. */
const AGAIN = 1_500;
const VOLUME = 0.22;

export class Sound {
  #alarms = new Alarms();
  #context = null;
  #muted = stored();
  #playedAt = -Infinity;

  constructor() {
    const unlock = () => this.#unlock();
    for (const gesture of ["pointerdown", "keydown"]) addEventListener(gesture, unlock, { capture: true });
    get("sound-button").addEventListener("click", () => this.#setMuted(!this.#muted));
    this.#render();
  }

  /** Takes a state with whether it is live, the list of vehicles and the number of this page. */
  update(state, live, vehicles, page) {
    const begun = this.#alarms.update(state, live, vehicles, page);
    if (begun) this.#play(begun);
    else if (this.#alarms.runaway && performance.now() - this.#playedAt > AGAIN) this.#play("runaway");
  }

  #unlock() {
    try {
      this.#context ??= new AudioContext();
      if (this.#context.state === "suspended") this.#context.resume();
    } catch {
      // Without sound there is the picture.
    }
    this.#render();
  }

  #play(level) {
    this.#playedAt = performance.now();
    document.body.dataset.alarm = level;
    if (this.#muted) return;
    if (navigator.userActivation?.hasBeenActive !== false) navigator.vibrate?.(BUZZ[level]);
    if (this.#context?.state !== "running") return;
    let at = this.#context.currentTime + 0.02;
    for (const [frequency, length] of TONES[level]) {
      this.#tone(frequency, at, length);
      at += length + 0.04;
    }
  }

  #tone(frequency, at, length) {
    const [oscillator, gain] = [this.#context.createOscillator(), this.#context.createGain()];
    oscillator.type = "square";
    oscillator.frequency.value = frequency;
    // Ramps instead of edges, which click.
    gain.gain.setValueAtTime(0, at);
    gain.gain.linearRampToValueAtTime(VOLUME, at + 0.01);
    gain.gain.setValueAtTime(VOLUME, at + length - 0.03);
    gain.gain.linearRampToValueAtTime(0, at + length);
    oscillator.connect(gain).connect(this.#context.destination);
    oscillator.start(at);
    oscillator.stop(at + length);
  }

  #setMuted(muted) {
    this.#muted = muted;
    try {
      localStorage.setItem(KEY, muted ? "yes" : "no");
    } catch {
      // Kept for this page only.
    }
    this.#render();
    toast("info", muted ? "Alarms are muted on this device." : "Alarms sound on this device.");
    if (!muted) this.#play("warn");
  }

  #render() {
    const button = get("sound-button");
    const words = this.#muted ? "Alarms are muted: turn the sound on" : "Mute the alarms";
    mark(button, "aria-label", words);
    mark(button, "title", words);
    mark(button, "aria-pressed", String(this.#muted));
  }
}

function stored() {
  try {
    return localStorage.getItem(KEY) === "yes";
  } catch {
    return false;
  }
}
