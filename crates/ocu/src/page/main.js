// Puts the page together: frames of the server go to the panels, requests of the operator to the
// server.

import { Account } from "./account.js";
import { get, mark, number, plain, say, show, toast, typing } from "./dom.js";
import { Drive } from "./drive.js";
import { Emergency } from "./emergency.js";
import { Engage, awaitsResume } from "./engage.js";
import { Events } from "./events.js";
import { Fleet } from "./fleet.js";
import { keepFocus } from "./focus.js";
import { Handover } from "./handover.js";
import { Link } from "./link.js";
import { MapView } from "./map.js";
import { Messages } from "./messages.js";
import { Mission } from "./mission.js";
import { Pass } from "./pass.js";
import { Sound } from "./sound.js";
import { part, showControl, showHeld, showLink, showMissing, showStatus } from "./status.js";
import { followTheme } from "./theme.js";
import { showSystem, showTree } from "./tree.js";

const pass = new Pass();
const account = new Account(() => link.restart(), () => link.send({ type: "active" }), pass);
const link = new Link(() => account.check(), pass);
const map = new MapView((place) => choose(place), (request) => link.ask(request));
const mission = new Mission(ask, map);
const emergency = new Emergency(link, () => unbar());
const drive = new Drive(link, () => emergency.stop());
const fleet = new Fleet((subsystem) => selectVehicle(subsystem));
const engage = new Engage(ask, mission, () => readyToDrive());
const handover = new Handover(ask);
const events = new Events();
const sound = new Sound();
new Messages(link);
followTheme(() => map.recolour());

let state = null;
/** Whether the server accepts requests from this page: it requires no token, or has accepted ours, or
 * the user's role allows them. */
let trusted = false;
/** Whether the server lets this page look, and so stop vehicles, without the token. */
let watchable = true;
/** The authority that the operator's node asks for control with. */
let authority = null;

// Frames of the server.

link.addEventListener("hello", async ({ detail }) => {
  trusted = account.users ? account.operates : !detail.token_needed;
  watchable = detail.watch !== false;
  show(get("token-no"), watchable);
  say(get("token-no"), "Only watch");
  map.offerBaseMap(detail.base_map);
  map.reconnect();
  events.reset();
  authority = detail.authority;
  if (detail.token_needed && !trusted && link.token) await offer(link.token);
  else show(get("token-sheet"), detail.token_needed && !trusted && !(watchable && watching()));
  // Another connection may have said hello meanwhile.
  if (link.page === number(detail.page)) link.settled = true;
  render();
});
link.addEventListener("state", ({ detail }) => {
  state = detail;
  emergency.handleState(state);
  render();
});
link.addEventListener("fleet", ({ detail }) => {
  fleet.handle(detail);
  emergency.handleFleet(fleet);
  render();
});
link.addEventListener("tree", ({ detail }) => showTree(detail));
link.addEventListener("close", () => {
  trusted = false;
  render();
});
link.addEventListener("barred", () => {
  render();
  account.focus();
});
link.addEventListener("doubt", () => {
  say(get("token-text"), STRANGER);
  say(get("token-no"), "Forget mine");
  show(get("token-no"), true);
  openTokenSheet();
});
link.addEventListener("refused", ({ detail }) => toast("bad", detail));

/** Shows the state; also without news, because ages grow. */
function render() {
  showLink(link, state);
  const live = link.condition === "live";
  const operable = live && trusted && Boolean(state?.vehicle);
  // Who may look may stop.
  const barred = account.missing || (link.open && link.settled && !trusted && !watchable);
  const hint = account.users ? account.hindrance : "enter the token to use it";
  const clearsAny = trusted && (!account.users || account.role === "administer");
  emergency.update(state, live, fleet, barred ? hint : "", { clears: trusted, clearsAny });
  sound.update(state, live, fleet.vehicles, link.page);
  fleet.update(state, live, link.page);
  const hindrance = hindered(live);
  if (state) mission.update(state, operable);
  drive.update(state, hindrance || uncontrolled());
  const mode = part(state, "primitive_driver")?.state;
  get("resume").disabled = !operable || !state.control?.held || mode !== "standby";
  get("standby").disabled = !operable || !state.control?.held || mode !== "ready";
  if (state) renderState(live, operable, hindrance);
  keepFocus();
}

function renderState(live, operable, hindrance) {
  showControl(state, authority, operable, account, link.page);
  // A connection that comes back goes on.
  engage.update(state, operable, live ? hindrance : "");
  handover.update(state, operable);
  showStatus(state, Number.isFinite(link.age) ? link.age : 0);
  showMissing(state, live);
  showHeld(state, live);
  map.update(state, live, link.token);
  showSystem(state);
  events.update(state, live, fleet.vehicles, link.token);
}

/** Why this page cannot drive now, even with control of a ready vehicle; empty if one can. */
function hindered(live) {
  if (!live) return "Not connected";
  if (!trusted) return `Watching only: ${account.users ? account.hindrance : "enter the token to drive"}`;
  if (!state.vehicle) return "No vehicle";
  if (state.vehicle.emergency || state.vehicle.stop_set) return "Emergency: clear it before driving";
  return state.vehicle.stale ? sentence(state.vehicle.stale) : "";
}

