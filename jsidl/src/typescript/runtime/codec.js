// Codec of generated JAUS messages, written by `jaus jsidl typescript`. No dependencies; runs in pages
// and in Node.js.
//
// A layout is an object with four functions: read(reader), write(writer, value), view(value) and
// initial(). The classes of records, scaled integers and bit fields are layouts themselves.
// Decoding is strict about the layout and preserves all values: encoding gives the same octets.

/** Elements without octets that one message may hold: their count alone takes no octets. */
const MOST_EMPTY_ELEMENTS = 4096;

/** Octets that are not a message, or a message that cannot be encoded. */
class CodecError extends Error {
  constructor(kind, problem) {
    super(problem);
    this.kind = kind;
    this.problem = problem;
    this.messageName = "";
    this.path = "";
  }

  /** Adds an enclosing member to the path. */
  inMember(name) {
    const joint = this.path === "" || this.path.startsWith("[") ? "" : ".";
    this.path = `${name}${joint}${this.path}`;
    return this;
  }

  /** Adds the index of an enclosing element to the path. */
  inElement(index) {
    const joint = this.path === "" || this.path.startsWith("[") ? "" : ".";
    this.path = `[${index}]${joint}${this.path}`;
    return this;
  }

  /** Adds the message, which completes the text. */
  inMessage(name) {
    this.messageName = name;
    const path = this.path === "" ? "" : `${this.path}: `;
    this.message = `${name}: ${path}${this.problem}${this.place()}`;
    return this;
  }

  place() {
    return "";
  }
}

export class DecodeError extends CodecError {
  constructor(kind, problem, offset) {
    super(kind, problem);
    this.name = "DecodeError";
    this.offset = offset;
  }

  place() {
    return ` at octet ${this.offset}`;
  }
}

export class EncodeError extends CodecError {
  constructor(kind, problem) {
    super(kind, problem);
    this.name = "EncodeError";
  }
}

/** A number outside the range of a field. */
export class OutOfRange extends RangeError {
  constructor(field, value, lower, upper, units) {
    const unit = units === "one" || units === "" ? "" : ` ${units}`;
    super(`${field}: ${value} is not in ${lower} to ${upper}${unit}`);
    this.name = "OutOfRange";
    Object.assign(this, { field, value, lower, upper, units });
  }
}

function member(name, act) {
  try {
    return act();
  } catch (error) {
    throw error instanceof CodecError ? error.inMember(name) : error;
  }
}

function element(index, act) {
  try {
    return act();
  } catch (error) {
    throw error instanceof CodecError ? error.inElement(index) : error;
  }
}

/** A cursor over a message. */
class Reader {
  constructor(octets) {
    this.octets = octets;
    this.data = new DataView(octets.buffer, octets.byteOffset, octets.byteLength);
    this.at = 0;
    this.emptyElements = MOST_EMPTY_ELEMENTS;
    // JavaScript does not preserve the bits of a NaN: unusual ones, by their offset.
    this.nans = new Map();
  }

  get left() {
    return this.octets.length - this.at;
  }

  /** Passes octets, and returns the offset of the first one. */
  take(needed) {
    if (needed > this.left) {
      const problem = `octets needed: ${needed}, left: ${this.left}`;
      throw new DecodeError("short", problem, this.at);
    }
    const at = this.at;
    this.at += Number(needed);
    return at;
  }

  slice(length) {
    const at = this.take(length);
    return this.octets.slice(at, this.at);
  }

  count(number, min, max) {
    const offset = this.at;
    const count = number.read(this);
    if (count < min || count > max) {
      throw new DecodeError("count", outside(count, min, max), offset);
    }
    return count;
  }

  elements(count, layout) {
    const elements = [];
    for (let index = 0; index < count; index++) {
      const start = this.at;
      elements.push(element(index, () => layout.read(this)));
      if (this.at === start && this.emptyElements-- === 0) {
        throw new DecodeError("emptyElements", tooManyEmpty(), start).inElement(index);
      }
    }
    return elements;
  }
}

