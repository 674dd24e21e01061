// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Draws points with the GPU: the vertex shader computes each from the ray of its pixel and a 16-bit code.
import {RISING, FLAGS, NO_FLAG, OTHER_FLAG} from './colours.js';

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
    if ((bits & 1u) != 0u) which = 0;
    for (int i = 10; i >= 1; --i) if ((bits >> uint(i) & 1u) != 0u) which = i;
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

export class GlPoints {
  constructor(canvas) {
    const gl = this.gl = canvas.getContext('webgl2', {antialias: false, preserveDrawingBuffer: true});
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
    this.units = {};
    ['lengths', 'shades', 'flags', 'rays', 'points', 'colours'].forEach((name, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
      const filter = name === 'colours' ? gl.LINEAR : gl.NEAREST;
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.uniform1i(this.at(name), unit);
      this.units[name] = unit;
    });
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const bytes = new Uint8Array(RISING.flatMap((c) => [...rgb(c), 255]));
    gl.activeTexture(gl.TEXTURE0 + this.units.colours);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, RISING.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    const palette = Array(17).fill([0, 0, 0]);
    FLAGS.forEach((flag) => { palette[Math.log2(flag.bit)] = rgb(flag.colour); });
    palette[15] = rgb(NO_FLAG);
    palette[16] = rgb(OTHER_FLAG);
    gl.uniform3fv(this.at('palette'), palette.flat().map((v) => v / 255));
    for (const name of ['lengths', 'shades', 'flags']) this.put(name, 1, new Uint16Array(1));
    for (const name of ['rays', 'points']) this.putFloats(name, 1, new Float32Array(3));
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0.063, 0.082, 0.106, 1);
  }

  put(name, columns, codes) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + this.units[name]);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, columns, codes.length / columns, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT, codes);
  }
  putFloats(name, columns, values) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE0 + this.units[name]);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB32F, columns, values.length / 3 / columns, 0, gl.RGB, gl.FLOAT, values);
  }

  take(cloud, rays, colours) {
    const gl = this.gl, {channel} = cloud, count = channel.rows * channel.columns;
    const columns = channel.points ? Math.min(count, 2048) : channel.columns;  // a cloud without rows is folded
    const folded = (values, per, Type) => {
      const whole = Math.ceil(count / columns) * columns * per;
      if (values.length === whole) return values;
      const filled = new Type(whole).fill(per === 3 ? NaN : 0);
      filled.set(values);
      return filled;
    };
    if (channel.points) {
      this.putFloats('points', columns, folded(channel.points, 3, Float32Array));
    } else {
      if (this.rays !== rays) this.putFloats('rays', columns, rays.values);
      this.rays = rays;
      this.put('lengths', columns, channel.codes);
    }
    if (colours.codes) this.put(colours.mode === 'flags' ? 'flags' : 'shades', columns, folded(colours.codes, 1, Uint16Array));
    gl.uniform1i(this.at('columns'), columns);
    gl.uniform1i(this.at('source'), channel.points ? 2 : cloud.alongZ ? 1 : 0);
    gl.uniform1i(this.at('mode'), {codes: 0, flags: 1, z: 2}[colours.mode]);
    for (const [name, value] of Object.entries({offset: channel.offset || 0, step_: channel.step || 1, shift: cloud.shift, low: colours.from, high: colours.to}))
      gl.uniform1f(this.at(name), value);
  }

  draw(matrix, size, count) {
    const {gl} = this;
    gl.viewport(0, 0, gl.canvas.width, gl.canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (count === 0) return;
    gl.uniformMatrix4fv(this.at('matrix'), false, matrix);
    gl.uniform1f(this.at('size'), size);
    gl.drawArrays(gl.POINTS, 0, count);
  }
}
