// Colours: as the device wants them, or dark or light because the operator says so; a tablet in
// the sun does not know where it is.

import { get, mark } from "./dom.js";

const KEY = "jaus-theme";
const NAMES = { auto: "as the device", light: "light", dark: "dark" };

/** Applies the colours and calls `changed` whenever they change. */
export function followTheme(changed) {
  const button = get("theme-button");
  const device = matchMedia("(prefers-color-scheme: dark)");
  let theme = localStorage.getItem(KEY);
  if (!Object.hasOwn(NAMES, theme)) theme = "auto";
  const apply = () => {
    const dark = theme === "dark" || (theme === "auto" && device.matches);
    mark(document.documentElement, "data-theme", dark ? "dark" : "light");
    mark(button, "aria-label", `Colours: ${NAMES[theme]}`);
    mark(button, "title", `Colours: ${NAMES[theme]}`);
    changed();
  };
  button.addEventListener("click", () => {
    const all = Object.keys(NAMES);
    theme = all[(all.indexOf(theme) + 1) % all.length];
    localStorage.setItem(KEY, theme);
    apply();
  });
  device.addEventListener("change", apply);
  apply();
}
