// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Subscribes to all topics by Foxglove's public client and prints the first message of each as one line of JSON:
//   node client.js ws://localhost:8765 SUB_PROTOCOL TOPICS
const {FoxgloveClient} = require('@foxglove/ws-protocol');
const {WebSocket} = require('ws');

const [address, protocol, wanted] = process.argv.slice(2);
const client = new FoxgloveClient({ws: new WebSocket(address, [protocol])});
const channels = new Map(), seen = new Map();
client.on('error', (error) => { console.error(String(error)); process.exit(1); });
client.on('serverInfo', (info) => console.log(JSON.stringify({server: info.name})));
client.on('advertise', (advertised) => {
  for (const channel of advertised) channels.set(client.subscribe(channel.id), channel);
});
client.on('message', ({subscriptionId, timestamp, data}) => {
  const {topic, schemaName} = channels.get(subscriptionId);
  if (seen.has(topic)) return;
  const message = JSON.parse(new TextDecoder().decode(data));
  if (message.data) message.bytes = Buffer.from(message.data, 'base64').length;
  if (schemaName === 'foxglove.PointCloud') message.first = [0, 4, 8, 12].map((at) => Buffer.from(message.data, 'base64').readFloatLE(at));
  delete message.data;
  seen.set(topic, true);
  console.log(JSON.stringify({topic, schemaName, timestamp: String(timestamp), message}));
  if (seen.size === Number(wanted)) process.exit(0);
});
setTimeout(() => { console.error(`only ${seen.size} topics came`); process.exit(1); }, 30000);
