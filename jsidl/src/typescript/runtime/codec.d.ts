// Types of codec.js, written by `jaus jsidl typescript`.

/** Raw octets. */
export type Octets = Uint8Array;

/** Text, or octets that are not UTF-8. */
export type Text = string | Uint8Array;

/** The members to set in a new object; the others keep their initial values. */
export type Init<T> = Partial<T>;

/** Octets in one of several formats. */
export interface Formatted {
  /** The format's index; unknown ones are preserved. */
  format: number;
  data: Octets;
}

/** The problem of octets or of a message. */
export type Kind =
  | "code" | "count" | "emptyElements" | "index" | "missing" | "number" | "presence" | "short"
  | "slots" | "tag" | "text" | "tooLong" | "trailing" | "type";

interface CodecError extends Error {
  readonly kind: Kind;
  readonly messageName: string;
  /** The way to the field in the names of the definition, such as `NodeList[2].NodeID`. */
  readonly path: string;
  readonly problem: string;
}

/** Octets that are not a message of the type. */
export class DecodeError extends Error implements CodecError {
  private constructor();
  readonly kind: Kind;
  readonly messageName: string;
  readonly path: string;
  readonly problem: string;
  /** The octet at which the field begins, from 0. */
  readonly offset: number;
}

/** A message that its definition cannot express. */
export class EncodeError extends Error implements CodecError {
  private constructor();
  readonly kind: Kind;
  readonly messageName: string;
  readonly path: string;
  readonly problem: string;
}

/** A number outside the range of a field. */
export class OutOfRange extends RangeError {
  private constructor();
  readonly field: string;
  readonly value: number | bigint;
  readonly lower: number | bigint;
  readonly upper: number | bigint;
  readonly units: string;
}

/** A real number in a range, carried as an integer. Immutable. */
export abstract class Scaled {
  /** The value for the nearest integer. Throws OutOfRange. */
  static of<T extends Scaled>(this: { prototype: T }, real: number): T;
  /** The value of an integer. Throws OutOfRange if the type of the field cannot hold it. */
  static fromRaw<T extends Scaled>(this: { prototype: T }, raw: number): T;
  static readonly lower: number;
  static readonly upper: number;
  static readonly units: string;
  /** The integer on the wire. */
  readonly raw: number;
  /** The number in the unit of the field. */
  readonly value: number;
  /** The decimal with the fewest digits that stands for the integer. */
  toJSON(): number;
}

/** Several numbers in one unsigned integer; bits outside them are preserved. */
export abstract class Bits<Raw extends number | bigint> {
  static fromRaw<T>(this: new (...init: any) => T, raw: number | bigint): T;
  /** The integer on the wire. */
  raw: Raw;
  toJSON(): unknown;
}

/** A record or sequence. */
export abstract class Record {
  /** The view that `jaus decode` prints; integers from 2^53 are text. */
  toJSON(): unknown;
}

/** A message. */
export abstract class Message extends Record {
  static readonly code: number;
  static readonly messageName: string;
  /** Whether only the controlling client may send it. */
  static readonly isCommand: boolean;
  /** The declaring services, such as `urn:jaus:jss:core:Discovery 1.0`. */
  static readonly services: readonly string[];
  /** Decodes a whole message from its code to its last octet. Throws DecodeError. */
  static decode<T extends Message>(
    this: new (...init: any) => T,
    octets: Uint8Array | DataView | ArrayBuffer,
  ): T;
  /** Throws EncodeError. */
  encode(): Uint8Array;
}

/** The class of a message. */
export interface MessageType {
  new (init?: object): Message;
  readonly code: number;
  readonly messageName: string;
  readonly isCommand: boolean;
  readonly services: readonly string[];
  decode(octets: Uint8Array | DataView | ArrayBuffer): Message;
}

/** The code of a message; undefined if there are fewer than two octets. */
export function codeOf(octets: Uint8Array | DataView | ArrayBuffer): number | undefined;

/** Decodes a message with the newest of these types that fits. Throws DecodeError. */
export function decode(
  types: readonly MessageType[],
  octets: Uint8Array | DataView | ArrayBuffer,
): Message;

/** Octets as hexadecimal digits. */
export function hex(octets: Uint8Array): string;
