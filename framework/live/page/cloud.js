// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The cloud: the vertex shader makes each point from the ray of its pixel and a 16-bit code.
import {RISING, FLAGS, NO_FLAG, OTHER_FLAG} from './colours.js';
import {cloudOf, codeRange} from './decode.js';

const VERTEX = `#version 300 es
precision highp float; precision highp int; precision highp usampler2D; precision highp sampler2D;
uniform mat4 matrix;
uniform usampler2D lengths, shades, flags;
uniform sampler2D rays, points, colours;
uniform int columns, mode, source;         // mode: 0 codes, 1 flags, 2 z; source: 0 codes along rays, 1 along z, 2 points
uniform float offset, step_, shift, low, high, size;
uniform vec3 palette[17];
out vec3 colour;
void main() {
  ivec2 at = ivec2(gl_VertexID % columns, gl_VertexID / columns);
  vec3 p;
  bool valid = true;
  if (source == 2) {
    p = texelFetch(points, at, 0).xyz;
    valid = !(isnan(p.x) || isnan(p.y) || isnan(p.z));
  } else {
    uint code = texelFetch(lengths, at, 0).r;
    vec3 ray = texelFetch(rays, at, 0).xyz;
    float length_ = offset + (float(code) - 1.0) * step_ - shift;
    valid = code != 0u && ray.z > 0.0 && length_ > 0.0;
    p = ray * (source == 1 ? length_ / ray.z : length_);
  }
  if (mode == 1) {
    uint bits = texelFetch(flags, at, 0).r;
    int which = bits == 0u ? 15 : 16;
    for (int i = 10; i >= 0; --i) if ((bits >> uint(i) & 1u) != 0u) which = i;
    colour = palette[which];
  } else {
    uint shade = mode == 2 ? 0u : texelFetch(shades, at, 0).r;
    float share = ((mode == 2 ? p.z : float(shade)) - low) / (high - low);
    colour = mode == 0 && shade == 0u ? vec3(0.67) : texture(colours, vec2(clamp(share, 0.002, 0.998), 0.5)).rgb;
  }
  gl_Position = valid ? matrix * vec4(p, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = clamp(size / max(gl_Position.w, 0.05), 1.0, 12.0);
}`;
const FRAGMENT = `#version 300 es
precision mediump float;
in vec3 colour;
out vec4 result;
void main() { result = vec4(colour, 1.0); }`;

const rgb = (hex) => [hex >> 16 & 255, hex >> 8 & 255, hex & 255];

