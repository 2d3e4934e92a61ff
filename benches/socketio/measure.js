// Measures the schedule of `jaus load` through the relay. Prints the same table, and writes
// the same JSON, which `jaus load --beside` reads.
"use strict";
const { fork } = require("node:child_process");
const { once } = require("node:events");
const { writeFileSync } = require("node:fs");
const { parseArgs } = require("node:util");

const { values: settings } = parseArgs({
  options: {
    components: { type: "string", default: "1000" },
    processes: { type: "string", default: "4" },
    rates: { type: "string", default: "100,1000,3000,9000,30000,100000,max" },
    burst: { type: "string", default: "1" },
    window: { type: "string", default: "2" },
    seconds: { type: "string", default: "5" },
    size: { type: "string", default: "170" },
    json: { type: "string" },
  },
});
const [components, processes, window, burst, octets] = [
  "components",
  "processes",
  "window",
  "burst",
  "size",
].map((name) => Number.parseInt(settings[name], 10));
const seconds = Number.parseFloat(settings.seconds);

// A child that ends before it is asked to is a failure.
function start(file) {
  const child = fork(`${__dirname}/${file}`, { serialization: "advanced" });
  child.on("exit", () => {
    console.error(`${file} has ended unexpectedly`);
    process.exit(2);
  });
  return child;
}

async function ask(child, order) {
  const answer = once(child, "message");
  child.send(order);
  return (await answer)[0];
}

const askAll = (children, order) => Promise.all(children.map((child) => ask(child, { order })));

// In microseconds.
const used = (usages) => usages.reduce((sum, { user, system }) => sum + user + system, 0);

function row(wanted, answers, cpu) {
  const sum = (what) => answers.reduce((total, answer) => total + answer[what], 0);
  const times = Float64Array.from(answers.flatMap(({ times }) => Array.from(times))).sort();
  const [sent, refused] = [sum("sent"), sum("refused")];
  const within = (share) => times[Math.max(0, Math.ceil(times.length * share) - 1)] ?? 0;
  return {
    wanted,
    per_second: times.length / seconds,
    sent,
    lost: sent - times.length,
    refused,
    mean: times.reduce((total, time) => total + time, 0) / Math.max(1, times.length),
    p50: within(0.5),
    p99: within(0.99),
    p999: within(0.999),
    max: within(1),
    processor: cpu / Math.max(1, sum("all")),
  };
}

async function main() {
  const relay = start("relay.js");
  const [port] = await once(relay, "message");
  const clients = Array.from({ length: processes }, () => start("clients.js"));
  await Promise.all(
    clients.map((client, first) => {
      const numbers = [];
      for (let number = first; number < components; number += processes) numbers.push(number);
      const partners = numbers.map((number) => (number + 1) % components);
      return ask(client, { order: "attach", port, numbers, partners });
    }),
  );
  console.log(`Socket.IO: ${components} clients in ${processes} processes, one relay; ${octets} octets, bursts of ${burst}, ${seconds} s for each row`);
  console.log("| wanted/s | acknowledged/s | sent | lost | refused | mean ms | p50 ms | p99 ms | p99.9 ms | max ms | CPU µs |");
  console.log("|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
  const rows = [];
  for (const rate of settings.rates.split(",")) {
    const wanted = rate === "max" ? null : Number.parseInt(rate, 10);
    const step = { order: "measure", seconds, octets, burst };
    const before = used(await askAll([relay, ...clients], "usage"));
    const answers = await Promise.all(
      clients.map((client, first) => {
        const share = Math.ceil((components - first) / processes) / components;
        return ask(client, wanted ? { ...step, rate: wanted * share } : { ...step, window });
      }),
    );
    const cpu = used(await askAll([relay, ...clients], "usage")) - before;
    const result = row(wanted, answers, cpu);
    rows.push(result);
    const times = [result.mean, result.p50, result.p99, result.p999, result.max].map((time) => time.toFixed(3));
    console.log(`| ${[rate, result.per_second.toFixed(0), result.sent, result.lost, result.refused, ...times, result.processor.toFixed(1)].join(" | ")} |`);
  }
  if (settings.json) {
    const report = { name: "Socket.IO", components, processes, octets, window, burst, seconds, rows };
    writeFileSync(settings.json, `${JSON.stringify(report, null, 2)}\n`);
  }
  process.exit(0);
}

main();