/** A growing message. */
class Writer {
  constructor(nans) {
    this.octets = new Uint8Array(64);
    this.data = new DataView(this.octets.buffer);
    this.at = 0;
    this.emptyElements = MOST_EMPTY_ELEMENTS;
    this.nans = nans;
  }

  /** Makes room for octets, and returns the offset of the first one. */
  take(length) {
    const at = this.at;
    this.at += length;
    if (this.at > this.octets.length) {
      const larger = new Uint8Array(2 * this.at);
      larger.set(this.octets);
      this.octets = larger;
      this.data = new DataView(larger.buffer);
    }
    return at;
  }

  append(octets) {
    const at = this.take(octets.length);
    this.octets.set(octets, at);
  }

  count(number, min, max, count) {
    const most = max < number.greatest ? max : number.greatest;
    if (count < min || count > most) {
      throw new EncodeError("count", outside(count, min, most));
    }
    number.write(this, count);
  }

  elements(values, layout) {
    values.forEach((value, index) => {
      const start = this.at;
      element(index, () => layout.write(this, value));
      if (this.at === start && this.emptyElements-- === 0) {
        throw new EncodeError("emptyElements", tooManyEmpty()).inElement(index);
      }
    });
  }
}

const outside = (count, min, max) => `count ${count} is outside ${min} to ${max}`;
const tooManyEmpty = () => `more than ${MOST_EMPTY_ELEMENTS} elements that take no octets`;

function expected(what, found) {
  const shown = typeof found === "string" ? `"${found}"` : String(found);
  return new EncodeError("type", `${shown}, but the definition has ${what}`);
}

// Numbers

function integer(name, size, type, least, greatest) {
  const [get, set] = [`get${type}`, `set${type}`];
  const layout = {
    size,
    least,
    greatest,
    read: (reader) => reader.data[get](reader.take(size), true),
    write(writer, value) {
      if (!Number.isInteger(value) || value < least || value > greatest) {
        throw unfit(value, name);
      }
      writer.take(size);
      writer.data[set](writer.at - size, value, true);
    },
    view: (value) => value,
    initial: () => 0,
  };
  return Object.freeze(layout);
}

function bigInteger(name, type, least, greatest) {
  const [get, set] = [`get${type}`, `set${type}`];
  const layout = {
    size: 8,
    least,
    greatest,
    read: (reader) => reader.data[get](reader.take(8), true),
    write(writer, value) {
      const is = typeof value === "bigint" || Number.isSafeInteger(value);
      if (!is || value < least || value > greatest) {
        throw unfit(value, name);
      }
      writer.take(8);
      writer.data[set](writer.at - 8, BigInt(value), true);
    },
    // JSON has no integers of this size.
    view: (value) => (Number.isSafeInteger(Number(value)) ? Number(value) : String(value)),
    initial: () => 0n,
  };
  return Object.freeze(layout);
}

function unfit(value, name) {
  const problem = typeof value === "number" || typeof value === "bigint" ? value : `"${value}"`;
  return new EncodeError("number", `${problem} does not fit ${name}`);
}

function real(name, size, type, bits, nan, shortest) {
  const [get, getBits, setBits] = [`getFloat${8 * size}`, `get${bits}`, `set${bits}`];
  const layout = {
    size,
    read(reader) {
      const at = reader.take(size);
      const value = reader.data[get](at, true);
      if (Number.isNaN(value)) {
        const found = reader.data[getBits](at, true);
        if (found !== nan) reader.nans.set(at, found);
      }
      return value;
    },
    write(writer, value) {
      if (typeof value !== "number") throw unfit(value, name);
      const at = writer.take(size);
      if (Number.isNaN(value)) {
        const known = writer.nans?.get(at);
        writer.data[setBits](at, typeof known === typeof nan ? known : nan, true);
      } else {
        writer.data[`setFloat${8 * size}`](at, value, true);
      }
    },
    // JSON has no infinite numbers and no NaN.
    view: (value) => (Number.isFinite(value) ? shortest(value) : String(value)),
    initial: () => 0,
  };
  return Object.freeze(layout);
}

