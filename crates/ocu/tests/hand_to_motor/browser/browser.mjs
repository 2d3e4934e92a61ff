// A browser for the operator's page, in lock-step with the virtual clock of a simulation: it runs the
// page's own modules, each page in a context of its own, and does nothing by itself. Every line on
// standard input is an instruction for one page; the answer is a line with what the page did.
//
// {"page": 1, "now": 12.5, "open": true}         loads the page anew
// {"page": 1, "now": 12.5, "events": [[11.5, "key", "keydown", "KeyW", false], …]}
// → {"out": [["connect", 3, "/ws?vehicle=101", ["jaus.4"]], ["send", 3, "…"], ["close", 3]], "next": 60.2, "view": {…}}
//
// `now` is `performance.now()` of the page's host, and an event begins with when it happened; `next` is
// when the page has to be called again. After a pause of the page ("thaws": "timers" or "events") it learns
// of everything at once, the one or the other first.

import { readFileSync, readSync, writeSync } from "node:fs";
import { StringDecoder } from "node:string_decoder";
import { fileURLToPath } from "node:url";
import vm from "node:vm";

import { Document, Element, Event, Target } from "./document.mjs";

const PAGE = new URL("../../../src/page/", import.meta.url);
/** What the operators have got with the page's address. */
const TOKEN = process.argv[2];
/** A browser draws so often, in milliseconds. */
const FRAME = 1000 / 60;

const read = (file) => readFileSync(new URL(file, PAGE), "utf8");
const HTML = read("index.html");
/** The text of each module, and its compiled code. */
const sources = new Map();

class Storage {
  #items = new Map();
  getItem(key) {
    return this.#items.get(key) ?? null;
  }
  setItem(key, value) {
    this.#items.set(key, String(value));
  }
  removeItem(key) {
    this.#items.delete(key);
  }
}

/** A tab: its storage outlives the pages that are loaded in it. */
class Tab {
  session = new Storage();
  local = new Storage();
  page = null;
  now = 0;
}

class Page {
  #tab;
  #out = [];
  #timers = new Map();
  #lastTimer = 0;
  #sockets = new Map();
  #window = new Target();
  #document = new Document(HTML);
  #screen = new Target();
  #viewport = new Target();
  #pads = [];
  /** When the event happened that the page learns of now. */
  #at = 0;

  constructor(tab) {
    this.#tab = tab;
    this.#document.parent = this.#window;
  }

