// Vector tiles (Mapbox Vector Tiles, version 2): decodes lines and areas, and draws them by the kind of
// their layer. Tags and points are left out. Tiles are not trusted: reading never leaves their octets.

/** Kinds of layers by their names in the usual schemas, in the order of drawing. */
const KINDS = [
  ["land", /^(earth|land)$/],
  ["green", /park|wood|forest|grass|landcover|natur|veget|green/],
  ["landuse", /land_?use|aero|pier/],
  ["water", /water|ocean|sea|lake|river/],
  ["building", /build/],
  ["other", /^/],
  ["road", /road|transport|street|highway|path|track/],
];
const ORDER = KINDS.map(([kind]) => kind);
/** Widths of lines in pixels. */
const WIDTHS = { road: 3, water: 2 };
const MOST_POINTS = 1_000_000;
/** Layers and features cost more than their few octets. */
const MOST_LAYERS = 64;
const MOST_FEATURES = 100_000;
const DEFAULT_EXTENT = 4096;

/** What a tile draws: for each layer its kind, extent, areas and lines. */
export function decode(octets) {
  const budget = { points: MOST_POINTS, features: MOST_FEATURES };
  const layers = [];
  for (const { number, value } of fields(new Octets(octets))) {
    if (number !== 3 || !(value instanceof Octets)) continue;
    if (layers.length === MOST_LAYERS) throw new Error(`more than ${MOST_LAYERS} layers`);
    layers.push(layer(value, budget));
  }
  return layers.sort((one, other) => ORDER.indexOf(one.kind) - ORDER.indexOf(other.kind));
}

/** Draws layers into the unit square; `side` is its length on the screen in pixels. */
export function draw(context, layers, side, colours) {
  context.save();
  context.beginPath();
  context.rect(0, 0, 1, 1);
  context.clip();
  for (const { kind, extent, areas, lines } of layers) {
    context.save();
    context.scale(1 / extent, 1 / extent);
    context.fillStyle = context.strokeStyle = colours[`base-${kind}`];
    context.lineWidth = ((WIDTHS[kind] ?? 1) * extent) / side;
    // Areas of an unknown kind could hide everything.
    if (kind !== "other" && kind !== "road") context.fill(areas);
    context.stroke(lines);
    context.restore();
  }
  context.restore();
}

function layer(octets, budget) {
  let [name, extent] = ["", DEFAULT_EXTENT];
  const features = [];
  for (const { number, value } of fields(octets)) {
    if (number === 1 && value instanceof Octets) name = value.text();
    if (number === 2 && value instanceof Octets) {
      if ((budget.features -= 1) < 0) throw new Error(`more than ${MOST_FEATURES} features`);
      features.push(value);
    }
    if (number === 5 && value > 0) extent = value;
  }
  const [areas, lines] = [new Path2D(), new Path2D()];
  for (const one of features) feature(one, areas, lines, budget);
  const [kind] = KINDS.find(([, names]) => names.test(name.toLowerCase()));
  return { kind, extent, areas, lines };
}

function feature(octets, areas, lines, budget) {
  let [type, geometry] = [0, null];
  for (const { number, value } of fields(octets)) {
    if (number === 3) type = value;
    if (number === 4 && value instanceof Octets) geometry = value;
  }
  const path = { 2: lines, 3: areas }[type];
  if (path && geometry) trace(geometry, path, budget);
}

/** Adds a geometry to a path: commands with their counts, and steps from the place before. */
function trace(octets, path, budget) {
  let [x, y] = [0, 0];
  while (!octets.done) {
    const command = octets.number();
    const [what, count] = [command % 8, Math.floor(command / 8)];
    if (![1, 2, 7].includes(what)) throw new Error(`unknown command ${what} in a geometry`);
    if ((budget.points -= Math.max(count, 1)) < 0) throw new Error(`more than ${MOST_POINTS} points`);
    if (what === 7) {
      path.closePath();
      continue;
    }
    for (let index = 0; index < count; index++) {
      x += step(octets.number());
      y += step(octets.number());
      if (what === 1) path.moveTo(x, y);
      else path.lineTo(x, y);
    }
  }
}

/** Steps alternate between zero, negative and positive numbers: 0, -1, 1, -2, 2. */
const step = (value) => (value % 2 ? -(value + 1) / 2 : value / 2);

/** The fields of a message: numbers, or octets. */
function* fields(octets) {
  while (!octets.done) {
    const tag = octets.number();
    const number = Math.floor(tag / 8);
    switch (tag % 8) {
      case 0: yield { number, value: octets.number() }; break;
      case 1: octets.take(8); break;
      case 2: yield { number, value: octets.take(octets.number()) }; break;
      case 5: octets.take(4); break;
      default: throw new Error(`unknown type of field ${number}`);
    }
  }
}

/** Octets of a protocol buffer that are left to read. */
class Octets {
  #octets;
  #at = 0;

  constructor(octets) {
    this.#octets = octets;
  }

  get done() {
    return this.#at >= this.#octets.length;
  }

  /** A number of seven bits per octet, the least significant first. Those above 2⁵³ are not exact. */
  number() {
    let [value, factor] = [0, 1];
    for (let count = 0; count < 10; count++) {
      if (this.done) break;
      const octet = this.#octets[this.#at++];
      value += (octet & 0x7f) * factor;
      if (octet < 0x80) return value;
      factor *= 128;
    }
    throw new Error("it ends within a number");
  }

  /** The next octets. */
  take(length) {
    const end = this.#at + length;
    if (end > this.#octets.length) throw new Error("it ends within a field");
    const taken = new Octets(this.#octets.subarray(this.#at, end));
    this.#at = end;
    return taken;
  }

  text() {
    return new TextDecoder().decode(this.#octets.slice(0, 100));
  }
}