/** The shortest decimal of a number of four octets: 0.1, not 0.10000000149011612. */
function shortestSingle(value) {
  for (let digits = 1; digits < 10; digits++) {
    const decimal = Number(value.toPrecision(digits));
    if (Math.fround(decimal) === value) return decimal;
  }
  return value;
}

export const u8 = integer("unsigned byte", 1, "Uint8", 0, 0xff);
export const u16 = integer("unsigned short integer", 2, "Uint16", 0, 0xffff);
export const u32 = integer("unsigned integer", 4, "Uint32", 0, 0xffffffff);
export const u64 = bigInteger("unsigned long integer", "BigUint64", 0n, 2n ** 64n - 1n);
export const i8 = integer("byte", 1, "Int8", -0x80, 0x7f);
export const i16 = integer("short integer", 2, "Int16", -0x8000, 0x7fff);
export const i32 = integer("integer", 4, "Int32", -0x80000000, 0x7fffffff);
export const i64 = bigInteger("long integer", "BigInt64", -(2n ** 63n), 2n ** 63n - 1n);
export const f32 = real("float", 4, "Float32", "Uint32", 0x7fc00000, shortestSingle);
export const f64 = real("long float", 8, "Float64", "BigUint64", 0x7ff8000000000000n, (value) => value);

/** The named values of a number. */
export const values = (names) => Object.freeze(names);

// Scaled integers

const halfSteps = {
  round: (raw) => 2n * raw - 1n,
  floor: (raw) => 2n * raw,
  ceiling: (raw) => 2n * raw - 2n,
};

/** A finite number as mantissa * 2^exponent. */
function fraction(number) {
  const data = new DataView(new ArrayBuffer(8));
  data.setFloat64(0, number);
  const bits = data.getBigUint64(0);
  const biased = (bits >> 52n) & 0x7ffn;
  const magnitude = (bits & 0xfffffffffffffn) | (biased === 0n ? 0n : 1n << 52n);
  return [bits >> 63n ? -magnitude : magnitude, biased === 0n ? 1n : biased];
}

/** The exact sign of a sum of products of integers and real numbers. */
function signOfSum(terms) {
  const fractions = terms.map(([factor, number]) => [factor, ...fraction(number)]);
  const least = fractions.reduce((least, [, , e]) => (e < least ? e : least), fractions[0][2]);
  const sum = fractions.reduce((sum, [factor, m, e]) => sum + ((factor * m) << (e - least)), 0n);
  return sum > 0n ? 1 : sum < 0n ? -1 : 0;
}

/**
 * A real number in a range, spread evenly over an integer: raw * (upper - lower) / (2^n - 1) +
 * lower. The 0 of a signed integer is the centre of the range, its least integer one step below.
 */
export class Scaled {
  constructor(raw) {
    this.raw = raw;
    Object.freeze(this);
  }

  /** The value for the nearest integer, rounded exactly. */
  static of(real) {
    const count = this.count(real);
    if (count === undefined) {
      throw new OutOfRange(this.field, real, this.lower, this.upper, this.units);
    }
    return new this(count + this.number.least);
  }

  static fromRaw(raw) {
    if (!Number.isInteger(raw) || raw < this.number.least || raw > this.number.greatest) {
      throw new OutOfRange(this.field, raw, this.number.least, this.number.greatest, "one");
    }
    return new this(raw);
  }

  /** The number in the unit of the field. */
  get value() {
    return Math.min(this.constructor.real(this.raw), this.constructor.upper);
  }

