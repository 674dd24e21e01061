// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The connection to the pipeline, which is re-established when it breaks.
import {FRAME, RAYS, frameOf, parse, raysOf} from './decode.js';

export class Session {
  /// @param on handlers by message: hello, frame, rays, state, answer, end, status
  constructor(on) {
    this.on = on;
    this.rays = {};
    this.nodes = [];
    this.connect();
  }

  connect() {
    const token = new URLSearchParams(location.search).get('token');
    const address = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws${token ? `?token=${token}` : ''}`;
    const socket = this.socket = new WebSocket(address, 'tofgraph.v1');
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({data}) => typeof data === 'string' ? this.text(JSON.parse(data)) : this.binary(data);
    socket.onclose = ({reason}) => {
      if (this.socket !== socket) return;
      this.on.status(reason || (this.opened ? 'the pipeline has ended' : 'no connection: does the pipeline run, is the token right?'), true);
      setTimeout(() => this.connect(), 1500);
    };
  }

  text(message) {
    if (message.op === 'hello') {
      this.opened = true;
      this.rays = {};
      this.on.hello(message);
    } else if (message.op === 'state') {
      if (message.reply) this.on.state(message.reply);
    } else if (message.op === 'set') {
      this.on.answer(message);
    } else if (message.op === 'end') {
      this.on.end();
    }
  }

  binary(buffer) {
    const message = parse(buffer);
    if (message.kind === RAYS) this.rays[message.json.node] = raysOf(message, buffer);
    if (message.kind === FRAME) this.on.frame(frameOf(message, buffer));
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
  show(nodes, rate) { this.send({op: 'show', nodes, rate}); }
  next() { this.send({op: 'next'}); }
  askState() { this.send({op: 'state'}); }
  set(node, parameter, value) { this.send({op: 'set', node, parameter, value}); }
}
