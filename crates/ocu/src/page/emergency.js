// Emergency stop: one touch or key, from anywhere, in any condition. The wish is kept and repeated
// until the vehicle says that it has stopped, over reconnections as well. Clearing it takes two.

import { get, mark, say, show, toast } from "./dom.js";

const REPEAT = 500;
const touch = matchMedia("(hover: none)");

export class Emergency {
  #link;
  /** Whether somebody wants the vehicle stopped and it has not confirmed that yet. */
  #wanted = false;
  #confirmed = false;
  #refusal = "";

  constructor(link) {
    this.#link = link;
    get("estop").addEventListener("click", () => this.stop());
    get("estop-clear").addEventListener("click", () => this.#openSheet());
    get("clear-no").addEventListener("click", () => this.#closeSheet());
    get("clear-yes").addEventListener("click", () => this.#clear());
    setInterval(() => this.#wanted && this.#send(), REPEAT);
    this.#render();
  }

  /** Stops the vehicle. */
  stop() {
    this.#closeSheet();
    this.#wanted = true;
    this.#refusal = "";
    this.#send();
    this.#render();
    navigator.vibrate?.(80);
  }

  /** Takes a key; true if it was for the emergency stop. Space types in fields, Escape never does. */
  key(event) {
    const field = event.target instanceof HTMLInputElement;
    if (event.key !== "Escape" && !(event.code === "Space" && !field)) return false;
    event.preventDefault();
    if (!event.repeat) this.stop();
    return true;
  }

  /** Takes a state. */
  update(state) {
    this.#confirmed = state?.vehicle?.emergency === true;
    if (this.#confirmed) this.#wanted = false;
    this.#render();
  }

  async #send() {
    if (!this.#link.open || !this.#link.settled) return;
    const reason = await this.#link.ask({ type: "emergency", on: true });
    if (reason === null || !this.#wanted) return;
    if (this.#refusal !== reason) toast("bad", `Emergency stop: ${reason}`);
    this.#refusal = reason;
  }

  #render() {
    const how = this.#confirmed ? "stopped" : this.#wanted ? "wanted" : "ready";
    document.body.dataset.emergency = how;
    const [word, detail] = {
      ready: ["Emergency stop", touch.matches ? "stops the vehicle at once" : "Esc or Space"],
      wanted: ["Stopping", this.#link.open ? this.#refusal || "not confirmed yet" : "NOT SENT: no connection"],
      stopped: ["Emergency", "the vehicle is stopped"],
    }[how];
    say(get("estop-word"), word);
    say(get("estop-detail"), detail);
    mark(get("estop"), "aria-pressed", String(how !== "ready"));
    show(get("estop-clear"), this.#confirmed);
    if (!this.#confirmed) show(get("clear-sheet"), false);
  }

  #openSheet() {
    show(get("clear-sheet"), true);
    get("clear-no").focus();
  }

  #closeSheet() {
    show(get("clear-sheet"), false);
  }

  async #clear() {
    this.#closeSheet();
    const reason = await this.#link.ask({ type: "emergency", on: false });
    if (reason === null) toast("good", "Emergency cleared.");
    else toast("bad", reason);
  }
}