  /** The decimal with the fewest digits that stands for the integer. */
  toJSON() {
    return this.constructor.shortest(this.raw);
  }

  toString() {
    return String(this.toJSON());
  }

  static get below() {
    return this.number.least < 0 ? 1 : 0;
  }

  /** Steps from the lower limit to the upper one. */
  static get steps() {
    return this.number.greatest - this.number.least - this.below;
  }

  static get step() {
    return (this.upper - this.lower) / this.steps;
  }

  static real(raw) {
    return (raw - this.number.least - this.below) * this.step + this.lower;
  }

  /** Steps from the least integer to that of a real number. */
  static count(real) {
    const { lower, upper, below, step, steps } = this;
    if (typeof real !== "number") return undefined;
    if (below > 0 && real < lower && real >= lower - 1.5 * step) {
      return this.reaches(real, 0) ? 1 : 0;
    }
    if (!(lower <= real && real <= upper)) return undefined;
    const guess = Math.min(Math.floor((real - lower) / step), steps);
    let [least, greatest] = [Math.max(guess - 2, 0), Math.min(guess + 2, steps)];
    if (least > 0 && !this.reaches(real, least)) least = 0;
    if (greatest < steps && this.reaches(real, greatest + 1)) greatest = steps;
    while (least < greatest) {
      const middle = greatest - Math.floor((greatest - least) / 2);
      if (this.reaches(real, middle)) least = middle;
      else greatest = middle - 1;
    }
    return least + below;
  }

  /** Whether the integer of a real number is this many steps above the lower limit, exactly. */
  static reaches(real, raw) {
    const twice = 2n * BigInt(this.steps);
    const half = halfSteps[this.rounding](BigInt(raw));
    const terms = [[twice, real], [half - twice, this.lower], [-half, this.upper]];
    return signOfSum(terms) >= (this.rounding === "ceiling" ? 1 : 0);
  }

  static shortest(raw) {
    const count = raw - this.number.least;
    const exact = this.real(raw);
    const encodesBack = (real) => this.count(real) === count;
    if (encodesBack(0)) return 0;
    // With floor and ceiling the exact value is the boundary of what encodes back.
    const inside = {
      round: exact,
      floor: Math.min(exact + this.step / 2, this.upper),
      ceiling: exact - this.step / 2,
    };
    for (const number of [exact, inside[this.rounding]]) {
      for (let digits = 1; digits <= 17; digits++) {
        for (const decimal of decimals(number, digits)) {
          const isNear = Math.abs(decimal - exact) <= 2 * this.step;
          if (isNear && encodesBack(decimal)) return decimal;
        }
      }
    }
    return exact;
  }

  static read(reader) {
    return new this(this.number.read(reader));
  }

  static write(writer, value) {
    const Type = value?.constructor;
    const isAlike = (key) => Type[key] === this[key];
    if (!(value instanceof Scaled && ["number", "lower", "upper", "rounding"].every(isAlike))) {
      throw expected(`${this.name}.of(number)`, value);
    }
    this.number.write(writer, value.raw);
  }

  static view(value) {
    return value.toJSON();
  }

  static initial() {
    return new this(0);
  }
}

/** The decimals with so many digits around a number, the nearer first. */
function decimals(number, digits) {
  const [mantissa, exponent] = Math.abs(number).toExponential(digits - 1).split("e");
  const whole = BigInt(mantissa.replace(".", ""));
  const power = Number(exponent) - (digits - 1);
  const decimal = (whole, power) => Number(`${number < 0 ? "-" : ""}${whole}e${power}`);
  const isLeast = whole === 10n ** BigInt(digits - 1);
  const nearest = decimal(whole, power);
  if (Math.abs(nearest) <= Math.abs(number)) return [nearest, decimal(whole + 1n, power)];
  // Below a power of ten, decimals are ten times as dense.
  return [nearest, isLeast ? decimal(whole * 10n - 1n, power - 1) : decimal(whole - 1n, power)];
}

