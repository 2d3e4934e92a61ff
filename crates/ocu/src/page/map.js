// The map: geographic map, raster, zones, obstacles, grid, trail, planned path, destination and vehicle on a
// canvas that is moved by one finger, zoomed by two, and tapped to choose a destination. X of the local frame is up, Y right.

import { BaseMap, degreesOf } from "./basemap.js";
import { figure, get, list, mark, metres, number, say, show } from "./dom.js";
import { Overlay, paintScan, paintZones } from "./overlay.js";
import { Painter } from "./painter.js";
import { Raster } from "./raster.js";

const SMALLEST_SCALE = 0.05;
const LARGEST_SCALE = 400;
const TRAIL = 2_000;
/** A pointer that moves less, in pixels, taps. */
const TAP = 9;

export class MapView {
  #canvas = get("map");
  #context = this.#canvas.getContext("2d");
  #raster = new Raster(null);
  #base = new BaseMap(() => this.#draw());
  #overlay;
  #camera = { x: 0, y: 0, scale: 24 };
  /** What the first view shows: `raster`, `vehicle`, or nothing yet. */
  #placed = "";
  /** Whether the operator has chosen what is seen, so that a turned screen leaves it alone. */
  #chosen = false;
  #following = true;
  #pointers = new Map();
  #tap = null;
  #trail = [];
  #path = [];
  #over = false;
  #pose = null;
  #poseFresh = false;
  #destination = null;
  #draft = null;
  #vehicle = null;
  #drawn = 0;
  #pick;
  #colours = {};

  /** Calls `pick` with {x, y} in metres when the operator taps a place. Asks the station with `ask`. */
  constructor(pick, ask) {
    this.#pick = pick;
    this.#overlay = new Overlay(ask);
    new ResizeObserver(() => this.#resize()).observe(this.#canvas);
    this.#listen();
    this.recolour();
  }

  /** Takes a state, and whether it is live. */
  update(state, live, token) {
    const vehicle = state.vehicle;
    if (vehicle?.subsystem !== this.#vehicle) {
      this.#vehicle = vehicle?.subsystem;
      this.#trail = [];
      this.#raster = new Raster(this.#vehicle);
      this.#placed = "";
      this.#chosen = false;
    }
    this.#base.update(vehicle?.place, token);
    const isKnown = (pose) => metres(pose?.x) !== null && metres(pose?.y) !== null;
    // Without a local pose, the global one has the frame for itself.
    const pose = isKnown(vehicle?.pose) ? vehicle.pose : vehicle?.place?.fix;
    const known = isKnown(pose);
    this.#pose = known ? { x: pose.x, y: pose.y, yaw: number(pose.yaw) } : null;
    this.#poseFresh = live && known && pose.age_ms < 1_000;
    if (known) this.#extendTrail(pose);
    const mission = state.mission;
    this.#path = list(mission?.path).filter((p) => metres(p?.[0]) !== null && metres(p?.[1]) !== null);
    this.#over = ["failed", "stopped", "idle"].includes(mission?.stage);
    const [x, y] = list(mission?.destination);
    const isGiven = mission?.stage !== "idle" && metres(x) !== null && metres(y) !== null;
    this.#destination = isGiven ? { x, y } : null;
    this.#raster.update(state.map, token, () => this.#draw());
    this.#overlay.update(state, live, token, () => this.#draw());
    this.#overlay.showNote();
    const empty = get("map-empty");
    show(empty, !this.#raster.picture && !this.#base.shown);
    say(empty, this.#raster.problem || "Waiting for the map");
    this.#place();
    if (this.#following) this.#follow();
    this.#draw();
  }

  /** The connection is new: what was fetched may be of another station. */
  reconnect() {
    this.#overlay.reset();
  }

  /** Takes whether the station has a map file. */
  offerBaseMap(offered) {
    this.#base.offer(offered);
  }

  /** The place that the operator chose and that no mission has yet, or null. */
  set draft(place) {
    this.#draft = place;
    this.#draw();
  }

  /** Whether a place can be driven on, as far as the map knows: false, true, or null outside. */
  passable(place) {
    const value = this.#raster.at(place.x, place.y);
    return value === null ? null : value > 0;
  }

  /** Reads the colours again, after the style has changed. */
  recolour() {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["ground", "grid", "grid-strong", "trail", "path", "destination", "vehicle", "vehicle-edge", "stale", "ink", "halo", "zone", "zone-out", "obstacle"]) {
      this.#colours[name] = style.getPropertyValue(`--map-${name}`).trim();
    }
    for (const name of ["land", "green", "landuse", "water", "building", "other", "road", "opacity", "cells"]) {
      this.#colours[`base-${name}`] = style.getPropertyValue(`--base-${name}`).trim();
    }
    this.#raster.paint(() => {});
    this.#draw();
  }

  #extendTrail({ x, y }) {
    const last = this.#trail.at(-1);
    const far = last ? Math.hypot(x - last.x, y - last.y) : Infinity;
    if (far < 0.1) return;
    // A vehicle does not jump: its reckoning has begun anew.
    if (last && far > 25) this.#trail = [];
    this.#trail.push({ x, y });
    if (this.#trail.length > TRAIL) this.#trail.splice(0, TRAIL / 4);
  }

  // Where things are.

  get #size() {
    return { width: this.#canvas.clientWidth, height: this.#canvas.clientHeight };
  }

  #toScreen({ x, y }) {
    const { width, height } = this.#size;
    const { x: north, y: east, scale } = this.#camera;
    return [width / 2 + (y - east) * scale, height / 2 - (x - north) * scale];
  }

  #toWorld(px, py) {
    const { width, height } = this.#size;
    const { x, y, scale } = this.#camera;
    return { x: x - (py - height / 2) / scale, y: y + (px - width / 2) / scale };
  }

  /** The first view: the whole map, or else the surroundings of the vehicle until the map is known. */
  #place() {
    const wanted = this.#raster.info ? "raster" : this.#pose ? "vehicle" : "";
    if (!wanted || this.#placed === wanted || this.#placed === "raster") return;
    const isFree = !this.#placed || !this.#chosen;
    this.#placed = wanted;
    if (isFree) this.#showAll();
  }

  /** The whole map; without one, the surroundings of the vehicle. */
  #showAll() {
    const { width, height } = this.#size;
    const info = this.#raster.info;
    if (!width || !height) return;
    if (!info) {
      if (this.#pose) Object.assign(this.#camera, { x: this.#pose.x, y: this.#pose.y, scale: 24 });
      this.#chosen = false;
      return this.#draw();
    }
    const [tall, wide] = [info.rows * info.cell_m, info.columns * info.cell_m];
    this.#chosen = false;
    this.#camera = {
      x: info.x + tall / 2,
      y: info.y + wide / 2,
      scale: clampScale(Math.min((width - 48) / wide, (height - 48) / tall)),
    };
    this.#draw();
  }

