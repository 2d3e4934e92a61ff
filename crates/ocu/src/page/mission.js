// The mission: its stages one after the other as the waterfall has them, progress, attempts and
// reasons; choosing a destination, approving and stopping.

import { duration, figure, get, list, make, mark, number, plain, say, show, words } from "./dom.js";

/** The stages as the protocol and as people name them. */
const STAGES = [
  ["map", "Map"],
  ["planning", "Planning"],
  ["awaiting_approval", "Approval"],
  ["path", "Path"],
  ["vector", "Vector"],
  ["primitive", "Primitive"],
  ["driving", "Driving"],
  ["arrived", "Arrived"],
];
/** The stages in which the planner has the drivers. */
const DRIVEN = ["path", "vector", "primitive", "driving"];
const OVER = ["idle", "arrived", "failed", "stopped", "lost"];

/** A planner reports its mission 4 times a second; an older report, in milliseconds, is marked as old. */
const OLD = 2_000;

/**
 * Why the mission does not go on. The planner keeps the reason of an earlier attempt while the next one
 * drives well; then only what holds the vehicle now counts.
 */
export function currentReason(stage, mission, vehicle) {
  const reason = plain(mission.reason, 255);
  if (!DRIVEN.includes(stage) || reason.startsWith("returns:")) return reason;
  const held = plain(vehicle?.held?.reason, 255);
  return held ? `held: ${held}` : "";
}

/** What became of a mission whose planner is lost, and what is left to the operator. */
function lostPlanner({ id, how, told_to_stop: stopped }) {
  const loss = `The planner ${plain(id, 16)} ${how === "restarted" ? "restarted while it drove" : `is ${plain(how, 10)}`}`;
  return stopped
    ? `${loss}. The vehicle was stopped: press Emergency stop if it still moves.`
    : `${loss}. This station does not control the drivers: press Emergency stop if the vehicle still moves.`;
}

export class Mission {
  #ask;
  #map;
  #stages = new Map();
  #mission = null;
  /** Whether this station has let the planner drive, and its mission is not over. */
  #isOurs = false;
  #furthest = { mission: null, index: -1 };
  #operable = false;
  /** Whether the vehicle has reported an emergency since a mission was under way, or may have before this page looked. */
  #hadEmergency = true;

