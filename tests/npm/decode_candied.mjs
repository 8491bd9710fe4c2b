// Decodes every PDO of a CAN log with candied and the exported DBC files: one JSON object a line, for decode_log.
// Usage: node decode_candied.mjs DBC_FOLDER CAN.log

import fs from 'node:fs';
import path from 'node:path';
import readline from 'node:readline';
import candied from 'candied';

const { Can, Dbc } = candied;
const [folder, log] = process.argv.slice(2);

// One decoder for each file; the identifiers of PDOs are unique over the robot.
const decoders = new Map();
for (const file of fs.readdirSync(folder).filter((name) => name.endsWith('.dbc')).sort()) {
  const data = new Dbc().load(fs.readFileSync(path.join(folder, file), 'ascii'));
  const can = new Can();
  can.database = data;
  for (const message of data.messages.values()) decoders.set(message.id, { can, message });
}

const pattern = /^\((\d+)\.(\d{6})\) (\S+) ([0-9A-F]{3})#([0-9A-F]*)( [TR])?$/;
const out = [];
let number = 0;
for await (const text of readline.createInterface({ input: fs.createReadStream(log) })) {
  number += 1;
  const match = pattern.exec(text);
  if (!match) continue;
  const id = parseInt(match[4], 16);
  if (id < 0x181 || id > 0x57f) continue;
  const bytes = match[5].match(/../g)?.map((digits) => parseInt(digits, 16)) ?? [];
  const decoder = decoders.get(id);
  const decoded = decoder?.can.decode(decoder.can.createFrame(id, bytes));
  if (!decoded) {
    out.push(JSON.stringify({ error: `line ${number}: candied does not decode ${match[4]}` }));
    continue;
  }
  const signals = [];
  for (const [name, signal] of decoded.boundSignals) {
    const attributes = decoder.message.signals.get(name).attributes;
    signals.push([Number(attributes.get('ObjectIndex').value), Number(attributes.get('ObjectSub').value),
      signal.rawValue, signal.value]);
  }
  const time = Number(match[1]) * 1e6 + Number(match[2]);
  out.push(JSON.stringify({ time, id, name: decoded.name, sender: decoder.message.sendingNode, signals }));
  if (out.length > 10000) process.stdout.write(`${out.splice(0).join('\n')}\n`);
}
if (out.length > 0) process.stdout.write(`${out.join('\n')}\n`);
