// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// One node: its cloud and its images.
import {Cloud, place} from './cloud.js';
import {ImageView, flagWords, gradient, quantity} from './images.js';
import {valueAt} from './decode.js';

const ORDER = ['depth', 'range', 'distance', 'amplitude', 'intensity', 'sigma', 'flags'];

export class Pane {
  /// @param shared view, colour, size and marks of all panes @param redraw called after a change of these
  constructor(parent, shared, redraw) {
    this.shared = shared;
    this.redraw = redraw;
    this.images = {};
    this.root = document.createElement('div');
    this.root.className = 'pane';
    this.root.innerHTML = `
      <div class="bar"><strong></strong>
        <span class="group">${['orbit', 'top', 'side', 'camera'].map((v) => `<button data-view="${v}">${v}</button>`).join('')}</span>
        <label>colour <select class="by">${['depth', 'amplitude', 'sigma', 'flags', 'z'].map((v) => `<option>${v}</option>`).join('')}</select></label>
        <label>points <input class="size" type="range" min="0.3" max="4" step="0.1" value="1"></label>
      </div>
      <div class="cloud"><canvas></canvas><div class="legend"><div></div><div class="bar-of-colours"></div></div><div class="note"></div></div>
      <div class="images"></div>`;
    parent.append(this.root);
    const find = (selector) => this.root.querySelector(selector);
    this.title = find('strong');
    this.note = find('.note');
    [this.legend, this.colours] = find('.legend').children;
    this.colours.style.background = gradient;
    this.box = find('.images');
    this.cloud = new Cloud(find('.cloud canvas'));
    for (const button of this.root.querySelectorAll('[data-view]')) {
      button.onclick = () => { if (this.cloud.count > 0) place(shared.view, button.dataset.view, this.cloud.measured()); redraw(); };
    }
    find('.by').onchange = ({target}) => { shared.by = target.value; redraw(); };
    find('.size').oninput = ({target}) => { shared.size = Number(target.value); redraw(); };
    this.turn(find('.cloud canvas'));
  }

  turn(canvas) {
    const {view} = this.shared;
    canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
    canvas.onpointermove = (event) => {
      if (!event.buttons) return;
      const x = event.movementX, y = event.movementY;
      if (event.buttons === 1 && !event.shiftKey) {
        view.yaw += x * 0.006;
        view.pitch = Math.max(-1.5707, Math.min(1.5707, view.pitch + y * 0.006));
      } else {
        const step = view.distance * 0.0012;
        view.target[0] -= Math.cos(view.yaw) * x * step;
        view.target[2] += Math.sin(view.yaw) * x * step;
        view.target[1] -= y * step;
      }
      this.redraw();
    };
    canvas.onwheel = (event) => {
      event.preventDefault();
      view.distance *= Math.exp(event.deltaY * 0.001);
      this.redraw();
    };
    canvas.oncontextmenu = (event) => event.preventDefault();
  }

  shownImages() { return Object.values(this.images); }

  take(info, channels, rays) {
    Object.assign(this, {info, channels, rays});
    this.title.textContent = info.name;
    const names = Object.keys(channels).filter((name) => channels[name].codes && name !== 'points');
    names.sort((a, b) => (ORDER.indexOf(a) + 1 || 99) - (ORDER.indexOf(b) + 1 || 99));
    if (names.join() !== Object.keys(this.images).join()) {
      this.images = {};
      this.box.replaceChildren();
      for (const name of names) {
        this.images[name] = new ImageView(name);
        this.box.append(this.images[name].figure);
        this.point(this.images[name]);
      }
    }
    this.draw();
  }

  /// Handles the mouse on an image: selects pixel, region, line.
  point(image) {
    const {canvas} = image, {marks} = this.shared;
    const pixel = (event) => {
      const box = canvas.getBoundingClientRect();
      const clamp = (value, most) => Math.max(0, Math.min(most - 1, Math.floor(value)));
      return [clamp((event.clientX - box.left) / box.width * canvas.width, canvas.width),
              clamp((event.clientY - box.top) / box.height * canvas.height, canvas.height)];
    };
    let start = null;
    canvas.onpointerdown = (event) => { start = pixel(event); canvas.setPointerCapture(event.pointerId); };
    canvas.onpointerup = () => { start = null; };
    canvas.onpointermove = (event) => {
      marks.pixel = pixel(event);
      marks.channel = image.name;
      if (start && event.shiftKey) marks.line = [...start, ...marks.pixel];
      else if (start) marks.region = [Math.min(start[0], marks.pixel[0]), Math.min(start[1], marks.pixel[1]),
                                      Math.max(start[0], marks.pixel[0]), Math.max(start[1], marks.pixel[1])];
      this.redraw();
    };
    canvas.ondblclick = () => { marks.region = marks.line = null; this.redraw(); };
  }

  draw() {
    if (!this.channels) return;
    const {view, by, size, marks} = this.shared;
    for (const [name, image] of Object.entries(this.images)) {
      image.take(this.channels[name]);
      image.mark(marks);
    }
    this.cloud.size = size;
    const colours = this.cloud.take(this.channels, this.rays, this.info, by);
    if (!view.placed && this.cloud.count > 0) place(view, 'orbit', this.cloud.measured());
    this.cloud.draw(view);
    this.note.textContent = colours ? '' : this.whyNoCloud();
    this.root.classList.toggle('no-cloud', !colours);
    this.colours.hidden = !colours || Boolean(colours.words);
    this.legend.textContent = !colours ? '' : colours.words ? 'flags: colours as in the image'
        : `${colours.name} ${quantity(colours.low, colours.unit, 4)} to ${quantity(colours.high, colours.unit, 4)}`;
    for (const button of this.root.querySelectorAll('[data-view]')) button.classList.toggle('on', button.dataset.view === view.name);
    this.root.querySelector('.by').value = by;
  }

  whyNoCloud() {
    if (!this.info.rays) return 'No cloud: the pipeline has no camera, so the rays of the pixels are unknown.';
    const names = Object.keys(this.channels);
    if (names.includes('distance') && !names.includes('depth') && !names.includes('range'))
      return 'No cloud: distance is half of the travelled path. Look at a node behind a distance model.';
    return 'No cloud: this node has no points, range or depth that fits the rays of the camera.';
  }

  /// All channels of a pixel: [name, value as text].
  valuesAt([x, y]) {
    return Object.values(this.channels).filter((c) => x < c.columns && y < c.rows && (c.codes || c.rows > 1)).map((channel) => {
      const i = y * channel.columns + x;
      if (channel.type === 'points') {  // a moved cloud: the range from the camera is unknown
        const place = Array.from(channel.points.subarray(3 * i, 3 * i + 3));
        return [channel.name, place.some(Number.isNaN) ? 'no value' : place.map((v) => quantity(v, channel.unit, 6)).join(', ')];
      }
      const value = valueAt(channel, i);
      if (channel.type === 'bits') return [channel.name, flagWords(value)];
      const name = channel.name === 'points' ? 'range of the point' : channel.name;
      return [name, quantity(value, channel.unit, 6) + (Number.isNaN(value) ? '' : ` \u00b1 ${quantity(channel.step / 2, channel.unit, 2)}`)];
    });
  }
}
