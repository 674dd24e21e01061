// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Decodes messages of the server to frames and values. Format: docs/live_view.md.

export const RAYS = 1, FRAME = 2;

/// Header and offset of the values of a binary message.
export function parse(buffer) {
  const head = new DataView(buffer);
  const bytes = head.getUint32(4, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, bytes)));
  return {kind: head.getUint32(0, true), json, start: 8 + bytes};
}

export function raysOf(message, buffer) {
  const {rows, columns} = message.json;
  return {rows, columns, values: new Float32Array(buffer, message.start, rows * columns * 3)};
}

/// Frame: number, time, and the channels of each node by name.
export function frameOf(message, buffer) {
  const nodes = {};
  for (const node of message.json.nodes) {
    const channels = {};
    for (const channel of node.channels) {
      const count = channel.rows * channel.columns, at = message.start + channel.at;
      channels[channel.name] = {
        ...channel,
        codes: channel.type === 'points' ? null : new Uint16Array(buffer, at, count),
        points: channel.type === 'points' ? new Float32Array(buffer, at, count * 3) : null,
      };
    }
    nodes[node.node] = channels;
  }
  return {number: message.json.frame, timestamp: message.json.timestamp_ns, nodes, bytes: buffer.byteLength,
          integrationTime: message.json.integration_time};
}

/// Value of pixel i in the channel's unit; NaN: none. For flags the bits.
export function valueAt(channel, i) {
  if (channel.type === 'bits') return channel.codes[i];
  const code = channel.codes[i];
  return code === 0 ? NaN : channel.offset + (code - 1) * channel.step;
}

/// Smallest and largest non-zero code without the outermost 0.5 %, so that outliers do not set the colour range.
export function codeRange(channel) {
  if (channel.range) return channel.range;
  const counts = new Uint32Array(65536), {codes} = channel;
  for (let i = 0; i < codes.length; ++i) ++counts[codes[i]];
  const total = codes.length - counts[0];
  if (total === 0) return channel.range = [1, 2];
  let low = 1, high = 65535;
  for (let seen = 0; (seen += counts[low]) <= total * 0.005 && low < 65535;) ++low;
  for (let seen = 0; (seen += counts[high]) <= total * 0.005 && high > low;) --high;
  return channel.range = [low, Math.max(high, low + 1)];
}

/// Points of a node as x, y, z, NaN where missing; null if it has no cloud.
export function pointsOf(channels, rays, info) {
  const cloud = cloudOf(channels, rays, info);
  if (!cloud) return null;
  if (cloud.channel.points) return cloud.channel.points;
  const count = cloud.channel.codes.length, points = new Float32Array(count * 3);
  for (let i = 0; i < count; ++i) {
    let length = valueAt(cloud.channel, i) - cloud.shift;
    if (cloud.alongZ) length /= rays.values[3 * i + 2];
    for (let k = 0; k < 3; ++k) points[3 * i + k] = length * rays.values[3 * i + k];
  }
  return points;
}

/// Channel from which the cloud is computed. alongZ: depths along z from a plane `shift` metres behind the lens.
export function cloudOf(channels, rays, info) {
  const fits = (c) => c && rays && c.rows === rays.rows && c.columns === rays.columns;
  const {points, range, depth} = channels;
  if (points && points.type === 'points') return {channel: points, alongZ: false, shift: 0};
  if (fits(points)) return {channel: points, alongZ: false, shift: 0};
  if (fits(range)) return {channel: range, alongZ: false, shift: 0};
  if (fits(depth) && info.focal_length !== null) return {channel: depth, alongZ: true, shift: info.focal_length};
  return null;
}