function multiply(a, b) {  // columns first, as WebGL has them
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

/// View and projection for an eye around a target; the optical frame has x right, y down, z forward.
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

/// One of the views: where the eye is. @param middle of the cloud, m @param extent of it, m
export function place(view, name, middle, extent) {
  view.name = name;
  view.placed = true;
  view.target = [...middle];
  view.distance = 1.5 * extent;
  [view.yaw, view.pitch] = {orbit: [0.5, 0.35], top: [0, 1.5707], side: [-1.5707, 0], camera: [0, 0]}[name];
  if (name === 'camera') { view.target = [0, 0, middle[2]]; view.distance = middle[2]; }
}

export class Cloud {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext('webgl2', {antialias: false, preserveDrawingBuffer: true});
    if (!gl) return;
    this.gl = gl;
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    this.at = (name) => gl.getUniformLocation(program, name);
    this.textures = {};
    ['lengths', 'shades', 'flags', 'rays', 'points', 'colours'].forEach((name, unit) => {
      const texture = gl.createTexture();
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      const filter = name === 'colours' ? gl.LINEAR : gl.NEAREST;
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.uniform1i(this.at(name), unit);
      this.textures[name] = unit;
    });
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const bytes = new Uint8Array(RISING.flatMap((c) => [...rgb(c), 255]));
    gl.activeTexture(gl.TEXTURE0 + this.textures.colours);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, RISING.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const palette = Array(17).fill([0, 0, 0]);
    FLAGS.forEach((flag) => { palette[Math.log2(flag.bit)] = rgb(flag.colour); });
    palette[15] = rgb(NO_FLAG);
    palette[16] = rgb(OTHER_FLAG);
    gl.uniform3fv(this.at('palette'), palette.flat().map((v) => v / 255));
    this.put('shades', 1, 1, new Uint16Array(1));
    this.put('flags', 1, 1, new Uint16Array(1));
    this.put('lengths', 1, 1, new Uint16Array(1));
    this.putFloats('rays', 1, 1, new Float32Array(3));
    this.putFloats('points', 1, 1, new Float32Array(3));
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0.063, 0.082, 0.106, 1);
    this.count = 0;
  }

  put(name, columns, rows, codes) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + this.textures[name]);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, columns, rows, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT, codes);
  }
  putFloats(name, columns, rows, values) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + this.textures[name]);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB32F, columns, rows, 0, gl.RGB, gl.FLOAT, values);
  }

  /// Takes a frame. @param by depth, amplitude, sigma, flags, z: what the colours mean
  /// @returns the range of the colours, or null when there is no cloud
  take(channels, rays, info, by) {
    this.count = 0;
    const gl = this.gl, cloud = gl && cloudOf(channels, rays, info);
    if (!cloud) return null;
    const {channel} = cloud, {rows, columns} = channel;
    if (channel.points) {
      const wide = Math.min(columns, 2048), tall = Math.ceil(rows * columns / wide);
      const filled = new Float32Array(wide * tall * 3).fill(NaN);
      filled.set(channel.points);
      this.putFloats('points', wide, tall, filled);
      this.columns = wide;
      this.count = rows * columns;
    } else {
      if (this.rays !== rays) this.putFloats('rays', columns, rows, rays.values);
      this.rays = rays;
      this.put('lengths', columns, rows, channel.codes);
      this.columns = columns;
      this.count = rows * columns;
    }
    gl.uniform1i(this.at('columns'), this.columns);
    gl.uniform1i(this.at('source'), channel.points ? 2 : cloud.alongZ ? 1 : 0);
    gl.uniform1f(this.at('offset'), channel.offset || 0);
    gl.uniform1f(this.at('step_'), channel.step || 1);
    gl.uniform1f(this.at('shift'), cloud.shift);
    this.frameCloud(channels, rays, cloud);
    return this.shade(channels, cloud, by);
  }

  shade(channels, cloud, by) {
    const gl = this.gl, same = (c) => c && c.rows === cloud.channel.rows && c.columns === cloud.channel.columns;
    const wanted = by === 'depth' ? channels.depth || channels.range || channels.points : channels[by];
    const set = (mode, low, high) => {
      gl.uniform1i(this.at('mode'), mode);
      gl.uniform1f(this.at('low'), low);
      gl.uniform1f(this.at('high'), high);
    };
    const fold = (codes) => {  // a cloud without rows is folded as its points are
      if (this.columns === cloud.channel.columns) return codes;
      const folded = new Uint16Array(this.columns * Math.ceil(codes.length / this.columns));
      folded.set(codes);
      return folded;
    };
    const tall = Math.ceil(this.count / this.columns);
    if (by === 'flags' && same(channels.flags)) {
      this.put('flags', this.columns, tall, fold(channels.flags.codes));
      set(1, 0, 1);
      return {words: true};
    }
    if (by !== 'z' && same(wanted) && wanted.codes) {
      const [low, high] = codeRange(wanted);
      this.put('shades', this.columns, tall, fold(wanted.codes));
      set(0, low, high);
      const value = (code) => wanted.offset + (code - 1) * wanted.step;
      return {low: value(low), high: value(high), unit: wanted.unit, name: wanted.name};
    }
    const [low, high] = this.zRange;
    set(2, low, high);
    return {low, high, unit: 'm', name: 'z'};
  }

  /// Middle and extent of the cloud, from some of its points.
  frameCloud(channels, rays, cloud) {
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
    if (x.length === 0) { this.middle = [0, 0, 1]; this.extent = 1; this.zRange = [0, 1]; return; }
    const sorted = [x, y, z].map((values) => values.sort((a, b) => a - b));
    const at = (values, share) => values[Math.floor(share * (values.length - 1))];
    this.middle = sorted.map((values) => at(values, 0.5));
    this.extent = Math.max(0.1, ...sorted.map((values) => at(values, 0.97) - at(values, 0.03)));
    this.zRange = [at(sorted[2], 0.01), Math.max(at(sorted[2], 0.99), at(sorted[2], 0.01) + 1e-3)];
  }

  draw(view) {
    const gl = this.gl;
    if (!gl) return;
    const scale = Math.min(window.devicePixelRatio || 1, 2);
    const wide = Math.max(1, Math.round(this.canvas.clientWidth * scale)), high = Math.max(1, Math.round(this.canvas.clientHeight * scale));
    if (this.canvas.width !== wide || this.canvas.height !== high) { this.canvas.width = wide; this.canvas.height = high; }
    gl.viewport(0, 0, wide, high);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (this.count === 0) return;
    gl.uniformMatrix4fv(this.at('matrix'), false, matrixOf(view, wide / high));
    const apart = this.rays ? 1 / Math.max(this.rays.columns, 1) : 0.003;
    gl.uniform1f(this.at('size'), this.size * Math.min(wide, high) * apart * 1.6);
    gl.drawArrays(gl.POINTS, 0, this.count);
  }

  size = 1;
}
