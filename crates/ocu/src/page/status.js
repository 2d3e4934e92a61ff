// The top bar and the status panel: how good the connection is, who is in control, and how the
// vehicle moves.

import { duration, figure, get, list, mark, number, objects, plain, say, show, toast, words } from "./dom.js";

const FRESH = 1_000;

/** The part of a role, or undefined. */
export const part = (state, role) => list(state?.vehicle?.parts, 64).find((one) => one?.role === role);

/** A round trip and a loss in few letters, for example `0.12 s, 3 % lost`; empty if they are not known. */
export function hop(roundTrip, loss) {
  const time = number(roundTrip) === null ? "" : roundTrip < 995 ? `${Math.round(roundTrip)} ms` : `${figure(roundTrip / 1000, 1)} s`;
  const lost = number(loss) !== null && loss >= 0.5 ? `${Math.round(Math.min(loss, 100))} % lost` : "";
  return [time, lost].filter(Boolean).join(", ");
}

/** The two hops in words: from this page to the station, and from there to the vehicle. */
export function hops(quality) {
  const station = hop(quality?.roundTripMs, quality?.lossPercent);
  const vehicle = hop(quality?.vehicleRoundTripMs, quality?.vehicleLossPercent);
  return [station && `station ${station}`, vehicle && `vehicle ${vehicle}`].filter(Boolean).join(" · ");
}

/** Shows how good the connection is, everywhere that it matters. */
export function showLink(link, state) {
  const condition = link.condition;
  document.body.dataset.link = condition;
  const age = Number.isFinite(link.age) ? duration(link.age) : "";
  const quality = link.quality ?? null;
  const [word, detail] = {
    barred: ["Not logged in", ""],
    connecting: ["Connecting", ""],
    live: ["Live", hops(quality)],
    stale: ["Stale", age],
    lost: ["Reconnecting", link.retryIn > 950 ? `in ${Math.ceil(link.retryIn / 1000)} s` : "now"],
  }[condition];
  say(get("link-word"), word);
  say(get("link-detail"), detail);
  mark(get("link-pill"), "title", condition === "live" ? `Round trip and loss: ${hops(quality) || "not measured yet"}` : null);
  const slow = quality !== null && (quality.wayBack === false || Math.max(...["roundTripMs", "vehicleRoundTripMs"].map((key) => number(quality[key]) ?? 0)) > 1_000);
  mark(get("link-pill"), "data-slow", condition === "live" && slow ? "yes" : null);
  const banner = get("banner");
  // The age changes all the time: a screen reader hears the sentence alone, and once.
  const [text, old] = {
    stale: ["No new state: this picture is old.", age],
    lost: state ? ["No connection: this picture is old.", age] : ["No connection to the operator's node.", ""],
  }[condition] ?? ["", ""];
  say(get("banner-text"), text);
  say(get("banner-age"), old);
  show(banner, text !== "");
}

/** How a part is missing, in words. */
const absence = ({ name, id, how }) => `${plain(name, 40)} ${plain(id, 16)} ${ABSENCE[how] ?? "is silent"}`;
const ABSENCE = { gone: "is gone", restarted: "restarted while it drove: the vehicle was stopped" };

/** The ids of the parts that were missing when that was last shown. */
let missed = new Set();

/** Says which parts of the vehicle are missing, for as long as they are. Without a live connection there is no news of them. */
export function showMissing(state, live) {
  const parts = objects(state.vehicle?.parts, 64);
  const missing = objects(state.vehicle?.missing, 64);
  const now = new Set(missing.map(({ id }) => plain(id, 16)));
  for (const { id, role } of parts) {
    if (missed.has(id) && !now.has(id)) toast("good", `${words(role)} ${plain(id, 16)} is back`);
  }
  missed = now;
  const silent = missing.filter(({ how }) => how === "silent");
  // All parts at once: the network is the reason, or the whole vehicle.
  const all = parts.length > 1 && silent.length === parts.length;
  const texts = all
    ? [`Vehicle ${plain(state.vehicle?.subsystem, 8)} is silent: none of its parts reports`]
    : missing.map(absence);
  const more = texts.length > 2 ? ` and ${texts.length - 2} more` : "";
  const notice = get("missing");
  show(notice, live && texts.length > 0);
  say(notice, texts.slice(0, 2).join(" · ") + more);
}

/** The user who has this station's control, in words. */
let holderHere = "you";

