// The geographic map behind the vehicle: fetches the tiles of the station's map file that are in view,
// and draws them in the vehicle's local frame.

import { figure, list, number, plain } from "./dom.js";
import { decode, draw } from "./mvt.js";
import { CIRCUMFERENCE, fromMercator, LocalFrame, toMercator } from "./projection.js";

/** Side of a tile in pixels of its own zoom level. */
const SIDE = { picture: 256, vector: 512 };
/** Tiles in memory, in view, and on their way. */
const KEPT = 300;
const MOST_VISIBLE = 80;
const LOADING = 6;
/** Levels above a tile at which a coarser one stands in for it. */
const COARSER = 6;
const RETRY = 5_000;

export class BaseMap {
  /** Whether the station has a map file. */
  #offered = false;
  #info = null;
  #token = "";
  #frame = null;
  #placed = "";
  /** By `zoom/x/y`: `loading`, `empty`, `failed`, or something that can be drawn. */
  #tiles = new Map();
  #loading = 0;
  #notBefore = 0;
  #asking = false;
  /** What went wrong, for people. */
  #trouble = "";
  /** Why the last view shows no map. */
  #outside = "";
  #changed;

  /** Calls `changed` when there is something new to draw. */
  constructor(changed) {
    this.#changed = changed;
  }

  /** Whether it draws something at the vehicle's place. */
  get shown() {
    return this.#info !== null && this.#frame !== null && !this.#outside;
  }

  /** The vehicle's frame on the globe, or null. */
  get frame() {
    return this.#frame;
  }

