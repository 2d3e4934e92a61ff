// Who is logged in: the login form, the account with its way out, and for administrators the
// sessions of all users. A station without users has none of it.

import { duration, get, list, make, mark, plain, say, show, toast, words } from "./dom.js";

/** A user who does something says so at most this often. */
const ACTIVE = 60_000;
const PATIENCE = 5_000;

export class Account {
  /** Whether the station has users, who must log in. */
  users = false;
  /** The name of the user who is logged in, or null. */
  user = null;
  role = null;
  #activeAt = 0;
  #entered;
  #pass;

  /** Calls `entered` when a user has logged in, and `active` when the user does something. */
  constructor(entered, active, pass) {
    this.#pass = pass;
    this.#entered = entered;
    get("login-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#logIn();
    });
    get("account-button").addEventListener("click", () => this.#open());
    get("account-close").addEventListener("click", () => this.#close());
    get("log-out").addEventListener("click", () => this.#logOut());
    for (const type of ["pointerdown", "keydown"]) {
      addEventListener(type, () => this.#noteActive(active), { passive: true });
    }
  }

  /** Whether nobody is logged in although that is required. */
  get missing() {
    return this.users && !this.user;
  }

  /** Whether the user may operate vehicles. */
  get operates() {
    return this.role === "drive" || this.role === "administer";
  }

  /** Why the user may not operate vehicles, for the emergency stop. */
  get hindrance() {
    return this.user ? "your role only observes" : "log in to use it";
  }

  /** Asks the station who is logged in; resolves to whether the page may connect. */
  async check() {
    const shown = this.#pass.shown;
    let session = await this.#session();
    await this.#pass.meet(session.run);
    // What the page has to show depends on the station's run.
    if (session.users && this.#pass.shown !== shown) session = await this.#session();
    this.users = session.users === true;
    this.user = typeof session.user === "string" ? plain(session.user, 32) : null;
    this.role = plain(session.role, 16);
    this.#render();
    return !this.missing;
  }

  async #session() {
    return (await this.#request("session")).json();
  }

  #render() {
    show(get("login-sheet"), this.missing);
    show(get("account-button"), Boolean(this.user));
    const title = this.user ? `${this.user}: ${words(this.role)}` : "";
    mark(get("account-button"), "aria-label", `Account of ${this.user}`);
    mark(get("account-button"), "title", title);
    say(get("account-title"), title);
    if (!this.user) this.#close();
  }

  /** Moves the focus to the login form. */
  focus() {
    get(get("login-name").value ? "login-password" : "login-name").focus();
  }

  async #logIn() {
    const [name, password] = [get("login-name"), get("login-password")];
    const body = JSON.stringify({ name: name.value.trim(), password: password.value });
    get("login-submit").disabled = true;
    const reason = await this.#refusal("login", body, async (answer) => this.#pass.use(plain((await answer.json()).secret, 64)));
    get("login-submit").disabled = false;
    password.value = "";
    say(get("login-text"), reason === null ? "" : `Not logged in: ${reason}`);
    if (reason === null) this.#entered();
    else password.focus();
  }

  async #logOut() {
    const reason = await this.#refusal("logout");
    if (reason !== null) return toast("bad", reason);
    await this.#pass.forget();
    // The page forgets what it has shown.
    location.reload();
  }

  #noteActive(active) {
    const now = performance.now();
    if (!this.user || (this.#activeAt && now - this.#activeAt < ACTIVE)) return;
    this.#activeAt = now;
    active();
  }

  #open() {
    show(get("account-sheet"), true);
    get("account-close").focus();
    show(get("sessions"), false);
    if (this.role === "administer") this.#listSessions();
  }

  #close() {
    const sheet = get("account-sheet");
    if (sheet.contains(document.activeElement)) get("account-button").focus();
    show(sheet, false);
  }

  async #listSessions() {
    try {
      const answer = await this.#request("sessions");
      if (!answer.ok) throw new Error(await answer.text());
      const sessions = list(await answer.json(), 1024);
      get("sessions").replaceChildren(...sessions.map((session) => this.#entry(session)));
      show(get("sessions"), true);
    } catch (error) {
      toast("bad", plain(error.message, 200));
    }
  }

  #entry({ id, user, role, address, idle_s, own }) {
    const name = plain(user, 32);
    const text = `${name}: ${words(role)}, ${plain(address, 40)}, idle ${duration(idle_s * 1000)}`;
    if (own) return make("li", {}, make("span", {}, `${text} (this page)`));
    const end = make("button", { type: "button", className: "warn", "aria-label": `End the session of ${name}` }, "End");
    end.addEventListener("click", async () => {
      const reason = await this.#refusal(`sessions/${Number(id)}/end`);
      if (reason !== null) toast("bad", reason);
      this.#listSessions();
    });
    return make("li", {}, make("span", {}, text), end);
  }

  #request(path, options) {
    const { shown } = this.#pass;
    const headers = shown ? { Authorization: `Bearer ${shown}` } : {};
    return fetch(path, { cache: "no-store", signal: AbortSignal.timeout(PATIENCE), headers, ...options });
  }

  /** Posts; resolves to null if it was accepted, or to the reason why not. */
  async #refusal(path, body, accepted = () => {}) {
    try {
      const answer = await this.#request(path, { method: "POST", body });
      if (!answer.ok) return plain(await answer.text(), 200) || `status ${answer.status}`;
      await accepted(answer);
      return null;
    } catch {
      return "no connection to the operator's node";
    }
  }
}
