// Errors, cursors over messages, and numbers; a part of codec.js, written by `jaus jsidl typescript`.

/** Elements without octets that one message may hold: their count alone takes no octets. */
const MOST_EMPTY_ELEMENTS = 4096;

/** Octets that are not a message, or a message that cannot be encoded. */
export class CodecError extends Error {
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

export function member(name, act) {
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
export class Reader {
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
export class Writer {
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

export function expected(what, found) {
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
