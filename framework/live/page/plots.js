// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Histogram, profile along a line, temporal noise of a region.
import {valueAt} from './decode.js';
import {css, quantity} from './images.js';
import {LINES} from './colours.js';

function axes(canvas, x, y) {
  const scale = Math.min(window.devicePixelRatio || 1, 2);
  canvas.width = canvas.clientWidth * scale || canvas.width;
  canvas.height = 150 * scale;
  const context = canvas.getContext('2d');
  context.scale(scale, scale);
  const wide = canvas.width / scale, high = canvas.height / scale, left = 64, bottom = 20;
  context.clearRect(0, 0, wide, high);
  context.font = '11px system-ui, sans-serif';
  context.fillStyle = '#5c6873';
  context.strokeStyle = '#d5d9de';
  context.strokeRect(left, 4, wide - left - 6, high - 4 - bottom);
  const text = (value, unit) => quantity(value, unit, 4);
  context.textAlign = 'left';
  context.fillText(text(x.low, x.unit), left, high - 6);
  context.textAlign = 'right';
  context.fillText(text(x.high, x.unit), wide - 6, high - 6);
  context.fillText(text(y.high, y.unit).replace(' ', '\u2009'), left - 3, 13);
  context.fillText(text(y.low, y.unit).replace(' ', '\u2009'), left - 3, high - bottom);
  const place = (value, axis, from, to) => from + (value - axis.low) / (axis.high - axis.low || 1) * (to - from);
  return {context, px: (value) => place(value, x, left, wide - 6), py: (value) => place(value, y, high - bottom, 4)};
}

export const wholeRegion = (channel) => [0, 0, channel.columns - 1, channel.rows - 1];

export function valuesIn(channel, region) {
  const [x0, y0, x1, y1] = region, values = [];
  for (let y = y0; y <= Math.min(y1, channel.rows - 1); ++y)
    for (let x = x0; x <= Math.min(x1, channel.columns - 1); ++x) {
      const value = valueAt(channel, y * channel.columns + x);
      if (!Number.isNaN(value)) values.push(value);
    }
  return values;
}

export const median = (values) => {
  if (values.length === 0) return NaN;
  const sorted = Float64Array.from(values).sort();
  return sorted[Math.floor((sorted.length - 1) / 2)];
};

export function drawHistogram(canvas, channel, region) {
  const values = valuesIn(channel, region), sorted = Float64Array.from(values).sort();
  if (sorted.length === 0) return canvas.getContext('2d').clearRect(0, 0, canvas.width, canvas.height);
  const low = sorted[Math.floor(0.002 * (sorted.length - 1))], high = Math.max(sorted[Math.ceil(0.998 * (sorted.length - 1))], low + (channel.step || 1));
  const bins = new Array(64).fill(0);
  for (const value of values) {
    const bin = Math.floor((value - low) / (high - low) * 64);
    if (bin >= 0 && bin <= 64) ++bins[Math.min(bin, 63)];
  }
  const most = Math.max(...bins);
  const {context, px, py} = axes(canvas, {low, high, unit: channel.unit}, {low: 0, high: most, unit: ''});
  context.fillStyle = css(LINES[0]);
  bins.forEach((count, i) => {
    const left = px(low + i * (high - low) / 64), right = px(low + (i + 1) * (high - low) / 64);
    context.fillRect(left, py(count), Math.max(right - left - 1, 1), py(0) - py(count));
  });
}

const stepsOf = ([x0, y0, x1, y1]) => Math.max(Math.abs(x1 - x0), Math.abs(y1 - y0), 1);

/// Values at the pixels that a line crosses; NaN outside the image, which may be smaller than the one with the line.
export function valuesAlong(channel, line) {
  const [x0, y0, x1, y1] = line, steps = stepsOf(line);
  return Array.from({length: steps + 1}, (_, k) => {
    const x = Math.round(x0 + (x1 - x0) * k / steps), y = Math.round(y0 + (y1 - y0) * k / steps);
    return x < channel.columns && y < channel.rows ? valueAt(channel, y * channel.columns + x) : NaN;
  });
}

/// Profile along a line. @param series [{channel}]: one curve per channel
export function drawProfile(canvas, series, line) {
  const steps = stepsOf(line), lines = series.map(({channel}) => valuesAlong(channel, line));
  const all = lines.flat().filter((value) => !Number.isNaN(value));
  if (all.length === 0) return;
  const low = Math.min(...all), high = Math.max(...all, low + (series[0].channel.step || 1));
  const {context, px, py} = axes(canvas, {low: 0, high: steps, unit: 'px'}, {low, high, unit: series[0].channel.unit});
  lines.forEach((values, i) => {
    context.strokeStyle = css(LINES[i]);
    context.beginPath();
    let down = false;
    values.forEach((value, k) => {
      if (!Number.isNaN(value)) down ? context.lineTo(px(k), py(value)) : context.moveTo(px(k), py(value));
      down = !Number.isNaN(value);
    });
    context.stroke();
  });
}

/// Temporal noise: standard deviation of each pixel over the frames, and its median over the region; a large region is
/// subsampled.
export function temporalNoise(channels, region) {
  const [x0, y0, x1, y1] = region, deviations = [];
  const columns = channels[0].columns, samples = (x1 - x0 + 1) * (y1 - y0 + 1) * channels.length;
  const every = Math.max(1, Math.ceil(Math.sqrt(samples / 150000)));
  for (let y = y0; y <= Math.min(y1, channels[0].rows - 1); y += every)
    for (let x = x0; x <= Math.min(x1, columns - 1); x += every) {
      let n = 0, mean = 0, squares = 0;
      for (const channel of channels) {
        const value = valueAt(channel, y * columns + x);
        if (Number.isNaN(value)) continue;
        const difference = value - mean;
        mean += difference / ++n;
        squares += difference * (value - mean);
      }
      if (n > 1 && n >= channels.length / 2) deviations.push(Math.sqrt(squares / (n - 1)));
    }
  return {median: median(deviations), pixels: deviations.length, frames: channels.length};
}