export function scaled(name, number, field, lower, upper, units, rounding) {
  const Type = class extends Scaled {};
  return define(Type, name, { number, field, lower, upper, units, rounding });
}

function define(Type, name, properties) {
  for (const [key, value] of Object.entries({ name, ...properties })) {
    Object.defineProperty(Type, key, { value });
  }
  return Type;
}

// Bit fields

/** Several numbers in one unsigned integer. Bits outside them are preserved. */
export class Bits {
  constructor(init = {}) {
    this.raw = this.constructor.number.initial();
    assign(this, init);
  }

  static fromRaw(raw) {
    return new this({ raw });
  }

  toJSON() {
    return this.constructor.view(this);
  }

  static read(reader) {
    return this.fromRaw(this.number.read(reader));
  }

  static write(writer, value) {
    this.number.write(writer, ofType(this, value, "a bit field").raw);
  }

  static view(value) {
    const view = {};
    let reserved = BigInt(value.raw);
    for (const { name, from, mask } of this.parts) {
      view[name] = u64.view((BigInt(value.raw) >> from) & mask);
      reserved &= ~(mask << from);
    }
    if (reserved !== 0n) view._reserved = u64.view(reserved);
    return view;
  }

  static initial() {
    return new this();
  }
}

/** A part of a bit field. */
export const part = (key, name, from, to, lower, upper) => ({
  key, name, from: BigInt(from), lower, upper,
  mask: (1n << BigInt(to - from + 1)) - 1n,
  narrow: to - from < 32 ? Number : (part) => part,
});

export function bits(name, number, parts) {
  const Type = class extends Bits {};
  const store = number.size === 8 ? (raw) => raw : Number;
  for (const { key, name, from, mask, narrow, lower, upper } of parts) {
    Object.defineProperty(Type.prototype, key, {
      get() {
        return narrow((BigInt(this.raw) >> from) & mask);
      },
      set(value) {
        const is = typeof value === "bigint" || Number.isInteger(value);
        if (!is || value < lower || value > upper) {
          throw new OutOfRange(name, value, lower, upper, "one");
        }
        this.raw = store((BigInt(this.raw) & ~(mask << from)) | (BigInt(value) << from));
      },
    });
  }
  return define(Type, name, { number, parts });
}

// Octets

const decoder = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });
const encoder = new TextEncoder();

/** Text, or octets that are not UTF-8. */
function textOf(octets) {
  try {
    return decoder.decode(octets);
  } catch {
    return octets;
  }
}

function octetsOf(value) {
  if (value instanceof Uint8Array) return value;
  if (typeof value !== "string") throw expected("a string or a Uint8Array", value);
  if (/\p{Surrogate}/u.test(value)) throw new EncodeError("text", "half of a surrogate pair");
  return encoder.encode(value);
}

const viewOfText = (value) => (typeof value === "string" ? value : { hex: hex(value) });

export const hex = (octets) =>
  Array.from(octets, (octet) => octet.toString(16).padStart(2, "0")).join("");

export const text = (number, min, max) => ({
  read: (reader) => textOf(reader.slice(reader.count(number, min, max))),
  write(writer, value) {
    const octets = octetsOf(value);
    writer.count(number, min, max, octets.length);
    writer.append(octets);
  },
  view: viewOfText,
  initial: () => "",
});

export const fixedText = (length) => ({
  read(reader) {
    const octets = reader.slice(length);
    let end = length;
    while (end > 0 && octets[end - 1] === 0) end--;
    return textOf(octets.slice(0, end));
  },
  write(writer, value) {
    const octets = octetsOf(value);
    if (octets.length > length) {
      const problem = `${octets.length} octets of text in a field of ${length}`;
      throw new EncodeError("tooLong", problem);
    }
    writer.append(octets);
    writer.append(new Uint8Array(length - octets.length));
  },
  view: viewOfText,
  initial: () => "",
});

