// As much of a document as the operator's page needs: elements, selectors, and events with capture and
// bubbling. Nothing is laid out or drawn.

export class Target {
  #listeners = [];
  /** Where an event goes next; null at the end. */
  parent = null;

  addEventListener(type, listener, options) {
    const capture = options === true || options?.capture === true;
    this.#listeners.push({ type, listener, capture });
  }

  removeEventListener(type, listener) {
    this.#listeners = this.#listeners.filter((one) => one.type !== type || one.listener !== listener);
  }

  dispatchEvent(event) {
    const path = [];
    for (let at = this; at; at = at.parent) path.push(at);
    event.target ??= this;
    for (const target of [...path].reverse()) target.#call(event, true);
    for (const target of event.bubbles ? path : [this]) target.#call(event, false);
    return !event.defaultPrevented;
  }

  #call(event, capture) {
    for (const one of [...this.#listeners]) {
      if (event.isStopped || one.type !== event.type || one.capture !== capture) continue;
      one.listener.call(this, event);
    }
  }
}

export class Event {
  defaultPrevented = false;
  isStopped = false;
  isTrusted = true;

  constructor(type, properties = {}) {
    Object.assign(this, { type, bubbles: false, target: null }, properties);
  }

  preventDefault() {
    this.defaultPrevented = true;
  }

  stopPropagation() {
    this.isStopped = true;
  }

  getModifierState() {
    return false;
  }
}

/** A canvas context, an audio context: anything may be called, and nothing happens. */
const nothing = () => new Proxy(() => {}, { get: (_, name) => (name === Symbol.toPrimitive ? () => 0 : nothing()), set: () => true, apply: () => nothing() });

export class Element extends Target {
  children = [];
  text = "";
  style = { setProperty() {} };
  value = "";
  disabled = false;
  width = 300;
  height = 300;
  clientWidth = 300;
  clientHeight = 300;
  #attributes = new Map();
  #captured = new Set();
  #document;
  dataset = new Proxy({}, {
    get: (_, name) => this.getAttribute(dataName(name)) ?? undefined,
    set: (_, name, value) => (this.setAttribute(dataName(name), value), true),
    deleteProperty: (_, name) => (this.removeAttribute(dataName(name)), true),
  });

  constructor(document, tag) {
    super();
    this.#document = document;
    this.tag = tag;
  }

  // Attributes.

  get id() {
    return this.getAttribute("id") ?? "";
  }

  get hidden() {
    return this.hasAttribute("hidden");
  }

  set hidden(hidden) {
    if (hidden === this.hidden) return;
    hidden ? this.setAttribute("hidden", "") : this.removeAttribute("hidden");
  }

  get className() {
    return this.getAttribute("class") ?? "";
  }

  set className(names) {
    this.setAttribute("class", names);
  }

  get classList() {
    const names = () => new Set(this.className.split(/\s+/).filter(Boolean));
    const toggle = (name, force) => {
      const all = names();
      const has = force ?? !all.has(name);
      has ? all.add(name) : all.delete(name);
      this.className = [...all].join(" ");
      return has;
    };
    return { contains: (name) => names().has(name), add: (name) => toggle(name, true), remove: (name) => toggle(name, false), toggle };
  }

  hasAttribute(name) {
    return this.#attributes.has(name);
  }

  getAttribute(name) {
    return this.#attributes.get(name) ?? null;
  }

  setAttribute(name, value) {
    if (name === "class" && this.className !== String(value)) this.#document.structure++;
    this.#attributes.set(name, String(value));
    if (name === "disabled") this.disabled = true;
    this.#document.handleMutation(this, name);
  }

  removeAttribute(name) {
    if (this.#attributes.delete(name)) this.#document.handleMutation(this, name);
  }

  // The tree.

  get textContent() {
    return this.text + this.children.map((child) => child.textContent).join("");
  }

  set textContent(text) {
    this.replaceChildren(String(text));
  }

  get firstChild() {
    return this.children[0] ?? null;
  }

  get lastChild() {
    return this.children.at(-1) ?? null;
  }

  get nextElementSibling() {
    const siblings = this.parentElement?.children ?? [];
    return siblings[siblings.indexOf(this) + 1] ?? null;
  }

  get parentElement() {
    return this.parent instanceof Element ? this.parent : null;
  }

  get isConnected() {
    return this.#document.documentElement.contains(this);
  }

  get options() {
    return this.children;
  }

  append(...nodes) {
    for (const node of nodes) this.insertBefore(node, null);
  }

  prepend(node) {
    this.insertBefore(node, this.firstChild);
  }

  insertBefore(node, before) {
    if (!(node instanceof Element)) return void (this.text += String(node));
    node.remove();
    this.#document.structure++;
    const at = before === null ? this.children.length : this.children.indexOf(before);
    this.children.splice(at, 0, node);
    node.parent = this;
  }

  replaceChildren(...nodes) {
    for (const child of [...this.children]) child.remove();
    this.text = "";
    this.append(...nodes);
  }

  remove() {
    if (!(this.parent instanceof Element)) return;
    this.#document.structure++;
    this.parent.children = this.parent.children.filter((child) => child !== this);
    this.parent = null;
  }

  contains(other) {
    for (let at = other; at; at = at.parent) if (at === this) return true;
    return false;
  }

  closest(selector) {
    for (let at = this; at instanceof Element; at = at.parent) if (at.matches(selector)) return at;
    return null;
  }

  matches(selectors) {
    return testOf(selectors)(this);
  }

  querySelectorAll(selectors) {
    const scope = ":scope > ";
    if (selectors.startsWith(scope)) return this.children.filter((child) => child.matches(selectors.slice(scope.length)));
    const found = [];
    this.#collect(selectors, found);
    return found;
  }

  #collect(selectors, found) {
    for (const child of this.children) {
      if (child.matches(selectors)) found.push(child);
      child.#collect(selectors, found);
    }
  }