/** What is still missing for driving; empty if nothing is. */
function uncontrolled() {
  if (!state.control?.wanted) return mission.drives ? "A mission drives: take control first" : "Press Drive by hand first";
  if (mission.drives) return "A mission drives: press Take over first";
  const driver = part(state, "primitive_driver");
  if (state.control.held && driver?.ours && awaitsResume(state)) return "In standby: press Drive by hand first";
  return state.control.held ? "" : sentence(state.control.reason) || "Taking control";
}

const sentence = (text) => plain(text, 140).replace(/^./, (letter) => letter.toUpperCase());

// Requests of the operator.

/** Sends a request; shows a refusal, or what was done. */
async function ask(request, done) {
  const reason = await link.ask(request);
  if (reason !== null) toast("bad", reason);
  else if (done) toast("good", done);
  return reason;
}

function choose(place) {
  mission.choose(place);
  select("mission");
}

get("control-button").addEventListener("click", () => {
  const { held, wanted, asking } = state?.control ?? {};
  const on = !(held || wanted || asking);
  ask({ type: "control", on });
});
get("resume").addEventListener("click", () => ask({ type: "resume" }));
get("standby").addEventListener("click", () => ask({ type: "standby" }));
get("vehicle-button").addEventListener("click", () => showFleet());
for (const [id, stop] of [["estop", () => emergency.stop()], ["estop-all", () => emergency.stopAll()]]) {
  get(id).addEventListener("click", () => drive.end("emergency stop"));
  // While one finger holds the stick, browsers make no click of a second one.
  get(id).addEventListener("pointerdown", ({ button }) => {
    if (button > 0) return;
    drive.end("emergency stop");
    stop();
  });
}

/** Selects a vehicle: the one before stops, unless it is on a mission. */
async function selectVehicle(subsystem) {
  drive.end("another vehicle was selected");
  mission.forget();
  await ask({ type: "select", subsystem });
}

/** The vehicle does what the stick and the keys say. */
function readyToDrive() {
  select("drive");
  get("stick").focus();
  toast("good", "Ready: use the stick, the keys or the gamepad");
}

function showFleet() {
  select("vehicles");
  fleet.focus();
}

// The token.

const STRANGER =
  "The program at this address does not prove that it knows your token or login, and was told nothing. Either the station has another token now: enter it. Or another program has taken its place: see the address that the station printed.";

const watching = () => sessionStorage.getItem("jaus-watch") === "yes";

async function offer(token) {
  const reason = await link.useToken(token);
  trusted = reason === null;
  show(get("token-sheet"), !trusted);
  if (!trusted) {
    say(get("token-text"), `The token was not accepted: ${plain(reason, 200)}`);
    get("token").focus();
  }
  render();
}

/** Shows what a page that may not operate needs for it. */
function unbar() {
  if (account.missing) account.focus();
  else openTokenSheet();
}

function openTokenSheet() {
  show(get("token-sheet"), true);
  get("token").focus();
}

get("token-form").addEventListener("submit", (event) => {
  event.preventDefault();
  sessionStorage.removeItem("jaus-watch");
  offer(get("token").value.trim());
  get("token").value = "";
});
get("token-no").addEventListener("click", async () => {
  sessionStorage.setItem("jaus-watch", "yes");
  show(get("token-sheet"), false);
  if (!pass.holds) return;
  await pass.forget();
  link.restart();
});
get("control-text").addEventListener("click", () => {
  if (!trusted && link.open && !account.users) openTokenSheet();
});

// Views, and keys. On a large screen mission and manual drive are both shown: the one that is touched or
// has the focus is the view.

function select(view) {
  const { body } = document;
  body.dataset.view = view;
  drive.show(view === "drive");
  if (["vehicles", "system", "events", "messages"].includes(view)) body.dataset.inspect = view;
  for (const button of document.querySelectorAll("[data-show]")) {
    mark(button, "aria-pressed", String(button.dataset.show === view));
    button.classList.toggle("inspected", button.dataset.show === body.dataset.inspect);
  }
}
for (const button of document.querySelectorAll("[data-show]")) {
  button.addEventListener("click", () => select(button.dataset.show));
}
for (const panel of document.querySelectorAll(".panel.operate")) {
  for (const type of ["pointerdown", "focusin"]) {
    panel.addEventListener(type, () => document.body.dataset.view !== panel.dataset.panel && select(panel.dataset.panel), true);
  }
}
select("mission");

addEventListener("keydown", (event) => {
  if (emergency.key(event)) return drive.end("emergency stop");
  if (typing()) return;
  if (event.code === "KeyV" && !event.ctrlKey && !event.metaKey && !event.altKey) {
    event.preventDefault();
    return showFleet();
  }
  if (drive.keyDown(event) || (!event.ctrlKey && !event.metaKey && !event.altKey && map.key(event.key))) event.preventDefault();
});

setInterval(render, 250);
link.start();
