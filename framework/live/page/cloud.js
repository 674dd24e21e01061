// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The cloud: its content and the view. The points are drawn by the GPU or, without one, by drawn_points.js: software
// emulation of a GPU takes 0.8 microseconds per point.
import {cloudOf, codeRange} from './decode.js';
import {DrawnPoints} from './drawn_points.js';
import {GlPoints} from './gl_points.js';

function multiply(a, b) {  // column-major, as in WebGL
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

/// View and projection matrices for an eye and a target; the optical frame has x right, y down, z forward.
export function matrixOf(view, aspect) {
  const {yaw, pitch, distance, target, angle} = view;
  const forward = [Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
  const right = [Math.cos(yaw), 0, -Math.sin(yaw)];
  const down = [-Math.sin(yaw) * Math.sin(pitch), Math.cos(pitch), -Math.cos(yaw) * Math.sin(pitch)];
  const eye = target.map((t, i) => t - distance * forward[i]);
  const along = (axis) => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
  const turn = [right[0], -down[0], -forward[0], 0, right[1], -down[1], -forward[1], 0,
                right[2], -down[2], -forward[2], 0, along(right), -along(down), -along(forward), 1];
  const f = 1 / Math.tan(angle / 2), near = 0.02, far = 200;
  const wide = aspect > 1 ? f / aspect : f, high = aspect > 1 ? f : f * aspect;
  const project = [wide, 0, 0, 0, 0, high, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
  return multiply(project, turn);
}

export const newView = () => ({name: 'orbit', yaw: 0.5, pitch: 0.35, distance: 0, target: [0, 0, 1], angle: 0.8, placed: false});

/// Camera position of the view. Centre and extent of the cloud are in m.
export function place(view, name, {middle, extent}) {
  view.name = name;
  view.placed = true;
  view.target = [...middle];
  view.distance = 1.9 * extent;
  [view.yaw, view.pitch] = {orbit: [0.5, 0.35], top: [0, 1.5707], side: [-1.5707, 0], camera: [0, 0]}[name];
  if (name === 'camera') { view.target = [0, 0, middle[2]]; view.distance = middle[2]; }
}

function usesSoftware() {
  const wish = new URLSearchParams(location.search).get('renderer');
  if (wish) return wish !== 'webgl';
  const gl = document.createElement('canvas').getContext('webgl2'), names = gl && gl.getExtension('WEBGL_debug_renderer_info');
  return !gl || (names && /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(names.UNMASKED_RENDERER_WEBGL)));
}
const software = usesSoftware();

export class Cloud {
  size = 1;
  count = 0;

  constructor(canvas) {
    this.canvas = canvas;
    this.points = software ? new DrawnPoints(canvas) : new GlPoints(canvas);
  }

  /// Accepts a frame. @param by depth, amplitude, sigma, flags, z: the quantity shown as colour
  /// @returns the range of the colours, or null if there is no cloud
  take(channels, rays, info, by) {
    this.count = 0;
    const cloud = cloudOf(channels, rays, info);
    if (!cloud) return null;
    this.count = cloud.channel.rows * cloud.channel.columns;
    this.apart = 1 / Math.max(rays ? rays.columns : 300, 1);
    this.measured = () => this.measure(rays, cloud);
    const colours = this.coloursOf(channels, cloud, by);
    this.points.take(cloud, rays, colours);
    return colours;
  }

  /// Colour scale: by codes, flags or z, with the codes or lengths at both ends.
  coloursOf(channels, cloud, by) {
    const same = (c) => c && c.rows === cloud.channel.rows && c.columns === cloud.channel.columns;
    const wanted = by === 'depth' ? channels.depth || channels.range || channels.points : channels[by];
    if (by === 'flags' && same(channels.flags)) return {mode: 'flags', codes: channels.flags.codes, from: 0, to: 1, words: true};
    if (by !== 'z' && same(wanted) && wanted.codes) {
      const [from, to] = codeRange(wanted), value = (code) => wanted.offset + (code - 1) * wanted.step;
      return {mode: 'codes', codes: wanted.codes, from, to, low: value(from), high: value(to), unit: wanted.unit, name: wanted.name};
    }
    if (!this.range || ++this.sinceRange > 30) { this.range = this.measured().z; this.sinceRange = 0; }
    const [low, high] = this.range;
    return {mode: 'z', codes: null, from: low, to: high, low, high, unit: 'm', name: 'z'};
  }

  /// Centre, extent and range of z of the cloud, estimated from a subset of its points.
  measure(rays, cloud) {
    const {channel} = cloud, x = [], y = [], z = [];
    const every = Math.max(1, Math.floor(this.count / 4000));
    for (let i = 0; i < this.count; i += every) {
      let p;
      if (channel.points) p = channel.points.subarray(3 * i, 3 * i + 3);
      else {
        if (channel.codes[i] === 0) continue;
        let length = channel.offset + (channel.codes[i] - 1) * channel.step - cloud.shift;
        if (cloud.alongZ) length /= rays.values[3 * i + 2];
        p = [0, 1, 2].map((k) => length * rays.values[3 * i + k]);
      }
      if (p[0] !== p[0]) continue;
      x.push(p[0]); y.push(p[1]); z.push(p[2]);
    }
    if (x.length === 0) return {middle: [0, 0, 1], extent: 1, z: [0, 1]};
    const sorted = [x, y, z].map((values) => values.sort((a, b) => a - b));
    const at = (values, share) => values[Math.floor(share * (values.length - 1))];
    const range = [at(sorted[2], 0.01), Math.max(at(sorted[2], 0.99), at(sorted[2], 0.01) + 1e-3)];
    return {middle: sorted.map((values) => at(values, 0.5)),
            extent: Math.max(0.1, ...sorted.map((values) => at(values, 0.97) - at(values, 0.03))), z: range};
  }

  draw(view) {
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const wide = Math.max(1, Math.round(this.canvas.clientWidth * scale)), high = Math.max(1, Math.round(this.canvas.clientHeight * scale));
    if (this.canvas.width !== wide || this.canvas.height !== high) { this.canvas.width = wide; this.canvas.height = high; }
    this.points.draw(matrixOf(view, wide / high), this.size * Math.min(wide, high) * (this.apart || 0) * 1.6, this.count);
  }
}
