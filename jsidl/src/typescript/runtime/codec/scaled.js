// Scaled integers; a part of codec.js, written by `jaus jsidl typescript`.

import { expected, OutOfRange } from "./numbers.js";

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

/** Gives a class its name and constants. */
export function define(Type, name, properties) {
  for (const [key, value] of Object.entries({ name, ...properties })) {
    Object.defineProperty(Type, key, { value });
  }
  return Type;
}
