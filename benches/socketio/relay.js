// The relay: passes each message on to the client with the wanted number, and the receiver's
// acknowledgement back.
"use strict";
const { createServer } = require("node:http");
const { Server } = require("socket.io");

const http = createServer();
const io = new Server(http, { transports: ["websocket"], perMessageDeflate: false });
const clients = new Map();

io.on("connection", (socket) => {
  clients.set(socket.handshake.auth.number, socket);
  socket.on("load", (to, message, acknowledge) => {
    clients.get(to)?.emit("load", message, acknowledge);
  });
});

process.on("message", () => process.send(process.cpuUsage()));
process.on("disconnect", () => process.exit());
http.listen(0, "127.0.0.1", () => process.send(http.address().port));