export const blob = (number, min, max) => ({
  read: (reader) => reader.slice(reader.count(number, min, max)),
  write(writer, value) {
    if (!(value instanceof Uint8Array)) throw expected("a Uint8Array", value);
    writer.count(number, min, max, value.length);
    writer.append(value);
  },
  view: hex,
  initial: () => new Uint8Array(0),
});

export function formatted(number, min, max) {
  const data = blob(number, min, max);
  return {
    read: (reader) => ({ format: u8.read(reader), data: data.read(reader) }),
    write(writer, value) {
      u8.write(writer, value?.format);
      data.write(writer, value.data);
    },
    view: (value) => ({ format: value.format, data: hex(value.data) }),
    initial: () => ({ format: 0, data: data.initial() }),
  };
}

// Composites

export const list = (number, min, max, layout) => ({
  read: (reader) => reader.elements(reader.count(number, min, max), layout),
  write(writer, value) {
    if (!Array.isArray(value)) throw expected("an array", value);
    writer.count(number, min, max, value.length);
    writer.elements(value, layout);
  },
  view: (value) => value.map((one) => layout.view(one)),
  initial: () => [],
});

/** Nested arrays; the first dimension varies fastest on the wire. */
export function array(dimensions, layout) {
  const total = dimensions.reduce((product, size) => product * size, 1);
  const nest = (one, [size, ...inner], stride = 1, first = 0) =>
    size === undefined
      ? one(first)
      : Array.from({ length: size }, (_, i) => nest(one, inner, stride * size, first + i * stride));
  const flatten = (value, [size, ...inner], put, stride = 1, first = 0) => {
    if (size === undefined) return put(first, value);
    if (!Array.isArray(value)) throw expected("an array", value);
    if (value.length !== size) {
      const problem = `${value.length} slots, but the definition has ${size}`;
      throw new EncodeError("slots", problem);
    }
    value.forEach((it, i) => flatten(it, inner, put, stride * size, first + i * stride));
  };
  return {
    read(reader) {
      const elements = reader.elements(total, layout);
      return nest((index) => elements[index], dimensions);
    },
    write(writer, value) {
      const elements = [];
      flatten(value, dimensions, (index, one) => (elements[index] = one));
      writer.elements(elements, layout);
    },
    view(value) {
      const elements = [];
      flatten(value, dimensions, (index, one) => (elements[index] = layout.view(one)));
      return nest((index) => elements[index], dimensions);
    },
    initial: () => nest(() => layout.initial(), dimensions),
  };
}

/** An alternative of a variant. */
export const alternative = (kind, name, layout) => ({ kind, name, layout });

export function variant(number, alternatives) {
  const find = (kind) => alternatives.findIndex((it) => it.kind === kind);
  const count = alternatives.length;
  const none = (tag) => `tag ${tag} selects none of the variant's ${count} alternatives`;
  return {
    read(reader) {
      const offset = reader.at;
      const tag = number.read(reader);
      const chosen = alternatives[Number(tag)];
      if (chosen === undefined) {
        if (count === 0 && Number(tag) === 0) return {};
        throw new DecodeError("tag", none(tag), offset);
      }
      const { kind, name, layout } = chosen;
      return { kind, value: member(name, () => layout.read(reader)) };
    },
    write(writer, value) {
      if (count === 0) return number.write(writer, 0);
      const tag = find(value?.kind);
      if (tag < 0) throw new EncodeError("tag", none(`"${value?.kind}"`));
      const { name, layout } = alternatives[tag];
      number.write(writer, tag);
      member(name, () => layout.write(writer, value.value));
    },
    view(value) {
      const chosen = alternatives[find(value.kind)];
      return chosen === undefined ? {} : { [chosen.name]: chosen.layout.view(value.value) };
    },
    initial() {
      if (count === 0) return {};
      const { kind, layout } = alternatives[0];
      return { kind, value: layout.initial() };
    },
  };
}