  async load() {
    const context = vm.createContext(this.#globals());
    vm.runInContext("globalThis.window = globalThis", context);
    // The page compares an event's target with `window`.
    this.#window.self = vm.runInContext("globalThis", context);
    const modules = new Map();
    const link = (name) => {
      const file = name.replace("./", "");
      if (!modules.has(file)) modules.set(file, compile(file, context));
      return modules.get(file);
    };
    const main = link("main.js");
    await main.link(link);
    await main.evaluate();
  }

  #globals() {
    const tab = this.#tab;
    const window = this.#window;
    const sockets = this.#sockets;
    const out = this.#out;
    const document = this.#document;
    const at = (delay, action, repeat) => this.#start(delay, action, repeat);
    class WebSocket extends Target {
      static OPEN = 1;
      static CLOSED = 3;
      static #last = 0;
      readyState = 0;
      bufferedAmount = 0;
      constructor(url, protocols) {
        super();
        this.number = ++WebSocket.#last;
        sockets.set(this.number, this);
        out.push(["connect", this.number, new URL(url).pathname + new URL(url).search, [...protocols]]);
      }
      send(data) {
        if (this.readyState === 1) out.push(["send", this.number, data]);
      }
      close() {
        if (this.readyState >= 2) return;
        this.readyState = 2;
        out.push(["close", this.number]);
      }
    }
    class CustomEvent extends Event {
      constructor(type, { detail }) {
        super(type, { detail });
      }
    }
    class MutationObserver {
      #notify;
      constructor(notify) {
        this.#notify = notify;
      }
      observe(target, { attributeFilter }) {
        document.observe({ target, attributes: attributeFilter, notify: this.#notify });
      }
    }
    class ResizeObserver {
      observe() {}
    }
    return {
      document,
      location: { protocol: "http:", host: "localhost", pathname: "/", hash: `#token=${TOKEN}`, reload() {} },
      history: { replaceState() {} },
      sessionStorage: tab.session,
      localStorage: tab.local,
      screen: { orientation: this.#screen },
      visualViewport: this.#viewport,
      navigator: { getGamepads: () => this.#pads, vibrate() {} },
      performance: { now: () => tab.now },
      devicePixelRatio: 1,
      matchMedia: () => Object.assign(new Target(), { matches: false }),
      getComputedStyle: () => ({ getPropertyValue: () => "" }),
      addEventListener: (...listener) => window.addEventListener(...listener),
      removeEventListener: (...listener) => window.removeEventListener(...listener),
      setTimeout: (action, delay = 0) => at(delay, action),
      setInterval: (action, period) => at(period, action, period),
      clearTimeout: (number) => this.#timers.delete(number),
      clearInterval: (number) => this.#timers.delete(number),
      requestAnimationFrame: (action) => at(Math.ceil(tab.now / FRAME + 0.01) * FRAME - tab.now, () => action(tab.now)),
      cancelAnimationFrame: (number) => this.#timers.delete(number),
      fetch: async (path) => (path === "session" ? { ok: true, json: async () => ({ users: false }) } : { ok: false, status: 404, text: async () => "" }),
      AbortSignal: { timeout: () => null },
      EventTarget: Target,
      HTMLInputElement: class { static [Symbol.hasInstance](it) { return it instanceof Element && it.tag === "input"; } },
      HTMLSelectElement: class { static [Symbol.hasInstance](it) { return it instanceof Element && it.tag === "select"; } },
      // Standard output is for the answers.
      console: new console.Console(process.stderr),
      CustomEvent, MutationObserver, ResizeObserver, URLSearchParams, WebSocket, queueMicrotask,
    };
  }

  #start(delay, action, repeat = null) {
    const number = ++this.#lastTimer;
    this.#timers.set(number, { due: this.#tab.now + Math.max(0, Number(delay) || 0), action, repeat });
    return number;
  }

  /** The timer that is due first. */
  get #next() {
    let next = null;
    for (const [number, timer] of this.#timers) {
      if (next === null || timer.due < next.due) next = { number, ...timer };
    }
    return next;
  }

  /** Lets the page live until `now`, and then what happens to it. */
  async run(now, events, thaws) {
    if (thaws) this.#tab.now = now;
    if (thaws === "events") await this.#handleAll(events);
    for (let next = this.#next; next && next.due <= now; next = this.#next) {
      this.#tab.now = Math.max(this.#tab.now, next.due);
      if (next.repeat === null) this.#timers.delete(next.number);
      // Browsers do not make up for what an interval has missed.
      else this.#timers.get(next.number).due = (thaws ? now : next.due) + Math.max(1, next.repeat);
      next.action();
      await settled();
    }
    this.#tab.now = Math.max(this.#tab.now, now);
    if (thaws !== "events") await this.#handleAll(events);
  }

  async #handleAll(events) {
    for (const [at, kind, ...rest] of events) {
      this.#at = at;
      this[`_${kind}`](...rest);
      await settled();
    }
  }

  answer() {
    const view = {
      vehicle: Number(this.#document.getElementById("vehicle-name").textContent.split("· ")[1] ?? 0),
      link: this.#document.body.dataset.link,
      control: this.#document.body.dataset.control,
      line: this.#document.getElementById("drive-line").textContent,
      notice: this.#document.getElementById("toasts").children.at(-1)?.dataset.text ?? "",
      source: this.#document.getElementById("drive-source").textContent,
      emergency: this.#document.body.dataset.emergency,
      byHand: !this.#document.getElementById("by-hand").hidden,
      latched: !this.#document.getElementById("latch").hidden,
    };
    return { out: this.#out.splice(0), next: this.#next?.due ?? null, view };
  }

  /** What the user's devices do. */

  _key(type, code, repeat, shiftKey = false) {
    const target = this.#document.activeElement ?? this.#document.body;
    const key = { Escape: "Escape" }[code] ?? code;
    target.dispatchEvent(this.#event(type, { code, key, repeat, ctrlKey: false, altKey: false, metaKey: false, shiftKey }));
  }

  _pointer(type, id, x, y, buttons) {
    const stick = this.#document.getElementById("stick");
    if (type === "pointerup" || type === "lostpointercapture") stick.releasePointerCapture(id);
    stick.dispatchEvent(this.#event(type, { pointerId: id, pointerType: "touch", isPrimary: true, button: type === "pointermove" ? -1 : 0, buttons, clientX: x, clientY: y }));
  }

  /** The browser loses the pointer and does not say so. */
  _uncapture(id) {
    this.#document.getElementById("stick").releasePointerCapture(id);
  }

  _pads(pads) {
    const isNew = this.#pads.length === 0 && pads.length > 0;
    this.#pads = pads.map(({ held, x, y, at }) => ({
      index: 0, connected: true, timestamp: at, axes: [x, y],
      buttons: Array.from({ length: 16 }, (_, button) => ({ pressed: button === 5 && held })),
    }));
    if (isNew) this.#window.dispatchEvent(this.#event("gamepadconnected"));
  }

  _click(id) {
    this.#document.getElementById(id).click();
  }

  /** Chooses a vehicle in the list. */
  _choose(number) {
    const rows = this.#document.getElementById("fleet").children;
    rows.find((row) => row.textContent.includes(`· ${number}`))?.firstChild.click();
  }

  _window(type) {
    this.#window.dispatchEvent(this.#event(type, { target: type === "blur" ? this.#window.self : null, bubbles: false }));
  }

  /** Shows a view. */
  _show(view) {
    this.#document.querySelectorAll("[data-show]").find((button) => button.dataset.show === view).click();
  }

  _menu() {
    this.#document.body.dispatchEvent(this.#event("contextmenu"));
  }

  _hide(hidden) {
    this.#document.hidden = hidden;
    this.#document.dispatchEvent(this.#event("visibilitychange"));
  }

  #event(type, properties = {}) {
    return new Event(type, { bubbles: true, timeStamp: this.#at, ...properties });
  }

  /** What the network does. */

  _opened(number) {
    const socket = this.#sockets.get(number);
    if (!socket || socket.readyState !== 0) return;
    socket.readyState = 1;
    socket.dispatchEvent(this.#event("open"));
  }

  _message(number, data) {
    const socket = this.#sockets.get(number);
    if (socket?.readyState === 1) socket.dispatchEvent(this.#event("message", { data }));
  }

  _closed(number) {
    const socket = this.#sockets.get(number);
    if (!socket || socket.readyState === 3) return;
    socket.readyState = 3;
    this.#sockets.delete(number);
    socket.dispatchEvent(this.#event("close"));
  }
}

/** A module of the page, compiled once and linked in each context. */
function compile(file, context) {
  const known = sources.get(file);
  const text = known?.text ?? read(file);
  const module = new vm.SourceTextModule(text, { identifier: fileURLToPath(new URL(file, PAGE)), context, cachedData: known?.code });
  if (!known) sources.set(file, { text, code: module.createCachedData() });
  return module;
}

/** Everything that promises have started has been done. */
const settled = () => new Promise((resolve) => setImmediate(resolve));

const tabs = new Map();

async function obey({ page, now, open, events = [], thaws = "" }) {
  const tab = tabs.get(page) ?? tabs.set(page, new Tab()).get(page);
  if (open) {
    if (open === "new") tabs.set(page, Object.assign(tab, new Tab()));
    tab.now = now;
    tab.page = new Page(tab);
    await tab.page.load();
    await settled();
  }
  await tab.page.run(now, events, thaws);
  return tab.page.answer();
}

const chunk = Buffer.alloc(1 << 16);
const decoder = new StringDecoder("utf8");
let waiting = "";

/** The next line of standard input; null at its end. */
function line() {
  for (;;) {
    const end = waiting.indexOf("\n");
    if (end >= 0) {
      const text = waiting.slice(0, end);
      waiting = waiting.slice(end + 1);
      return text;
    }
    const octets = readSync(0, chunk);
    if (octets === 0) return null;
    waiting += decoder.write(chunk.subarray(0, octets));
  }
}

process.on("uncaughtException", (error) => {
  writeSync(1, `${JSON.stringify({ error: error.stack })}\n`);
  process.exit(1);
});
process.on("unhandledRejection", (error) => {
  writeSync(1, `${JSON.stringify({ error: error.stack })}\n`);
  process.exit(1);
});

for (let text = line(); text !== null; text = line()) {
  writeSync(1, `${JSON.stringify(await obey(JSON.parse(text)))}\n`);
}
