// Some of the clients: each sends to its partner, acknowledges what it receives, and measures the
// time until its own messages are acknowledged. The schedule is that of `jaus load`.
"use strict";
const { io } = require("socket.io-client");

const WARM_UP = 500;
const REST = 2000;
// A client that has this many messages unacknowledged sends no more, as a bounded queue would.
const QUEUE = 100;
// How long the next step waits for acknowledgements of this one, after those that count.
const DRAIN = 30_000;
const TICK = 1;

let clients = [];

async function attach({ port, numbers, partners }) {
  clients = numbers.map((number, index) => {
    const options = { transports: ["websocket"], forceNew: true, auth: { number } };
    const socket = io(`http://127.0.0.1:${port}`, options);
    socket.on("load", (_, acknowledge) => acknowledge());
    return { socket, partner: partners[index], waiting: 0 };
  });
  await Promise.all(clients.map(({ socket }) => new Promise((done) => socket.on("connect", done))));
}

function measure({ rate, window, burst, seconds, octets }) {
  const message = "x".repeat(octets);
  const times = [];
  const tally = { all: 0, sent: 0, refused: 0 };
  const begin = performance.now();
  const end = begin + WARM_UP + 1000 * seconds;
  let isOver = false;

  const send = (client, now) => {
    const counts = now >= begin + WARM_UP;
    if (client.waiting >= QUEUE) {
      tally.refused += counts;
      return;
    }
    tally.sent += counts;
    client.waiting += 1;
    client.socket.emit("load", client.partner, message, () => {
      const now_ = performance.now();
      client.waiting -= 1;
      tally.all += 1;
      if (counts && !isOver) times.push(now_ - now);
      if (window && now_ < end) send(client, now_);
    });
  };

  if (window) {
    for (const client of clients) for (let i = 0; i < window; i++) send(client, performance.now());
  }
  return new Promise((resolve) => {
    let done = 0;
    const tick = () => {
      const now = performance.now();
      if (now < end) {
        const due = window ? 0 : Math.floor(((now - begin) / 1000) * rate);
        for (; done < due; done++) send(clients[Math.floor(done / burst) % clients.length], now);
        return setTimeout(tick, TICK);
      }
      const isDone = clients.every(({ waiting }) => waiting === 0);
      isOver ||= now > end + REST;
      if (isDone || now > end + REST + DRAIN) resolve({ ...tally, times: Float64Array.from(times) });
      else setTimeout(tick, TICK);
    };
    tick();
  });
}

process.on("disconnect", () => process.exit());
process.on("message", async ({ order, ...details }) => {
  if (order === "attach") await attach(details);
  if (order === "measure") return process.send(await measure(details));
  process.send(process.cpuUsage());
});