/** A type and unit of a measure. */
export const choice = (kind, index, units, layout) => ({ kind, index, units, layout });

export function measure(choices) {
  const none = (index) => `index ${index} selects none of the field's types and units`;
  return {
    read(reader) {
      const offset = reader.at;
      const index = u8.read(reader);
      const chosen = choices.find((it) => it.index === index);
      if (chosen === undefined) throw new DecodeError("index", none(index), offset);
      return { kind: chosen.kind, value: chosen.layout.read(reader) };
    },
    write(writer, value) {
      const chosen = choices.find((it) => it.kind === value?.kind);
      if (chosen === undefined) throw new EncodeError("index", none(`"${value?.kind}"`));
      u8.write(writer, chosen.index);
      chosen.layout.write(writer, value.value);
    },
    view(value) {
      const { index, units, layout } = choices.find((it) => it.kind === value.kind);
      return { index, units, value: layout.view(value.value) };
    },
    initial: () => ({ kind: choices[0].kind, value: choices[0].layout.initial() }),
  };
}

// Records and messages

/** A member of a record. A scaled integer also has an accessor in its unit. */
export const required = (key, name, layout, inUnits) => ({ key, name, layout, inUnits });
export const optional = (key, name, layout, inUnits) => ({
  key, name, layout, inUnits, isOptional: true,
});

/** A record or sequence. */
export class Record {
  constructor(init = {}) {
    for (const { key, layout, isOptional } of this.constructor.members) {
      this[key] = isOptional ? undefined : layout.initial();
    }
    assign(this, init);
  }

  toJSON() {
    return this.constructor.view(this);
  }

  static read(reader) {
    const record = Object.create(this.prototype);
    let present = this.presence === null ? 0n : this.readPresence(reader);
    for (const it of this.members) {
      let isPresent = true;
      if (it.isOptional) {
        isPresent = (present & 1n) === 1n;
        present >>= 1n;
      }
      record[it.key] = isPresent ? this.inside(it, () => it.layout.read(reader)) : undefined;
    }
    return record;
  }

  static readPresence(reader) {
    const offset = reader.at;
    const vector = BigInt(this.presence.read(reader));
    const count = this.members.filter((it) => it.isOptional).length;
    const undefinedBits = (vector >> BigInt(count)) << BigInt(count);
    if (undefinedBits !== 0n) {
      const [all, excess] = [vector, undefinedBits].map((bits) => bits.toString(16));
      const problem = `presence vector 0x${all} has undefined bits 0x${excess}`;
      throw new DecodeError("presence", problem, offset);
    }
    return vector;
  }

  static write(writer, value) {
    const record = ofType(this, value, "a record or sequence");
    if (this.presence !== null) {
      const optional = this.members.filter((it) => it.isOptional);
      const bit = (vector, it, i) => vector | (record[it.key] === undefined ? 0n : 1n << BigInt(i));
      const vector = optional.reduce(bit, 0n);
      this.presence.write(writer, this.presence.size === 8 ? vector : Number(vector));
    }
    for (const it of this.members) {
      const content = record[it.key];
      if (content !== undefined) {
        this.inside(it, () => it.layout.write(writer, content));
      } else if (!it.isOptional) {
        throw new EncodeError("missing", "the member is required").inMember(it.name);
      }
    }
  }

  static view(value) {
    if (this.isWhole) {
      const [{ key, layout }] = this.members;
      return layout.view(value[key]);
    }
    const record = ofType(this, value, "a record or sequence");
    const present = this.members.filter((it) => record[it.key] !== undefined);
    return Object.fromEntries(present.map((it) => [it.name, it.layout.view(record[it.key])]));
  }

  static initial() {
    return new this();
  }

  /** The parts of a message are not in the path of an error, members are. */
  static inside(it, act) {
    return this.hasParts ? act() : member(it.name, act);
  }
}

