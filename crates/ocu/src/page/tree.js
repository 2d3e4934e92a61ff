// The tree of subsystems, nodes, components and services, kept up to date in place so that what
// is folded stays folded; and the vehicle's parts with their states.

import { duration, get, list, make, mark, number, plain, say, show, words } from "./dom.js";
import { authority } from "./status.js";

const PERIOD = 400;
let shown = 0;
/** The conditions of the selected vehicle's parts, by their ids. */
let health = new Map();

/** Shows the tree of components. */
export function showTree(snapshot) {
  const subsystems = list(snapshot?.subsystems, 256);
  const counts = { nodes: 0, components: 0 };
  update(get("tree"), subsystems.map((one) => subsystem(one, counts)));
  say(get("system-count"), `${counts.components} components on ${counts.nodes} nodes`);
}

/** Shows the parts of the selected vehicle; at a rate at which they can be read. */
export function showSystem(state) {
  const now = performance.now();
  if (now - shown < PERIOD) return;
  shown = now;
  const [present, missing] = [list(state.vehicle?.parts, 64), list(state.vehicle?.missing, 64)];
  const silent = new Map(missing.map((one) => [plain(one?.id, 16), one]));
  const parts = [...present, ...missing.filter((one) => one?.how === "gone")];
  health = new Map(parts.map((part) => [plain(part?.id, 16), condition(part, silent.get(plain(part?.id, 16)))]));
  showParts(parts);
}

/** A part's state for the colours, and in words. A sensor or a store has no state: that it is there counts. */
function condition(part, absence) {
  const age = number(absence?.age_ms) === null ? "" : ` ${duration(absence.age_ms)}`;
  if (absence) return { state: "lost", word: `${{ gone: "Gone", restarted: "Restarted" }[absence.how] ?? "Silent"}${age}` };
  if (part?.managed !== true) return { state: "present", word: "" };
  const state = plain(part.state ?? "unknown", 20);
  return { state, word: words(state) };
}

// What the tree is to be: branches with key, title, badge and children.

function subsystem(one, counts) {
  const nodes = list(one?.nodes, 255);
  counts.nodes += nodes.length;
  return {
    key: `s${plain(one?.subsystem, 8)}`,
    id: plain(one?.subsystem, 8),
    title: plain(one?.name, 60) || words(one?.kind ?? "subsystem"),
    note: one?.kind ? words(one.kind) : "",
    open: true,
    children: nodes.map((n) => node(n, one?.subsystem, counts)),
  };
}

function node(one, subsystem, counts) {
  const components = list(one?.components, 255);
  counts.components += components.length;
  return {
    key: `n${plain(one?.node, 8)}`,
    id: `${plain(subsystem, 8)}.${plain(one?.node, 8)}`,
    title: plain(one?.name, 60) || "Node",
    note: "",
    open: true,
    children: components.map(component),
  };
}

function component(one) {
  const services = list(one?.services, 255);
  const state = plain(one?.state ?? "unknown", 20);
  return {
    state,
    key: `c${plain(one?.id, 16)}`,
    id: plain(one?.id, 16),
    title: plain(one?.name, 60) || "Component",
    note: `${words(state)} · ${services.length} services`,
    open: false,
    children: services.map((service, index) => {
      const urn = plain(service?.urn, 160);
      return {
        key: `v${index}${urn}`,
        id: plain(service?.version, 8),
        title: urn.split(":").at(-1) || "Service",
        note: urn.split(":").slice(0, -1).join(":"),
        children: null,
      };
    }),
  };
}

/** Makes the children of an element what the branches say, reusing those with the same key. */
function update(parent, branches) {
  const old = new Map([...parent.children].filter((child) => child.dataset.key).map((child) => [child.dataset.key, child]));
  let place = parent.querySelector(":scope > [data-key]");
  for (const branch of branches) {
    const element = old.get(branch.key) ?? create(branch);
    old.delete(branch.key);
    if (element === place) place = place.nextElementSibling;
    else parent.insertBefore(element, place);
    const head = branch.children ? element.firstChild : element;
    const [id, title, note] = head.children;
    say(id, branch.id);
    say(title, branch.title);
    say(note, branch.note);
    mark(element, "data-state", branch.state);
    if (branch.children) update(element, branch.children);
  }
  for (const gone of old.values()) gone.remove();
}

function create(branch) {
  const line = [
    make("code", { className: "tree-id" }),
    make("bdi", { className: "tree-title" }),
    make("bdi", { className: "tree-note" }),
  ];
  if (!branch.children) {
    const leaf = make("div", { className: "leaf" }, ...line);
    leaf.dataset.key = branch.key;
    return leaf;
  }
  if (branch.state) line.push(make("span", { className: "dot", "aria-hidden": "true" }));
  const element = make("details", {}, make("summary", {}, ...line));
  element.dataset.key = branch.key;
  element.open = branch.open;
  return element;
}

function showParts(parts) {
  const area = get("parts");
  show(area, parts.length > 0);
  const old = new Map([...area.children].map((child) => [child.dataset.key, child]));
  for (const part of parts) {
    const key = plain(part?.id, 16);
    let row = old.get(key);
    old.delete(key);
    if (!row) {
      row = make("div", { className: "part" }, make("span", { className: "dot", "aria-hidden": "true" }), make("b"), make("span", { className: "part-state" }), make("small"));
      row.dataset.key = key;
      area.append(row);
    }
    const [, name, mode, detail] = row.children;
    const { state, word } = health.get(key);
    mark(row, "data-state", state);
    mark(row, "data-missing", state === "lost" ? "yes" : null);
    say(name, words(part?.role ?? part?.id));
    say(mode, word);
    const stage = part?.stage?.state ? ` · ${words(part.stage.state).toLowerCase()}` : "";
    const reason = plain(part?.stage?.reason, 160);
    const control = part?.managed === true ? ` · ${authority(part)}` : "";
    say(detail, `${key}${control}${stage}${reason ? `: ${reason}` : ""}`);
  }
  for (const gone of old.values()) gone.remove();
}