  /** What to write under the map: whom to name, or why there is none. Empty without a map file. */
  get note() {
    if (!this.#offered) return "";
    if (this.#trouble && !this.#info) return `No geographic map: ${this.#trouble}`;
    if (!this.#frame) return "No geographic map: the vehicle reports no global pose, only a local one";
    if (!this.#info) return "";
    if (this.#outside) return `No geographic map: ${this.#outside}`;
    return this.#trouble ? `The map file: ${this.#trouble}` : this.#info.attribution;
  }

  /** Takes whether the station has a map file. */
  offer(offered) {
    this.#offered = offered === true;
  }

  /** Takes the origin of the vehicle's local frame, or null. */
  update(place, token) {
    this.#token = token;
    const known = ["latitude", "longitude", "heading"].every((name) => number(place?.[name]) !== null);
    const placed = known ? `${place.latitude} ${place.longitude} ${place.heading}` : "";
    if (placed !== this.#placed) {
      this.#placed = placed;
      this.#frame = known ? new LocalFrame(place) : null;
    }
    if (this.#offered && !this.#info && !this.#asking && performance.now() >= this.#notBefore) this.#describe();
  }

  /** Draws the tiles of a view, each by its corners on the screen, and fetches those that are missing. */
  paint(context, { width, height, scale, toWorld, toScreen }, colours) {
    this.#outside = "";
    if (!this.#info || !this.#frame) return;
    const corners = [[0, 0], [width, 0], [0, height], [width, height]].map((place) => toMercator(this.#frame.toGlobal(toWorld(...place))));
    const middle = this.#frame.toGlobal(toWorld(width / 2, height / 2));
    const zoom = this.#zoom(scale, middle.latitude);
    const tiles = this.#visible(corners, zoom, toMercator(middle));
    if (!tiles) return;
    const project = (u, v) => toScreen(this.#frame.toLocal(fromMercator({ u, v })));
    for (const [key, tile] of this.#drawable(tiles)) paintTile(context, key, tile, project, colours);
    this.#fetch(tiles);
  }

  /** The level whose tiles have their own size on the screen, if the file has it. */
  #zoom(scale, latitude) {
    const side = this.#info.vector ? SIDE.vector : SIDE.picture;
    const world = CIRCUMFERENCE * Math.cos((latitude * Math.PI) / 180) * scale;
    const best = Math.round(Math.log2(world / side));
    return Math.min(Math.max(best, this.#info.minZoom), this.#info.maxZoom);
  }

  /** The tiles that cover these corners, nearest to the middle first; null if there is nothing to show. */
  #visible(corners, zoom, middle) {
    const count = 2 ** zoom;
    const [west, south, east, north] = this.#info.bounds;
    const [low, high] = [toMercator({ latitude: north, longitude: west }), toMercator({ latitude: south, longitude: east })];
    const range = (axis) => {
      const values = corners.map((corner) => corner[axis]);
      const [from, to] = [Math.max(Math.min(...values), low[axis]), Math.min(Math.max(...values), high[axis])];
      return from < to ? [Math.floor(from * count), Math.min(Math.floor(to * count), count - 1)] : null;
    };
    const [across, down] = [range("u"), range("v")];
    if (!across || !down) {
      this.#outside = "the map file does not cover this place";
      return null;
    }
    if ((across[1] - across[0] + 1) * (down[1] - down[0] + 1) > MOST_VISIBLE) {
      this.#outside = "zoom in to see it";
      return null;
    }
    const tiles = [];
    for (let x = across[0]; x <= across[1]; x++) {
      for (let y = down[0]; y <= down[1]; y++) tiles.push({ zoom, x, y });
    }
    const far = ({ x, y }) => Math.hypot((x + 0.5) / count - middle.u, (y + 0.5) / count - middle.v);
    return tiles.sort((one, other) => far(one) - far(other));
  }

  /** Pairs of key and content to draw, coarser ones first. */
  #drawable(tiles) {
    const found = new Map();
    for (const tile of tiles) {
      for (let { zoom, x, y } = tile, up = 0; zoom >= 0 && up <= COARSER; zoom--, x = Math.floor(x / 2), y = Math.floor(y / 2), up++) {
        const key = `${zoom}/${x}/${y}`;
        const content = this.#tiles.get(key);
        if (typeof content === "object") found.set(key, content);
        if (typeof content === "object" || content === "empty") break;
      }
    }
    const zoom = (key) => Number(key.split("/", 1)[0]);
    return [...found].sort(([one], [other]) => zoom(one) - zoom(other));
  }

  #fetch(tiles) {
    const keys = tiles.map(({ zoom, x, y }) => `${zoom}/${x}/${y}`);
    for (const key of keys) {
      if (this.#loading >= LOADING || performance.now() < this.#notBefore) break;
      if (!this.#tiles.has(key)) this.#load(key);
    }
    // The oldest that are not in view leave.
    for (const key of this.#tiles.keys()) {
      if (this.#tiles.size <= KEPT) break;
      if (!keys.includes(key)) this.#tiles.delete(key);
    }
  }

  async #load(key) {
    this.#tiles.set(key, "loading");
    this.#loading++;
    try {
      const answer = await this.#request(`/base-map/${key}`);
      if (answer.status === 204) this.#tiles.set(key, "empty");
      else if (this.#info.vector) this.#tiles.set(key, decode(new Uint8Array(await answer.arrayBuffer())));
      else this.#tiles.set(key, await createImageBitmap(await answer.blob()));
    } catch (error) {
      this.#trouble = `tile ${key}: ${plain(error.message, 160)}`;
      this.#tiles.set(key, "failed");
      if (error instanceof TypeError) {
        // No connection: the tile itself may be sound.
        this.#tiles.delete(key);
        this.#notBefore = performance.now() + RETRY;
      }
    } finally {
      this.#loading--;
      this.#changed();
    }
  }

  async #describe() {
    this.#asking = true;
    try {
      const info = await (await this.#request("/base-map")).json();
      const bounds = list(info?.bounds, 4).map(number);
      const zooms = [info?.min_zoom, info?.max_zoom].map(number);
      if (bounds.length !== 4 || [...bounds, ...zooms].includes(null)) throw new Error("its description is invalid");
      this.#info = { bounds, minZoom: zooms[0], maxZoom: zooms[1], vector: info.vector === true, attribution: plain(info.attribution, 200) };
      this.#trouble = "";
    } catch (error) {
      this.#trouble = plain(error.message, 200);
      this.#notBefore = performance.now() + RETRY;
    } finally {
      this.#asking = false;
      this.#changed();
    }
  }

  async #request(path) {
    const headers = this.#token ? { Authorization: `Bearer ${this.#token}` } : {};
    const answer = await fetch(path, { headers });
    if (!answer.ok) throw new Error(plain(await answer.text(), 200) || `the server answered ${answer.status}`);
    return answer;
  }
}

/** Draws a tile as the parallelogram between its corners: within a tile, the curvature is less than a pixel. */
function paintTile(context, key, tile, project, colours) {
  const [zoom, x, y] = key.split("/").map(Number);
  const count = 2 ** zoom;
  const [left, top] = project(x / count, y / count);
  const [right, level] = project((x + 1) / count, y / count);
  const [lean, bottom] = project(x / count, (y + 1) / count);
  const side = Math.hypot(right - left, level - top);
  context.save();
  context.transform(right - left, level - top, lean - left, bottom - top, left, top);
  if (Array.isArray(tile)) {
    draw(context, tile, side, colours);
  } else {
    // Half a pixel more, so that no gap shows between neighbours.
    const size = 1 + 0.5 / side;
    context.globalAlpha = Number(colours["base-opacity"]) || 1;
    context.imageSmoothingEnabled = true;
    context.drawImage(tile, 0, 0, size, size);
  }
  context.restore();
}

/** A latitude and longitude in degrees, precise to a decimetre. */
export const degreesOf = ({ latitude, longitude }) => `${figure(latitude, 6)}° ${figure(longitude, 6)}°`;
