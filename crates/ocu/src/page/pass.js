// What the page shows to the station instead of its token or the secret of its user's session, and how it knows the
// station: each proves that it knows the secret, which is not sent. Whoever has taken the station's port gets nothing that is of use anywhere.
//
// Of the token a key for this address remains, which the browser keeps for the pages of this address and shows to none,
// also not to one that another program serves here. A browser that offers pages no cryptography, as for HTTP from
// another host, cannot prove anything: there the page shows the token itself.

import { plain } from "./dom.js";

const KEY = "jaus-token";
/** Characters of a number that nobody can guess. */
const NONCE = 32;

export class Pass {
  #subtle;
  #keys;
  /** The key for this address. */
  #key = null;
  /** The token, if this browser has no cryptography. */
  #token = "";
  #run = "";
  #ticket = "";
  #answer = "";
  #loaded;

  /** What a station is asked, so that its answer is for this page alone. */
  nonce = "";

  /** Tests give another cryptography and another place for the key. */
  constructor(subtle = globalThis.crypto?.subtle, keys = new Keys()) {
    this.#subtle = subtle;
    this.#keys = keys;
    this.#loaded = this.#load();
  }

  /** Whether the page has something to show. */
  get holds() {
    return this.#key !== null || this.#token !== "";
  }

  /** What the page shows to the station: a ticket for its present run, or the token. */
  get shown() {
    return this.#ticket || this.#token;
  }

  /** What the station answers to the nonce; empty if it has nothing to prove. */
  get answer() {
    return this.#answer;
  }

  /** Prepares to connect to a station, in the run that it has named. */
  async meet(run) {
    await this.#loaded;
    this.#run = plain(run, 64);
    await this.#prepare();
  }

  /** Uses a token from now on; resolves to whether it can be one. */
  async use(token) {
    if (!plainToken(token)) return false;
    if (this.#subtle) await this.#keep(await this.#keyOf(token));
    else this.#keepText(token);
    return true;
  }

  /** Has nothing to show any more. */
  async forget() {
    this.#keepText("");
    if (this.#subtle) await this.#keep(null);
  }

  /** The token of the address's fragment, which is wiped from the address, or of this tab's past. */
  async #load() {
    const given = plainToken(new URLSearchParams(location.hash.slice(1)).get("token"));
    if (given) history.replaceState(null, "", location.pathname);
    const token = given || plainToken(sessionStorage.getItem(KEY));
    if (this.#subtle) sessionStorage.removeItem(KEY);
    if (token) await this.use(token);
    else if (this.#subtle) this.#key = await this.#keys.get();
  }

  #keepText(token) {
    this.#token = token;
    token ? sessionStorage.setItem(KEY, token) : sessionStorage.removeItem(KEY);
  }

  async #keep(key) {
    this.#key = key;
    await this.#keys.put(key);
    await this.#prepare();
  }

  async #prepare() {
    const [key, run] = [this.#key, this.#run];
    const nonce = key && run ? hex(crypto.getRandomValues(new Uint8Array(NONCE / 2))) : "";
    const ticket = nonce && (await this.#prove(key, `page ${run}`));
    const answer = nonce && (await this.#prove(key, `station ${nonce} ${run}`));
    [this.nonce, this.#ticket, this.#answer] = [nonce, ticket, answer];
  }

  /** The key for this address, which does not give the token away, nor itself. */
  async #keyOf(token) {
    const known = await this.#import(octets(token));
    return this.#import(await this.#subtle.sign("HMAC", known, octets(`jaus ${location.host}`)));
  }

  #import(raw) {
    return this.#subtle.importKey("raw", raw, { name: "HMAC", hash: "SHA-256" }, false, ["sign"]);
  }

  async #prove(key, words) {
    return hex(new Uint8Array(await this.#subtle.sign("HMAC", key, octets(words))));
  }
}

/** The key that the browser keeps, if it does: in private windows some keep nothing. */
class Keys {
  #kept = null;

  async get() {
    return this.#ask("readonly", (store) => store.get(KEY));
  }

  async put(key) {
    await this.#ask("readwrite", (store) => (key ? store.put(key, KEY) : store.delete(KEY)));
  }

  async #ask(mode, ask) {
    try {
      this.#kept ??= done(indexedDB.open("jaus"), (opening) => opening.result.createObjectStore(KEY));
      const store = (await this.#kept).transaction(KEY, mode).objectStore(KEY);
      return (await done(ask(store))) ?? null;
    } catch {
      return null;
    }
  }
}

/** The result of a request to the browser's storage. */
const done = (request, upgrade) =>
  new Promise((resolve, reject) => {
    request.onupgradeneeded = () => upgrade(request);
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });

const octets = (text) => new TextEncoder().encode(text);
const hex = (octets) => Array.from(octets, (octet) => octet.toString(16).padStart(2, "0")).join("");

/** A text if it can be a token: others cannot name a subprotocol. */
const plainToken = (text) => (/^[\w.~-]{16,256}$/.test(text ?? "") ? text : "");