  /** Keeps the vehicle in the middle half of the view. */
  #follow() {
    if (!this.#pose) return;
    const { width, height } = this.#size;
    const { scale } = this.#camera;
    const [reachX, reachY] = [height / scale / 4, width / scale / 4];
    this.#camera.x = clamp(this.#camera.x, this.#pose.x - reachX, this.#pose.x + reachX);
    this.#camera.y = clamp(this.#camera.y, this.#pose.y - reachY, this.#pose.y + reachY);
  }

  #setFollowing(following) {
    this.#following = following;
    mark(get("follow"), "aria-pressed", String(following));
    if (following && this.#pose) Object.assign(this.#camera, { x: this.#pose.x, y: this.#pose.y });
    this.#draw();
  }

  /** Zooms about a place of the screen, which stays where it is. */
  #zoom(factor, px = this.#size.width / 2, py = this.#size.height / 2) {
    this.#chosen = true;
    const fixed = this.#toWorld(px, py);
    this.#camera.scale = clampScale(this.#camera.scale * factor);
    const moved = this.#toWorld(px, py);
    this.#camera.x += fixed.x - moved.x;
    this.#camera.y += fixed.y - moved.y;
    this.#draw();
  }

  // Fingers, mouse and keys.

  #listen() {
    const canvas = this.#canvas;
    canvas.addEventListener("pointerdown", (event) => this.#pointerDown(event));
    canvas.addEventListener("pointermove", (event) => this.#pointerMove(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.#pointerUp(event));
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.#zoom(Math.exp(-clamp(event.deltaY, -100, 100) / 300), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("pointerleave", () => this.#readout(null));
    get("zoom-in").addEventListener("click", () => this.#zoom(1.5));
    get("zoom-out").addEventListener("click", () => this.#zoom(1 / 1.5));
    get("zoom-all").addEventListener("click", () => {
      this.#setFollowing(false);
      this.#showAll();
    });
    get("follow").addEventListener("click", () => this.#setFollowing(!this.#following));
  }

  /** A key that has no other use; true if it was for the map. */
  key(key) {
    switch (key) {
      case "+": case "=": this.#zoom(1.5); return true;
      case "-": this.#zoom(1 / 1.5); return true;
      case "0": get("zoom-all").click(); return true;
      case "f": this.#setFollowing(!this.#following); return true;
    }
    return false;
  }

  #pointerDown(event) {
    if (event.button > 0) return;
    this.#canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    this.#tap = this.#pointers.size === 1 ? [event.offsetX, event.offsetY] : null;
  }

  #pointerMove(event) {
    const to = [event.offsetX, event.offsetY];
    this.#readout(this.#toWorld(...to));
    const from = this.#pointers.get(event.pointerId);
    if (!from) return;
    if (this.#tap && Math.hypot(to[0] - this.#tap[0], to[1] - this.#tap[1]) < TAP) return;
    this.#tap = null;
    this.#chosen = true;
    const before = spread([...this.#pointers.values()]);
    this.#pointers.set(event.pointerId, to);
    const after = spread([...this.#pointers.values()]);
    this.#camera.x += (after.y - before.y) / this.#camera.scale;
    this.#camera.y -= (after.x - before.x) / this.#camera.scale;
    if (this.#following) this.#setFollowingOff();
    if (before.size > 0 && after.size > 0) this.#zoom(after.size / before.size, after.x, after.y);
    this.#draw();
  }

  #setFollowingOff() {
    this.#following = false;
    mark(get("follow"), "aria-pressed", "false");
  }

  #pointerUp(event) {
    if (!this.#pointers.delete(event.pointerId)) return;
    if (this.#tap && event.type === "pointerup") this.#pick(this.#toWorld(...this.#tap));
    this.#tap = null;
  }

  #readout(place) {
    const element = get("map-readout");
    show(element, place !== null);
    if (!place) return;
    const frame = this.#base.frame;
    const degrees = frame ? `  ${degreesOf(frame.toGlobal(place))}` : "";
    say(element, `North ${figure(place.x, 1)}  East ${figure(place.y, 1)} m${degrees}`);
  }

  // Drawing.

  #resize() {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const { width, height } = this.#size;
    this.#canvas.width = Math.max(1, Math.round(width * ratio));
    this.#canvas.height = Math.max(1, Math.round(height * ratio));
    if (!this.#chosen) this.#showAll();
    this.#draw();
  }

  #draw() {
    if (this.#drawn) return;
    this.#drawn = requestAnimationFrame(() => {
      this.#drawn = 0;
      this.#paint();
    });
  }

  #paint() {
    const context = this.#context;
    const { width, height } = this.#size;
    const ratio = this.#canvas.width / Math.max(1, width);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = this.#colours.ground;
    context.fillRect(0, 0, width, height);
    this.#paintBaseMap(width, height);
    this.#paintRaster();
    const overlay = this.#overlay.content;
    const toScreen = (place) => this.#toScreen(place);
    paintZones(context, overlay, toScreen, { width, height }, this.#colours);
    const painter = new Painter(context, this.#colours, toScreen, this.#camera.scale);
    painter.grid(width, height, this.#toWorld(0, 0), this.#toWorld(width, height));
    paintScan(context, overlay, toScreen, this.#camera.scale, this.#colours);
    context.globalAlpha = this.#over ? 0.4 : 1;
    painter.line(this.#path.map(([x, y]) => ({ x, y })), "path", 5, []);
    context.globalAlpha = 1;
    painter.line(this.#trail, "trail", 3, [1, 6]);
    if (this.#destination) painter.pin(this.#destination, true);
    if (this.#draft) painter.pin(this.#draft, false);
    if (this.#pose) painter.vehicle(this.#pose, this.#poseFresh);
    painter.scale(height);
    painter.north(width, this.#base.frame?.heading ?? 0);
  }

  #paintBaseMap(width, height) {
    const view = {
      width,
      height,
      scale: this.#camera.scale,
      toWorld: (px, py) => this.#toWorld(px, py),
      toScreen: (place) => this.#toScreen(place),
    };
    this.#base.paint(this.#context, view, this.#colours);
    const note = get("map-source");
    show(note, this.#base.note !== "");
    say(note, this.#base.note);
  }

  #paintRaster() {
    const { picture, info } = this.#raster;
    if (!picture) return;
    const [left, bottom] = this.#toScreen(info);
    const { scale } = this.#camera;
    const [wide, tall] = [info.columns * info.cell_m * scale, info.rows * info.cell_m * scale];
    this.#context.imageSmoothingEnabled = info.cell_m * scale < 1;
    if (this.#base.shown) this.#context.globalAlpha = Number(this.#colours["base-cells"]) || 1;
    this.#context.drawImage(picture, left, bottom - tall, wide, tall);
    this.#context.globalAlpha = 1;
    this.#context.strokeStyle = this.#colours["grid-strong"];
    this.#context.lineWidth = 1.5;
    this.#context.strokeRect(left, bottom - tall, wide, tall);
  }
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const clampScale = (scale) => clamp(scale, SMALLEST_SCALE, LARGEST_SCALE);

/** The middle of pointers, and how far apart they are (0 for one). */
function spread(places) {
  const x = places.reduce((sum, place) => sum + place[0], 0) / places.length;
  const y = places.reduce((sum, place) => sum + place[1], 0) / places.length;
  const size = places.length > 1 ? Math.hypot(places[0][0] - places[1][0], places[0][1] - places[1][1]) : 0;
  return { x, y, size };
}
