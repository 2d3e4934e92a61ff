// What lies over the map: operating zones, and what the range sensor sees. Zones are fetched when
// they have changed, scans at most twice a second.

import { get, list, metres, number, plain, say, show } from "./dom.js";
import { Pull } from "./pull.js";

const PERIOD = 500;
/** A scan that is older, in milliseconds, is drawn as old; one that is much older not at all. */
const OLD = 2_000;
const GONE = 30_000;
const MOST_ZONES = 64;
const MOST_VERTICES = 255;
const MOST_POINTS = 1_024;
/** Up to so many pixels the operating zone is dashed: the dashes outside of the screen cost as much as those on it. */
const LONGEST_DASHED = 20_000;

export class Overlay {
  #pull;
  #vehicle = null;
  #zonesRevision = 0;
  #scanRevision = 0;
  #zones = [];
  #problem = "";
  #scan = [];
  #obstacles = [];
  #cell = 0.25;
  /** Age of the scan by the latest state; null without one. */
  #age = null;

  /** Asks the station with `ask`, over the connection that is there: a request by HTTP takes 0.5 kB of the
   * way on which stops travel. */
  constructor(ask, pull = new Pull(PERIOD, (request) => asked(ask, request))) {
    this.#pull = pull;
  }

  /** Takes a state, and whether it is live; calls `changed` when there is something new to draw. */
  update(state, live, token, changed) {
    const vehicle = number(state?.vehicle?.subsystem);
    if (vehicle !== this.#vehicle) this.#forget(vehicle);
    const revision = state?.vehicle?.overlay;
    this.#age = live ? number(revision?.scan_age_ms) : GONE;
    if (vehicle === null || !live || !revision) return;
    const isNew = revision.zones !== this.#zonesRevision || revision.scan !== this.#scanRevision;
    if (!isNew) return;
    const request = { type: "overlay", zones: this.#zonesRevision };
    this.#pull.get(request, token, (overlay) => {
      this.#take(overlay);
      changed();
    });
  }

  /** Another station may count its revisions anew. */
  reset() {
    this.#forget(this.#vehicle);
  }

  /** What is to be drawn. */
  get content() {
    const seen = this.#age !== null && this.#age < GONE;
    return {
      zones: this.#zones,
      scan: seen ? this.#scan : [],
      obstacles: seen ? this.#obstacles : [],
      cell: this.#cell,
      old: this.#age === null || this.#age > OLD,
    };
  }

  /** Shows what of the zones cannot be drawn. */
  showNote() {
    const note = get("map-zones");
    show(note, this.#problem !== "");
    say(note, this.#problem);
  }

  #forget(vehicle) {
    this.#pull.forget();
    [this.#vehicle, this.#zonesRevision, this.#scanRevision] = [vehicle, 0, 0];
    [this.#zones, this.#scan, this.#obstacles, this.#problem] = [[], [], [], ""];
  }

  #take(overlay) {
    if (Array.isArray(overlay.zones)) {
      this.#zones = list(overlay.zones, MOST_ZONES)
        .map((zone) => ({ number: number(zone?.number) ?? 0, points: points(zone?.points, MOST_VERTICES) }))
        .filter((zone) => zone.points.length >= 3);
      this.#problem = problem(overlay);
    }
    this.#zonesRevision = number(overlay.zones_revision) ?? 0;
    this.#scanRevision = number(overlay.scan_revision) ?? 0;
    this.#scan = points(overlay.scan, MOST_POINTS);
    this.#obstacles = points(overlay.obstacles, MOST_POINTS);
    this.#cell = Math.min(Math.max(number(overlay.cell_m) ?? 0.25, 0.01), 10);
  }
}

async function asked(ask, request) {
  const content = await ask(request);
  return { ok: typeof content !== "string", json: async () => content };
}

function problem({ problem: why, omitted_zones: omitted }) {
  if (plain(why)) return `The vehicle's zones cannot be shown: ${plain(why, 160)}`;
  return number(omitted) > 0 ? `${omitted} further zones are not shown` : "";
}

const points = (value, most) =>
  list(value, most)
    .filter((point) => metres(point?.[0]) !== null && metres(point?.[1]) !== null)
    .map(([x, y]) => ({ x, y }));

/** Draws zones below the route: the outside of the operating zone and keep-out zones are shaded. */
export function paintZones(context, { zones }, toScreen, { width, height }, colours) {
  for (const { number: id, points: vertices } of zones) {
    context.beginPath();
    // The outside of the operating zone is what the vehicle must not enter.
    if (id === 1) context.rect(0, 0, width, height);
    outline(context, vertices, toScreen);
    context.fillStyle = colours["zone-out"];
    context.fill("evenodd");
    context.beginPath();
    outline(context, vertices, toScreen);
    context.lineJoin = "round";
    context.setLineDash(id === 1 && perimeter(vertices, toScreen) < LONGEST_DASHED ? [10, 6] : []);
    context.lineWidth = 2.5;
    context.strokeStyle = colours.zone;
    context.stroke();
    context.setLineDash([]);
  }
}

function perimeter(vertices, toScreen) {
  const pixels = vertices.map((vertex) => toScreen(vertex));
  return pixels.reduce((sum, [x, y], at) => sum + Math.hypot(x - pixels.at(at - 1)[0], y - pixels.at(at - 1)[1]), 0);
}

function outline(context, vertices, toScreen) {
  for (const [index, vertex] of vertices.entries()) {
    if (index) context.lineTo(...toScreen(vertex));
    else context.moveTo(...toScreen(vertex));
  }
  context.closePath();
}

/** Draws obstacles as squares, and the points of the last scan over them. */
export function paintScan(context, { scan, obstacles, cell, old }, toScreen, scale, colours) {
  context.fillStyle = old ? colours.stale : colours.obstacle;
  context.globalAlpha = 0.45;
  const side = Math.max(3, cell * scale);
  for (const middle of obstacles) {
    const [x, y] = toScreen(middle);
    context.fillRect(x - side / 2, y - side / 2, side, side);
  }
  context.globalAlpha = old ? 0.5 : 1;
  const size = Math.min(5, Math.max(2.5, 0.06 * scale));
  for (const point of scan) {
    const [x, y] = toScreen(point);
    context.fillRect(x - size / 2, y - size / 2, size, size);
  }
  context.globalAlpha = 1;
}
