// Three ways to state a place: metres along X and Y of the vehicle's local frame, degrees on the globe
// (WGS 84), and fractions of the Web Mercator square that map tiles divide.

const SEMI_MAJOR_AXIS = 6_378_137;
const ECCENTRICITY_SQUARED = 6.694_379_990_14e-3;
/** Circumference of the Mercator sphere in metres. */
export const CIRCUMFERENCE = 2 * Math.PI * SEMI_MAJOR_AXIS;

const radians = (degrees) => (degrees * Math.PI) / 180;
const degrees = (angle) => (angle * 180) / Math.PI;
/** A longitude from -180 to 180. */
const wrapped = (longitude) => longitude - 360 * Math.round(longitude / 360);

/** A local frame, by the latitude and longitude of its origin and the direction of its X axis. */
export class LocalFrame {
  #origin;
  #meridian;
  #parallel;
  #sin;
  #cos;

  constructor({ latitude, longitude, heading }) {
    this.heading = heading;
    this.#origin = { latitude, longitude };
    const bulge = 1 - ECCENTRICITY_SQUARED * Math.sin(radians(latitude)) ** 2;
    const normal = SEMI_MAJOR_AXIS / Math.sqrt(bulge);
    // Metres per degree of latitude, and of longitude.
    this.#meridian = radians((normal * (1 - ECCENTRICITY_SQUARED)) / bulge);
    this.#parallel = radians(Math.max(1, normal * Math.cos(radians(latitude))));
    [this.#sin, this.#cos] = [Math.sin(heading), Math.cos(heading)];
  }

  /** The latitude and longitude of a place of the frame. */
  toGlobal({ x, y }) {
    const north = x * this.#cos - y * this.#sin;
    const east = x * this.#sin + y * this.#cos;
    const { latitude, longitude } = this.#origin;
    return { latitude: latitude + north / this.#meridian, longitude: wrapped(longitude + east / this.#parallel) };
  }

  /** The place of a latitude and longitude in the frame. */
  toLocal({ latitude, longitude }) {
    const north = (latitude - this.#origin.latitude) * this.#meridian;
    const east = wrapped(longitude - this.#origin.longitude) * this.#parallel;
    return { x: north * this.#cos + east * this.#sin, y: east * this.#cos - north * this.#sin };
  }
}

/** A place in the Mercator square: from west to east and from north to south, each 0 to 1. */
export function toMercator({ latitude, longitude }) {
  const sin = Math.sin(radians(latitude));
  return { u: (longitude + 180) / 360, v: 0.5 - Math.atanh(sin) / (2 * Math.PI) };
}

/** The latitude and longitude of a place in the Mercator square. */
export function fromMercator({ u, v }) {
  return { latitude: degrees(Math.asin(Math.tanh((0.5 - v) * 2 * Math.PI))), longitude: u * 360 - 180 };
}
