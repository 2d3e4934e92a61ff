// The raster under the map: fetches the cells of a traversability map when its revision changes,
// and keeps them as a picture of one pixel per cell.

import { metres, number } from "./dom.js";

const LARGEST = 4096;
const RETRY = 2_000;

export class Raster {
  #vehicle;
  #shown = "";
  #loading = false;
  #cells = null;
  #notBefore = 0;

  /** What is shown: the map's description of the protocol, or null. */
  info = null;
  /** The picture: columns × rows, north up. */
  picture = null;
  /** Why there is no picture, for people. */
  problem = "";

  /** The raster of a vehicle, by its subsystem number. */
  constructor(vehicle) {
    this.#vehicle = vehicle;
  }

  /** Takes the description of a state; calls `changed` when there is a new picture. */
  update(info, token, changed) {
    if (!valid(info)) {
      this.problem = info ? "The map cannot be shown: its size is invalid." : "No map from the vehicle yet";
      return;
    }
    const wanted = `${info.id}/${info.revision}/${info.rows}x${info.columns}`;
    if (wanted === this.#shown || this.#loading || performance.now() < this.#notBefore) return;
    this.#loading = true;
    load(this.#vehicle, info, token)
      .then((cells) => {
        this.#shown = wanted;
        this.#cells = cells;
        this.info = info;
        this.problem = "";
        this.paint(changed);
      })
      .catch((error) => {
        this.problem = `The map did not load: ${error.message}`;
        this.#notBefore = performance.now() + RETRY;
      })
      .finally(() => (this.#loading = false));
  }

  /** Paints the cells in the colours of the style sheet; again when those change. */
  paint(changed) {
    if (!this.#cells) return;
    const { rows, columns } = this.info;
    const shades = palette();
    const canvas = document.createElement("canvas");
    canvas.width = columns;
    canvas.height = rows;
    const context = canvas.getContext("2d");
    const image = context.createImageData(columns, rows);
    const pixels = new Uint32Array(image.data.buffer);
    for (let row = 0; row < rows; row++) {
      // Row 0 is the southernmost, and the lowest of the picture.
      const to = (rows - 1 - row) * columns;
      const from = row * columns;
      for (let column = 0; column < columns; column++) pixels[to + column] = shades[this.#cells[from + column]];
    }
    context.putImageData(image, 0, 0);
    this.picture = canvas;
    changed();
  }

  /** The traversability at a place, 0 to 255, or null outside the map. */
  at(x, y) {
    if (!this.#cells) return null;
    const { rows, columns, cell_m: cell } = this.info;
    const row = Math.floor((x - this.info.x) / cell);
    const column = Math.floor((y - this.info.y) / cell);
    if (row < 0 || column < 0 || row >= rows || column >= columns) return null;
    return this.#cells[row * columns + column];
  }
}

function valid(info) {
  const size = (value) => Number.isInteger(value) && value > 0 && value <= LARGEST;
  return Boolean(
    info && Number.isInteger(info.id) && Number.isInteger(info.revision) && size(info.rows) &&
      size(info.columns) && metres(info.x) !== null && metres(info.y) !== null && number(info.cell_m) > 0 &&
      metres(info.cell_m * LARGEST) !== null,
  );
}

async function load(vehicle, { id, revision, rows, columns }, token) {
  const headers = token ? { Authorization: `Bearer ${token}` } : {};
  const answer = await fetch(`/map/${vehicle}/${id}?revision=${revision}`, { headers, cache: "no-store" });
  if (!answer.ok) throw new Error(`the server answered ${answer.status}`);
  const cells = new Uint8Array(await answer.arrayBuffer());
  if (cells.length !== rows * columns) {
    throw new Error(`received ${cells.length} cells instead of ${rows} × ${columns}`);
  }
  return cells;
}

/** The colour of each traversability as a pixel: from blocked over costly to free. */
function palette() {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(name).trim().match(/\w\w/g).map((part) => parseInt(part, 16));
  const [blocked, costly, free] = [colour("--cell-blocked"), colour("--cell-costly"), colour("--cell-free")];
  const shades = new Uint32Array(256);
  for (let value = 0; value < 256; value++) {
    const part = value / 255;
    const [from, to, at] = part < 0.4 ? [blocked, costly, part / 0.4] : [costly, free, (part - 0.4) / 0.6];
    const [r, g, b] = from.map((start, index) => Math.round(start + (to[index] - start) * at));
    shades[value] = value === 0 ? pixel(...blocked) : pixel(r, g, b);
  }
  return shades;
}

/** Octets in memory are red, green, blue, opacity, whatever the order of this machine's words. */
const pixel = (r, g, b) => new Uint32Array(new Uint8Array([r, g, b, 255]).buffer)[0];