function assign(target, init) {
  for (const [key, value] of Object.entries(init)) {
    if (!(key in target)) throw new TypeError(`${target.constructor.name} has no member ${key}`);
    target[key] = value;
  }
}

/** A value of a class, which may be given as a plain object. */
function ofType(Type, value, what) {
  if (value instanceof Type) return value;
  if (typeof value !== "object" || value === null) throw expected(what, value);
  return new Type(value);
}

function withMembers(Type, name, presence, members) {
  for (const { key, layout, inUnits } of members.filter((it) => it.inUnits !== undefined)) {
    Object.defineProperty(Type.prototype, inUnits, {
      get() {
        return this[key]?.value;
      },
      set(value) {
        this[key] = value === undefined ? undefined : layout.of(value);
      },
    });
  }
  return define(Type, name, { presence, members });
}

export const record = (name, presence, members) =>
  withMembers(class extends Record {}, name, presence, members);

/** A message. */
export class Message extends Record {
  static decode(octets) {
    const reader = new Reader(octetsIn(octets));
    try {
      const found = u16.read(reader);
      if (found !== this.code) {
        const problem = `message code ${code(found)}, expected ${code(this.code)}`;
        throw new DecodeError("code", problem, 0);
      }
      const message = this.read(reader);
      if (reader.left > 0) {
        const problem = `octets after the end of the message: ${reader.left}`;
        throw new DecodeError("trailing", problem, reader.at);
      }
      if (reader.nans.size > 0) nansOf.set(message, reader.nans);
      return message;
    } catch (error) {
      throw error instanceof CodecError ? error.inMessage(this.messageName) : error;
    }
  }

  encode() {
    const Type = this.constructor;
    const writer = new Writer(nansOf.get(this));
    try {
      u16.write(writer, Type.code);
      Type.write(writer, this);
      return writer.octets.slice(0, writer.at);
    } catch (error) {
      throw error instanceof CodecError ? error.inMessage(Type.messageName) : error;
    }
  }
}

/** The unusual NaNs of decoded messages. */
const nansOf = new WeakMap();

const code = (number) => `${number.toString(16).toUpperCase().padStart(4, "0")}h`;

function octetsIn(octets) {
  if (octets instanceof Uint8Array) return octets;
  if (ArrayBuffer.isView(octets)) {
    return new Uint8Array(octets.buffer, octets.byteOffset, octets.byteLength);
  }
  if (octets instanceof ArrayBuffer) return new Uint8Array(octets);
  throw new TypeError("a message is a Uint8Array, a DataView or an ArrayBuffer");
}

/** The content of a message: members of its body; one list or variant; header, body and footer. */
export const body = (presence, members) => ({ presence, members });
export const whole = (it) => ({ presence: null, members: [it], hasParts: true, isWhole: true });
export const sections = (members) => ({ presence: null, members, hasParts: true });

export function message(info, types, { presence, members, ...parts }) {
  const Type = withMembers(class extends Message {}, info.messageName, presence, members);
  return define(Type, info.messageName, { ...info, ...types, ...parts });
}

export const messages = (types) => Object.freeze(types);

/** The code of a message; undefined if there are fewer than two octets. */
export function codeOf(octets) {
  const all = octetsIn(octets);
  return all.length < 2 ? undefined : all[0] | (all[1] << 8);
}

/** Decodes a message with the first of these types that fits. */
export function decode(types, octets) {
  const found = codeOf(octets);
  let problem = new DecodeError("code", "no type has the code of the message", 0);
  problem.inMessage(found === undefined ? "no message" : code(found));
  for (const Type of types.filter((Type) => Type.code === found).reverse()) {
    try {
      return Type.decode(octets);
    } catch (error) {
      if (!(error instanceof DecodeError)) throw error;
      problem = error;
    }
  }
  throw problem;
}
