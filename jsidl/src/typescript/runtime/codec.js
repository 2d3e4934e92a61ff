// Codec of generated JAUS messages, written by `jaus jsidl typescript`. No dependencies; runs in pages
// and in Node.js.
//
// A layout is an object with four functions: read(reader), write(writer, value), view(value) and
// initial(). The classes of records, scaled integers and bit fields are layouts themselves.
// Decoding is strict about the layout and preserves all values: encoding gives the same octets.

import {
  CodecError, DecodeError, EncodeError, expected, member, OutOfRange, Reader, u16, u64, u8, Writer,
} from "./codec/numbers.js";
import { define } from "./codec/scaled.js";

export {
  DecodeError, EncodeError, f32, f64, i16, i32, i64, i8, OutOfRange, u16, u32, u64, u8, values,
} from "./codec/numbers.js";
export { Scaled, scaled } from "./codec/scaled.js";

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