  querySelector(selectors) {
    return this.querySelectorAll(selectors)[0] ?? null;
  }

  // What a user does.

  focus() {
    if (this.#document.activeElement === this) return;
    this.#document.activeElement = this;
    this.dispatchEvent(new Event("focusin", { bubbles: true }));
  }

  click() {
    if (!this.disabled && !this.hidden) this.dispatchEvent(new Event("click", { bubbles: true }));
  }

  setPointerCapture(id) {
    this.#captured.add(id);
  }

  releasePointerCapture(id) {
    this.#captured.delete(id);
  }

  hasPointerCapture(id) {
    return this.#captured.has(id);
  }

  getContext() {
    return nothing();
  }

  /** Something is shown unless it is hidden by itself or with what it is in. */
  getClientRects() {
    return this.isConnected && !this.closest("[hidden]") ? [this.getBoundingClientRect()] : [];
  }

  getBoundingClientRect() {
    return { x: 0, y: 0, left: 0, top: 0, width: this.clientWidth, height: this.clientHeight };
  }
}

const dataName = (name) => `data-${String(name).replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`)}`;

/** The test of each list of selectors that was used before. */
const tests = new Map();

/** Tests an element by compound selectors of tag, class, id and attribute, without combinators. */
function testOf(selectors) {
  if (!tests.has(selectors)) {
    const all = selectors.split(",").map((selector) => compile(selector.trim()));
    tests.set(selectors, (element) => all.some((parts) => parts.every((part) => part(element))));
  }
  return tests.get(selectors);
}

function compile(selector) {
  const parts = selector.match(/^[a-z0-9]+|\.[\w-]+|#[\w-]+|\[[^\]]+\]/g) ?? [];
  if (parts.join("") !== selector) throw new Error(`a selector that this document does not know: ${selector}`);
  return parts.map((part) => {
    const name = part.slice(1);
    if (part[0] === ".") return (element) => ` ${element.className} `.includes(` ${name} `);
    if (part[0] === "#") return (element) => element.id === name;
    if (part[0] !== "[") return (element) => element.tag === part;
    const [attribute, value] = part.slice(1, -1).split("=");
    if (value === undefined) return (element) => element.hasAttribute(attribute);
    return (element) => element.getAttribute(attribute) === value.replaceAll('"', "");
  });
}

const VOID = ["meta", "link", "input", "br", "path", "circle"];

export class Document extends Target {
  hidden = false;
  activeElement = null;
  documentElement = new Element(this, "html");
  body = null;
  /** Counts the changes of tree and classes. */
  structure = 0;
  #ids = new Map();
  /** What the page has asked for since the last such change: it asks for its own markup again and again. */
  #found = { structure: -1, all: new Map() };
  #observers = new Set();

  /** Reads a page as the project writes it. */
  constructor(html) {
    super();
    this.documentElement.parent = this;
    let at = this.documentElement;
    for (const [, end, tag, attributes, text] of html.matchAll(/<(\/?)([a-z0-9]+)((?:\s+[\w-]+(?:="[^"]*")?)*)\s*\/?>|([^<]+|<!)/gi)) {
      if (text !== undefined) at.text += text.trim();
      else if (end) at = at.closest(tag)?.parent ?? at;
      else if (tag !== "html") at = this.#open(at, tag, attributes);
    }
    this.body = this.documentElement.querySelector("body");
    this.activeElement = this.body;
  }

  #open(parent, tag, attributes) {
    const element = new Element(this, tag);
    for (const [, name, value] of attributes.matchAll(/([\w-]+)(?:="([^"]*)")?/g)) element.setAttribute(name, value ?? "");
    parent.append(element);
    if (element.id) this.#ids.set(element.id, element);
    return VOID.includes(tag) ? parent : element;
  }

  getElementById(id) {
    return this.#ids.get(id) ?? null;
  }

  createElement(tag) {
    return new Element(this, tag);
  }

  querySelectorAll(selectors) {
    if (this.#found.structure !== this.structure) this.#found = { structure: this.structure, all: new Map() };
    const { all } = this.#found;
    if (!all.has(selectors)) all.set(selectors, this.documentElement.querySelectorAll(selectors));
    return all.get(selectors);
  }

  observe(observer) {
    this.#observers.add(observer);
  }

  handleMutation(element, name) {
    for (const { target, attributes, notify } of this.#observers) {
      if (target === element && attributes.includes(name)) queueMicrotask(notify);
    }
  }
}
