// Brings what happens to the page to the inputs: keys, pointers on the stick, gamepads, and all events
// after which nothing that was held counts.

import { KeySource } from "./sources.js";

/** A key that opens menus or belongs to the system: its partner's release may never reach the page. */
const MODIFIERS = ["Control", "Alt", "AltGraph", "Meta", "OS"];
const FIELDS = "input, select, textarea";
const DIALOGS = ".sheet";

export class InputEvents {
  #input;
  #stick;
  #changed;

  /** Feeds `input`, and calls `changed` after each event that may begin or end a drive. */
  constructor(input, stick, changed) {
    [this.#input, this.#stick, this.#changed] = [input, stick, changed];
    this.#listenEndings();
    this.#listenStick();
    addEventListener("keyup", (event) => this.#handle((now) => input.handleKeyUp(event.code, event.timeStamp, now)), true);
    addEventListener("focus", () => input.handleFocus(performance.now()));
  }

  /** Whether a dialog is open. */
  get isCovered() {
    return [...document.querySelectorAll(DIALOGS)].some((dialog) => !dialog.hidden);
  }

  /** The pointer that drives, if the browser holds its capture. */
  get captured() {
    const id = this.#input.pointer;
    return id !== null && this.#stick.hasPointerCapture(id) ? id : null;
  }

  /** Takes a key that went down; true if it drives. */
  keyDown(event) {
    const { code, repeat, timeStamp } = event;
    if (!event.isTrusted) return false;
    if (isModified(event)) {
      this.end("a modifier key is down");
      return false;
    }
    this.#handle((now) => this.#input.handleKeyDown({ code, repeat }, timeStamp, now));
    return KeySource.drives(code);
  }

  handlePads(pads) {
    this.#handle((now) => this.#input.handlePads(pads, now));
  }

  /** Nothing that is held counts from now on. */
  end(reason) {
    this.#handle((now) => this.#input.end(reason, now));
  }

  #handle(act) {
    act(performance.now());
    this.#changed();
  }

  #listenEndings() {
    // In the capture phase: no other handler can keep them from here.
    const ends = (target, type, reason) => target?.addEventListener(type, () => this.end(reason), true);
    addEventListener("blur", ({ target }) => target === window && this.end("the window lost the focus"), true);
    ends(window, "pagehide", "the page was left");
    ends(document, "freeze", "the page was frozen");
    ends(window, "resize", "the page changed its size");
    ends(window, "orientationchange", "the screen was turned");
    ends(screen.orientation, "change", "the screen was turned");
    ends(window.visualViewport, "resize", "the page changed its size");
    document.addEventListener("visibilitychange", () => document.hidden && this.end("the page was hidden"), true);
    addEventListener("contextmenu", (event) => this.#handleMenu(event), true);
    for (const type of ["keydown", "keyup"]) {
      addEventListener(type, ({ key }) => MODIFIERS.includes(key) && this.end(`${key} was pressed`), true);
    }
    addEventListener("focusin", ({ target }) => target.matches?.(FIELDS) && this.end("a field took the keys"), true);
    const observer = new MutationObserver(() => this.isCovered && this.end("a dialog opened"));
    for (const dialog of document.querySelectorAll(DIALOGS)) observer.observe(dialog, { attributeFilter: ["hidden"] });
  }

  /** A menu takes keys and pointer. A finger that rests on the stick asks for one too: it gets none and drives on. */
  #handleMenu(event) {
    const isStick = this.#stick.contains(event.target);
    if (isStick) event.preventDefault();
    // Not every browser says which pointer asks.
    const isResting = isStick && this.#input.owner === "Touch" && event.pointerType !== "mouse";
    if (!isResting) this.end("a menu was opened");
  }

  #listenStick() {
    const stick = this.#stick;
    stick.addEventListener("pointerdown", (event) => {
      if (event.button > 0 || !event.isTrusted) return;
      event.preventDefault();
      stick.focus({ preventScroll: true });
      stick.setPointerCapture(event.pointerId);
      this.#handle((now) => this.#input.handlePointerDown(pointer(event), event.timeStamp, now));
    });
    stick.addEventListener("pointermove", (event) => {
      if (event.pointerId === this.#input.pointer) this.#handle(() => this.#input.handlePointerMove(pointer(event)));
    });
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) {
      stick.addEventListener(type, ({ pointerId }) => this.#handle(() => this.#input.handlePointerUp(pointerId)));
    }
  }
}

const isModified = (event) => event.ctrlKey || event.altKey || event.metaKey || event.getModifierState("AltGraph");

const pointer = (event) => ({
  id: event.pointerId,
  isMouse: event.pointerType === "mouse",
  isPrimary: event.isPrimary,
  buttons: event.buttons,
  x: event.clientX,
  y: event.clientY,
});
