// Keeps the keyboard's focus visible: when the control that has it is disabled or hidden, the next one of
// its group takes it.

const GROUPS = ".button-row, .mission-buttons, form, section, header, nav, main, body";

/** The element that had the focus last. */
let last = null;
document.addEventListener("focusin", ({ target }) => (last = target));

/** Moves the focus if its element cannot have it any more. */
export function keepFocus() {
  if (!last || last === document.body || isUsable(last)) return;
  const active = document.activeElement;
  if (active && active !== document.body && active !== last) return;
  const next = nextOf(last);
  last = null;
  next?.focus();
}

/** The first usable control of the smallest group that has one. Fields would open a tablet's keyboard. */
function nextOf(element) {
  for (let group = element.closest(GROUPS); group; group = group.parentElement?.closest(GROUPS)) {
    const controls = group.querySelectorAll("button, summary, [tabindex]");
    const found = [...controls].find(isUsable);
    if (found) return found;
  }
  return document.getElementById("map");
}

const isUsable = (element) => element.isConnected && !element.disabled && element.getClientRects().length > 0;
