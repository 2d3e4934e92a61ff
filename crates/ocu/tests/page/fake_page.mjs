// As much of a browser as the page's input needs, with a clock of its own.

class Target {
  #listeners = new Map();

  addEventListener(type, listener) {
    this.#listeners.set(type, [...(this.#listeners.get(type) ?? []), listener]);
  }

  fire(type, properties = {}) {
    const event = { type, target: this, isTrusted: true, timeStamp: clock.now, preventDefault() {}, getModifierState: () => false, ...properties };
    for (const listener of this.#listeners.get(type) ?? []) listener(event);
    return event;
  }
}

export const clock = { now: 1000 };
export const sheet = { hidden: true };
let mutated = () => {};
/** What the page's observer watches. */
const observed = new Set();

/** Opens or closes the page's dialog. */
export function showSheet(isShown) {
  sheet.hidden = !isShown;
  if (observed.has(sheet)) mutated();
}

export const browser = new Target();
export const stick = Object.assign(new Target(), {
  captured: new Set(),
  focus() {},
  contains: (target) => target === stick,
  setPointerCapture(id) {
    this.captured.add(id);
  },
  hasPointerCapture(id) {
    return this.captured.has(id);
  },
});

const page = Object.assign(new Target(), { hidden: false, querySelectorAll: () => [sheet] });
Object.assign(globalThis, {
  window: browser,
  document: page,
  screen: { orientation: new Target() },
  addEventListener: (type, listener) => browser.addEventListener(type, listener),
  MutationObserver: class {
    constructor(listener) {
      mutated = listener;
    }
    observe(element) {
      observed.add(element);
    }
  },
});
browser.visualViewport = new Target();
Object.defineProperty(globalThis, "performance", { value: { now: () => clock.now }, configurable: true });
