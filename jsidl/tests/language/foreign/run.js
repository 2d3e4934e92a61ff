// Decodes and encodes the messages on standard input: module, service, message, code and octets in
// each line. Answers {"hex": …, "view": …} or {"error": …}.
import { readdirSync, readFileSync } from "node:fs";

const types = new Map();
for (const module of readdirSync(".", { withFileTypes: true })) {
  if (!module.isDirectory()) continue;
  for (const file of readdirSync(module.name)) {
    if (!file.endsWith(".js") || file === "codec.js") continue;
    const set = await import(`./${module.name}/${file}`);
    for (const Type of set.messages) {
      for (const service of Type.services) {
        types.set([module.name, service, Type.messageName, Type.code].join("\t"), Type);
      }
    }
  }
}

const answers = [];
for (const line of readFileSync(0, "utf8").trimEnd().split("\n")) {
  const [module, service, message, code, hex] = line.split("\t");
  const Type = types.get([module, service, message, parseInt(code, 16)].join("\t"));
  try {
    const value = Type.decode(Buffer.from(hex ?? "", "hex"));
    const encoded = Buffer.from(value.encode()).toString("hex");
    answers.push(JSON.stringify({ hex: encoded, view: value }));
  } catch (error) {
    answers.push(JSON.stringify({ error: error.messageName ? error.message : error.stack }));
  }
}
console.log(answers.join("\n"));
