// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Draws points one by one into an image with a depth buffer, if there is no GPU.
import {pointsOf} from './decode.js';
import {codeColours, colourWords, flagWord} from './images.js';

const BACKGROUND = 0xff1b1510;  // 0xAABBGGRR

export class DrawnPoints {
  constructor(canvas) { this.context = canvas.getContext('2d', {alpha: false, willReadFrequently: true}); }

  take(cloud, rays, colours) {
    this.positions(cloud, rays);
    const {points} = this, count = points.length / 3, {codes, from, to} = colours, scale = 1023 / (to - from);
    if (!this.words || this.words.length !== count) this.words = new Uint32Array(count);
    const {words} = this;
    if (colours.mode === 'codes') {
      const of = this.colours = codeColours([from, to], this.colours);
      for (let i = 0; i < count; ++i) words[i] = of[codes[i]];
      return;
    }
    for (let i = 0; i < count; ++i) {
      if (colours.mode === 'flags') { words[i] = flagWord(codes[i]); continue; }
      const place = (points[3 * i + 2] - from) * scale;
      words[i] = colourWords[place < 0 ? 0 : place > 1023 ? 1023 : place | 0];
    }
  }

  positions(cloud, rays) {
    const {channel} = cloud;
    if (channel.points) { this.points = channel.points; return; }
    const {codes, offset, step} = channel, count = codes.length;
    if (this.rays !== rays || this.alongZ !== cloud.alongZ) {
      this.directions = Float32Array.from(rays.values, (v, k) => cloud.alongZ ? v / rays.values[k - k % 3 + 2] : v);
      this.points = new Float32Array(count * 3);
      this.rays = rays;
      this.alongZ = cloud.alongZ;
    }
    const {points, directions} = this;
    for (let i = 0; i < count; ++i) {
      const length = codes[i] === 0 ? NaN : offset + (codes[i] - 1) * step - cloud.shift;
      points[3 * i] = length * directions[3 * i];
      points[3 * i + 1] = length * directions[3 * i + 1];
      points[3 * i + 2] = length * directions[3 * i + 2];
    }
  }

  draw(matrix, size, count) {
    const {canvas} = this.context, wide = canvas.width, high = canvas.height;
    if (!this.image || this.image.width !== wide || this.image.height !== high) {
      this.image = new ImageData(wide, high);
      this.pixels = new Uint32Array(this.image.data.buffer);
      this.nearest = new Float32Array(wide * high);
    }
    const {pixels, nearest, points, words} = this;
    pixels.fill(BACKGROUND);
    nearest.fill(Infinity);
    const m = matrix;
    for (let i = 0; i < count; ++i) {
      const x = points[3 * i], y = points[3 * i + 1], z = points[3 * i + 2];
      const w = m[3] * x + m[7] * y + m[11] * z + m[15];
      if (!(w > 0.02)) continue;  // behind the eye, or NaN
      const side = Math.max(1, Math.min(12, Math.round(size / w)));
      const left = Math.round(((m[0] * x + m[4] * y + m[8] * z + m[12]) / w + 1) * wide / 2 - side / 2);
      const top = Math.round((1 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) * high / 2 - side / 2);
      if (left < 0 || top < 0 || left + side > wide || top + side > high) continue;
      const colour = words[i];
      for (let row = top; row < top + side; ++row)
        for (let at = row * wide + left, end = at + side; at < end; ++at)
          if (w < nearest[at]) { nearest[at] = w; pixels[at] = colour; }
    }
    this.context.putImageData(this.image, 0, 0);
  }
}