/** Shows who controls, and offers to take, request or release control. */
export function showControl(state, authority, operable, account, ownPage) {
  const { held, wanted, asking, reason, user, page } = state.control ?? {};
  const isOther = number(page) !== null && page !== ownPage;
  holderHere = !isOther ? "you" : account.users && user !== account.user ? plain(user, 32) : "another page";
  const driver = part(state, "primitive_driver");
  const [word, detail] = held
    ? [isOther ? `${holderHere} has control` : "You have control", number(authority) === null ? "" : `authority ${authority}`]
    : asking
      ? ["Control requested", `from ${plain(asking, 16)}`]
      : wanted
        ? ["Taking control", plain(reason)]
        : ["Not in control", plain(reason) || holder(driver)];
  say(get("control-word"), word);
  say(get("control-detail"), detail);
  document.body.dataset.control = held ? "held" : asking ? "asking" : wanted ? "wanted" : "none";
  const button = get("control-button");
  const outranks = Boolean(driver?.controller) && driver.authority >= authority;
  const offer = outranks ? "Request control" : "Take control";
  say(button, asking ? "Withdraw" : held || wanted ? "Release" : offer);
  button.classList.toggle("primary", !held && !wanted && !asking);
  button.disabled = !operable || isOther;
}

function holder(driver) {
  if (!driver) return "";
  return driver.controller ? `${plain(driver.controller, 16)} drives` : "not controlled";
}

/** Shows state, velocity and pose; old values are marked. `late` is the age of the state itself. */
export function showStatus(state, late) {
  const { vehicle } = state;
  const driver = part(state, "primitive_driver");
  const mode = vehicle?.emergency ? "emergency" : driver?.state;
  const statusAge = vehicle?.status_age_ms;
  const modeAge = (number(statusAge) ?? 0) + late;
  const box = get("state");
  mark(box, "data-state", mode ? plain(mode, 20) : "unknown");
  mark(box, "data-old", mode && modeAge > FRESH ? "yes" : null);
  say(get("state-word"), mode ? words(mode) : vehicle ? "Unknown" : "No vehicle");
  say(get("state-detail"), driver ? authority(driver) : vehicle ? "no primitive driver" : "");
  const [pose, velocity] = [vehicle?.pose, vehicle?.velocity];
  fill("speed", velocity?.x, 2, velocity, late);
  fill("turn-rate", degrees(velocity?.yaw_rate), 0, velocity, late);
  const fix = vehicle?.place?.fix;
  const heading = number(pose?.yaw) !== null ? pose : fix;
  fill("heading", bearing(heading?.yaw), 0, heading, late);
  fill("north", pose?.x, 2, pose, late);
  fill("east", pose?.y, 2, pose, late);
  const ages = [["state", statusAge], ["pose", pose?.age_ms], ["velocity", velocity?.age_ms]];
  const old = ages.filter(([, age]) => number(age) !== null && age + late > FRESH);
  // There is room for one age only: what is old is often old for one reason.
  const oldest = Math.max(...old.map(([, age]) => age + late));
  say(get("state-old"), old.length ? `${duration(oldest)} old: ${old.map(([name]) => name).join(", ")}` : "");
}

/** Shows why a driver of the vehicle holds it, where the operator looks. */
export function showHeld(state, live) {
  const reason = live ? plain(state.vehicle?.held?.reason, 200) : "";
  const notice = get("held");
  show(notice, reason !== "");
  // Distances in the reason change all the time: a screen reader hears it once.
  say(get("held-text"), reason ? `Held: ${reason}` : "");
}

/** Who commands a part, in words. */
export function authority({ ours, controller, authority: level }) {
  if (!ours && !controller) return "control: nobody";
  const by = number(level) !== null ? ` (${level})` : "";
  return `control: ${ours ? holderHere : plain(controller, 16)}${by}`;
}

function fill(id, value, decimals, source, late) {
  const element = get(id);
  say(element, figure(value, decimals));
  const old = number(value) === null || (number(source?.age_ms) ?? 0) + late > FRESH;
  mark(element.closest("div"), "data-old", old ? "yes" : null);
}

const degrees = (value) => (number(value) === null ? null : (value * 180) / Math.PI);

/** A yaw as a compass shows it: 0 to 359. */
function bearing(yaw) {
  const value = degrees(yaw);
  return value === null ? null : Math.round(((value % 360) + 360) % 360) % 360;
}
