// As much of a document as panels of the page need: elements by their ids, without a tree.

export class FakeElement extends EventTarget {
  hidden = false;
  disabled = false;
  textContent = "";
  dataset = {};
  children = [];
  #attributes = new Map();
  hasAttribute = (name) => this.#attributes.has(name);
  getAttribute = (name) => this.#attributes.get(name) ?? null;
  setAttribute = (name, value) => this.#attributes.set(name, String(value));
  removeAttribute = (name) => this.#attributes.delete(name);
  contains = () => false;
  closest = () => this;
  append() {}
  remove() {}
  focus() {}
  click() {
    this.dispatchEvent(new Event("click"));
  }
}

const elements = new Map();

/** The element with an id, which is made when it is asked for. */
export function get(id) {
  if (!elements.has(id)) elements.set(id, new FakeElement());
  return elements.get(id);
}

/** Another test has elements of its own. */
export const forgetElements = () => elements.clear();

Object.assign(globalThis, {
  document: { getElementById: get, createElement: () => new FakeElement(), body: new FakeElement() },
  matchMedia: () => ({ matches: false }),
});
