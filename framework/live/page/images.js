// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Images in false colours with their legends.
import {RISING, FLAGS, INVALID, NO_FLAG, OTHER_FLAG} from './colours.js';
import {codeRange} from './decode.js';

const word = (hex) => 0xff000000 | (hex & 255) << 16 | hex & 0xff00 | hex >> 16 & 255;  // 0xAABBGGRR
export const colourWords = new Uint32Array(1024);
for (let i = 0; i < 1024; ++i) {
  const place = i / 1023 * (RISING.length - 1), first = Math.min(Math.floor(place), RISING.length - 2), part = place - first;
  const mix = (shift) => Math.round((RISING[first] >> shift & 255) * (1 - part) + (RISING[first + 1] >> shift & 255) * part);
  colourWords[i] = word(mix(16) << 16 | mix(8) << 8 | mix(0));
}
/// Colour of a pixel's flags: the reason takes precedence over the bit `invalid`.
const flagColours = FLAGS.map((flag) => [flag.bit, word(flag.colour)]);
export function flagWord(bits) {
  if (bits === 0) return word(NO_FLAG);
  const reason = flagColours.find(([bit]) => bits & bit && bit !== 1);
  return reason ? reason[1] : bits & 1 ? flagColours[0][1] : word(OTHER_FLAG);
}
/// Colours of all codes: codes outside the range are clamped to its ends, 0 is grey.
export function codeColours([low, high], words = new Uint32Array(65536)) {
  words.fill(colourWords[0], 1, low).fill(colourWords[1023], high + 1);
  for (let code = low; code <= high; ++code) words[code] = colourWords[(code - low) / (high - low) * 1023 | 0];
  words[0] = word(INVALID);
  return words;
}
export const css = (hex) => '#' + hex.toString(16).padStart(6, '0');
export const gradient = `linear-gradient(90deg, ${RISING.map(css).join(', ')})`;

/// Names of the flags of a pixel.
export function flagWords(bits) {
  if (bits === 0) return 'good';
  const words = FLAGS.filter((flag) => bits & flag.bit).map((flag) => flag.name);
  const rest = FLAGS.reduce((left, flag) => left & ~flag.bit, bits);
  return [...words, ...(rest ? [`bits ${rest}`] : [])].join(', ');
}

/// Length as text in millimetres, from 100 m on in metres; other values with their unit.
export function quantity(value, unit, digits = 5) {
  if (Number.isNaN(value)) return 'no value';
  const text = (v) => Number(v.toPrecision(digits)).toString();
  return unit === 'm' && Math.abs(value) < 100 ? `${text(value * 1000)} mm` : `${text(value)}${unit ? ' ' + unit : ''}`;
}

export class ImageView {
  constructor(name) {
    this.name = name;
    this.figure = document.createElement('figure');
    this.figure.innerHTML = '<figcaption><b></b><span></span></figcaption><canvas></canvas><div></div>';
    this.figure.querySelector('b').textContent = name;
    this.canvas = this.figure.querySelector('canvas');
    this.context = this.canvas.getContext('2d', {willReadFrequently: true});  // drawn in software
    this.legend = this.figure.querySelector('div');
    this.range = null;
  }

  take(channel) {
    this.channel = channel;
    const {rows, columns, codes} = channel;
    if (this.canvas.width !== columns || this.canvas.height !== rows || !this.picture) {
      this.canvas.width = columns;
      this.canvas.height = rows;
      this.picture = new ImageData(columns, rows);
      this.words = new Uint32Array(this.picture.data.buffer);
    }
    if (channel.type === 'bits') this.paintFlags(codes);
    else this.paintCodes(channel);
    this.context.putImageData(this.picture, 0, 0);
  }

  paintFlags(codes) {
    let seen = 0;
    for (let i = 0; i < codes.length; ++i) {
      const bits = codes[i];
      seen |= bits;
      this.words[i] = flagWord(bits);
    }
    const shown = FLAGS.filter((flag) => seen & flag.bit);
    this.legend.className = 'words';
    if (this.seen === seen) return;
    this.seen = seen;
    this.legend.replaceChildren(...[{name: 'good', colour: NO_FLAG}, ...shown].map((flag) => {
      const entry = document.createElement('span'), mark = document.createElement('i');
      mark.style.background = css(flag.colour);
      entry.append(mark, flag.name);
      return entry;
    }));
  }

  paintCodes(channel) {
    const {codes, offset, step, unit} = channel, [low, high] = codeRange(channel), {words} = this;
    const colours = this.colours = codeColours([low, high], this.colours);
    for (let i = 0; i < codes.length; ++i) words[i] = colours[codes[i]];
    const value = (code) => quantity(offset + (code - 1) * step, unit, 4);
    this.legend.className = 'scale';
    if (!this.bar) {
      this.legend.innerHTML = '<span></span><i></i><span></span>';
      this.legend.querySelector('i').style.background = gradient;
      this.bar = true;
    }
    const label = () => {
      this.labelled = performance.now();
      this.legend.firstChild.textContent = value(low);
      this.legend.lastChild.textContent = value(high);
    };
    const wait = 400 - (performance.now() - this.labelled);  // flickering text would be unreadable
    clearTimeout(this.later);
    if (wait > 0) this.later = setTimeout(label, wait);  // unless another picture comes before
    else label();
  }

  /// Marks on the image: a pixel, a region, a line, in pixels.
  mark({pixel, region, line}) {
    const {context} = this;
    context.lineWidth = Math.max(1, this.canvas.width / 200);
    context.strokeStyle = '#ff3b30';
    if (region) context.strokeRect(region[0], region[1], region[2] - region[0] + 1, region[3] - region[1] + 1);
    if (line) {
      context.beginPath();
      context.moveTo(line[0] + 0.5, line[1] + 0.5);
      context.lineTo(line[2] + 0.5, line[3] + 0.5);
      context.stroke();
    }
    if (!pixel) return;
    context.strokeStyle = '#ffffff';
    context.beginPath();
    context.arc(pixel[0] + 0.5, pixel[1] + 0.5, 3 * context.lineWidth, 0, 7);
    context.stroke();
  }
}