  /** `ask` sends a request and shows a refusal; `map` shows the chosen place. */
  constructor(ask, map) {
    this.#ask = ask;
    this.#map = map;
    for (const [key, name] of STAGES) {
      const item = make("li", { "data-state": "ahead" }, make("span", { className: "stage-mark", "aria-hidden": "true" }), make("span", { className: "stage-name" }, name), make("span", { className: "visually-hidden" }));
      this.#stages.set(key, item);
    }
    get("stages").append(...this.#stages.values());
    get("approve").addEventListener("click", () => this.#ask({ type: "approve", mission: this.#mission?.mission }, "Mission approved"));
    get("continue").addEventListener("click", () => this.#ask({ type: "continue", mission: this.#mission?.mission }, "Mission continued"));
    get("stop").addEventListener("click", () => this.#ask({ type: "stop" }, "Mission stopped"));
    const form = get("destination");
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#plan();
    });
    form.addEventListener("input", () => this.#draft(this.#place()));
  }

  /** A place that the operator tapped. */
  choose({ x, y }) {
    get("destination-x").value = x.toFixed(2);
    get("destination-y").value = y.toFixed(2);
    this.#draft({ x, y });
  }

  /** Forgets what belongs to another vehicle. */
  forget() {
    this.#hadEmergency = true;
    this.#draft(null);
  }

  /** Shows the place that is chosen but not planned yet. */
  #draft(place) {
    this.#map.draft = place;
    mark(document.body, "data-draft", place ? "yes" : null);
    this.#hint(place);
  }

  /** Whether there is an approval that waits for the operator. */
  get waits() {
    return this.#mission?.stage === "awaiting_approval";
  }

  /** Whether a mission drives the vehicle, or begins to: the operator has to take over first. */
  get drives() {
    return this.#isOurs || (!this.#mission?.lost && DRIVEN.includes(this.#mission?.stage));
  }

  update(state, operable) {
    const mission = state.mission && typeof state.mission === "object" ? state.mission : null;
    this.#mission = mission;
    this.#isOurs = state.control?.planner_drives === true;
    this.#operable = operable;
    const lost = mission?.lost ?? null;
    const stage = lost ? "lost" : plain(mission?.stage ?? "idle", 30);
    this.#hadEmergency = state.vehicle?.emergency === true || (OVER.includes(stage) && this.#hadEmergency);
    this.#showStages(mission, stage);
    this.#showLine(mission, stage, state.vehicle);
    const progress = mission ? Math.round(Math.min(100, Math.max(0, number(mission.progress) ?? 0))) : 0;
    mark(get("progress"), "aria-valuenow", progress);
    mark(get("progress"), "data-state", stage);
    get("progress-bar").style.transform = `scaleX(${progress / 100})`;
    const attempts = number(mission?.attempts) ?? 0;
    show(get("attempt"), attempts > 0 && !OVER.includes(stage));
    say(get("attempt"), `Attempt ${number(mission?.attempt) ?? 0} of ${attempts}`);
    get("approve").disabled = !operable || !this.waits || Boolean(state.vehicle?.stale);
    show(get("approve"), stage !== "waiting");
    show(get("continue"), stage === "waiting");
    get("continue").disabled = !operable || Boolean(state.vehicle?.stale);
    get("stop").disabled = !operable || !mission || OVER.includes(stage);
    get("plan").disabled = !operable;
    document.body.dataset.mission = OVER.includes(stage) ? "over" : "under-way";
  }

  #showStages(mission, stage) {
    const index = STAGES.findIndex(([key]) => key === stage);
    if (this.#furthest.mission !== (mission?.mission ?? null)) this.#furthest = { mission: mission?.mission ?? null, index: -1 };
    // A mission that ended does not say where: it was where it was seen last.
    if (index >= 0) this.#furthest.index = index;
    const reached = index >= 0 ? index : stage === "idle" ? -1 : this.#furthest.index;
    const ended = { failed: "failed", stopped: "stopped", lost: "failed", waiting: "waiting" }[stage];
    STAGES.forEach(([key, name], position) => {
      let how = position < reached ? "done" : position > reached ? "ahead" : "active";
      if (position === reached && ended) how = ended;
      if (position === reached && stage === "arrived") how = "done";
      if (position === reached && stage === "awaiting_approval") how = "waiting";
      const item = this.#stages.get(key);
      mark(item, "data-state", how);
      mark(item, "aria-current", how === "active" || how === "waiting" ? "step" : null);
      say(item.lastChild, `: ${how}`);
      item.title = name;
    });
  }

  /**
   * Whether an emergency that ended the mission is over. The planner may report the end before the vehicle has
   * reported its emergency: then it is not.
   */
  #isCleared(stage, vehicle, reason) {
    return ["stopped", "failed"].includes(stage) && /emergency/.test(plain(reason, 255)) && this.#hadEmergency && vehicle?.emergency === false;
  }

  #showLine(mission, stage, vehicle) {
    const line = get("mission-line");
    mark(line, "data-state", stage);
    if (stage === "lost") return say(line, lostPlanner(mission.lost));
    const planner = mission ? null : list(vehicle?.missing, 64).find((one) => one?.role === "planner");
    if (planner) return say(line, `The planner ${plain(planner.id, 16)} is ${plain(planner.how, 10)}: no mission can be planned`);
    if (!mission || stage === "idle") return say(line, plain(mission?.reason, 255) || "No mission");
    const what = {
      map: "Fetching the map",
      planning: "Planning a path",
      awaiting_approval: "A route is planned: approve it to drive",
      path: "Sending the path to the path driver",
      vector: "The path driver engages the vector driver",
      primitive: "The vector driver engages the primitive driver",
      driving: "Driving",
      arrived: "Arrived",
      failed: "Failed",
      stopped: "Stopped",
      waiting: "Stopped for a fault, and waits for Continue",
    }[stage] ?? words(stage);
    const left = number(mission.remaining_m);
    const far = left !== null && !OVER.includes(stage) ? `, ${figure(left, 1)} m to go` : "";
    const reason = this.#isCleared(stage, vehicle, mission.reason) ? "the emergency is cleared; plan again" : currentReason(stage, mission, vehicle);
    const age = number(mission.age_ms) ?? 0;
    const old = age > OLD ? ` (${duration(age)} old)` : "";
    say(line, `${what}${far}${reason ? `: ${reason}` : ""}${old}`);
  }

  #place() {
    const [x, y] = ["destination-x", "destination-y"].map((id) => get(id).valueAsNumber);
    return Number.isFinite(x) && Number.isFinite(y) ? { x, y } : null;
  }

  #hint(place) {
    const passable = place && this.#map.passable(place);
    const text = !place
      ? "Tap the map, or type metres north and east of the origin."
      : passable === null
        ? "This place is outside the map."
        : passable === false
          ? "This place is blocked on the map."
          : "Plan a route to see it before the vehicle moves.";
    say(get("destination-hint"), text);
    mark(get("destination-hint"), "data-warn", place && !passable ? "yes" : null);
  }

  async #plan() {
    const place = this.#place();
    if (!place || !this.#operable) return;
    const speed = get("destination-speed").valueAsNumber;
    const request = { type: "destination", ...place, ...(Number.isFinite(speed) ? { speed } : {}) };
    if ((await this.#ask(request, "Planning a route")) === null) {
      this.#draft(null);
    }
  }
}

