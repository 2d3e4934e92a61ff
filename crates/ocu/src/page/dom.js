// Small tools for the document. Everything that comes from the network reaches it as text through
// these functions, never as markup: names are chosen by peers. What does not show itself, turns or hides
// letters, or begins a line in a name reaches it as a blank.

// Controls, formats, separators and invisible characters: what the crate `jaus-text` calls unprintable.
const HIDDEN = /[\p{Cc}\p{Cf}\p{Zl}\p{Zp}\p{Default_Ignorable_Code_Point}\p{Noncharacter_Code_Point}\u2800]/gu;

/** Text with blanks in place of what is hidden. Line ends stay: lists and messages have some. */
const visible = (text) => (typeof text === "string" ? text.replace(HIDDEN, (letter) => (letter === "\n" ? letter : " ")) : text);

/** The element with an id, which index.html has. */
export const get = (id) => document.getElementById(id);

/** A new element with a class, attributes and children (elements or text). */
export function make(tag, { className, ...attributes } = {}, ...children) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== undefined && value !== null) element.setAttribute(name, visible(value));
  }
  element.append(...children.map(visible));
  return element;
}

/** Sets an element's text, touching the document only if it differs. */
export function say(element, text) {
  const shown = visible(text);
  if (element.textContent !== shown) element.textContent = shown;
}

/** Sets an attribute likewise; null removes it. */
export function mark(element, name, value) {
  if (value === null || value === undefined || value === false) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
  } else if (element.getAttribute(name) !== visible(String(value))) {
    element.setAttribute(name, visible(String(value)));
  }
}

/** Shows an element or hides it. */
export function show(element, shown) {
  if (element.hidden === shown) element.hidden = !shown;
}

/** Text from the network, fit to be shown: one line, bounded, nothing that turns or hides letters. */
export function plain(value, limit = 120) {
  if (value === null || value === undefined) return "";
  const text = String(value)
    .slice(0, limit * 4)
    .replace(HIDDEN, " ")
    .replace(/ +/g, " ")
    .trim();
  return text.length > limit ? `${text.slice(0, limit - 1)}…` : text;
}

/** A number from the network, or null. */
export const number = (value) => (typeof value === "number" && Number.isFinite(value) ? value : null);

/** Farther from the origin, in metres, no vehicle drives. Much farther, numbers lose their whole metres. */
const FARTHEST = 1_000_000;

/** A coordinate from the network in metres, or null. */
export const metres = (value) => (Math.abs(number(value) ?? Infinity) <= FARTHEST ? value : null);

/** A list from the network, at most `limit` entries of it. */
export const list = (value, limit = 1000) => (Array.isArray(value) ? value.slice(0, limit) : []);

/** The objects of a list from the network, at most `limit` of them. */
export const objects = (value, limit = 1000) => list(value, limit).filter((one) => one !== null && typeof one === "object");

/** A number with a fixed count of decimals and a true minus sign, or a dash. */
export function figure(value, decimals) {
  if (number(value) === null) return "–";
  const text = Math.abs(value).toFixed(decimals);
  return value < 0 && Number(text) !== 0 ? `−${text}` : text;
}

/** Seconds or minutes in few letters. */
export function duration(milliseconds) {
  const seconds = milliseconds / 1000;
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min`;
  return `${Math.floor(seconds / 3600)} h`;
}

/** A word of the protocol as people write it: `awaiting_approval` → `Awaiting approval`. */
export function words(value) {
  const text = plain(value, 40).replaceAll("_", " ").replace(/([a-z])([A-Z])/g, "$1 $2").toLowerCase();
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** Whether keys that are pressed now belong to a text field. */
export function typing() {
  const element = document.activeElement;
  return element instanceof HTMLInputElement || element instanceof HTMLSelectElement;
}

const TOASTS = 4;

/** Shows a notice for a while: `kind` is info, good, warn or bad. The same words twice are one. */
export function toast(kind, text) {
  const area = get("toasts");
  const shown = plain(text, 300);
  for (const old of [...area.children]) {
    if (old.dataset.text === shown) old.remove();
  }
  while (area.children.length >= TOASTS) area.firstChild.remove();
  const close = make("button", { type: "button", "aria-label": "Dismiss" }, "×");
  const notice = make("div", { className: `toast ${kind}` }, make("p", {}, shown), close);
  notice.dataset.text = shown;
  close.addEventListener("click", () => notice.remove());
  area.append(notice);
  setTimeout(() => notice.remove(), { bad: 12_000, warn: 6_000 }[kind] ?? 3_000);
}
