// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// The live view: connection, frames kept for stepping back, panes, tools.
import {newView} from './cloud.js';
import {Pane} from './pane.js';
import {element, Parameters, showGraph, showStatistics} from './panels.js';
import {Session} from './session.js';
import {drawHistogram, drawProfile, temporalNoise, valuesIn, median, wholeRegion} from './plots.js';
import {download, pcdOf, pngOf} from './save.js';
import {quantity} from './images.js';

const KEPT = 100, KEPT_BYTES = 256 << 20;
const $ = (id) => document.getElementById(id);
const shared = {view: newView(), by: 'depth', size: 1, marks: {pixel: null, region: null, line: null, channel: null}};
const app = {frames: [], at: -1, paused: false, panes: [], shared, drawn: 0, rate: 0, shownNumber: -1};
window.tofgraph = app;  // for tests

let dirty = false, ended = false, tab = 'pixel';
const chosen = () => [$('node-a').value, $('node-b').value].filter((name, i, all) => name && all.indexOf(name) === i);
const status = (text, bad = false) => { $('status').textContent = text; $('status').classList.toggle('bad', bad); };
const schedule = () => { if (!dirty) { dirty = true; requestAnimationFrame(draw); } };

const parameters = new Parameters($('parameters'), (node, name, value) => session.set(node, name, value));
const session = app.session = new Session({
  hello(message) {
    session.nodes = message.nodes.filter((node) => node.channels.length > 0);
    const wishes = new URLSearchParams(location.search), names = session.nodes.map((node) => node.name);
    const fill = (select, first, wish) => {
      const before = select.value || wish;
      select.replaceChildren(...first, ...names.map((name) => new Option(name, name)));
      if (names.includes(before)) select.value = before;
    };
    const cloud = session.nodes.filter((node) => node.channels.some((c) => c.name === 'points')).pop();
    fill($('node-a'), [], wishes.get('node') || (cloud || session.nodes[session.nodes.length - 1]).name);
    fill($('node-b'), [new Option('nothing', '')], wishes.get('beside') || '');
    app.frames = [];
    app.at = -1;
    ended = false;
    status('live');
    choose();
    session.askState();
  },
  frame(frame) {
    const newest = app.frames[app.frames.length - 1];
    if (ended && newest && newest.number === frame.number) return;
    if (!app.paused) {
      app.frames.push(frame);
      let bytes = app.frames.reduce((sum, kept) => sum + kept.bytes, 0);
      while (app.frames.length > KEPT || (bytes > KEPT_BYTES && app.frames.length > 2)) bytes -= app.frames.shift().bytes;
      app.at = app.frames.length - 1;
      schedule();
    } else {
      session.held = true;  // a frame may still be in flight
    }
  },
  state(state) {
    app.state = state;
    $('pipeline').textContent = state.pipeline;
    parameters.update(state);
    if (tab === 'statistics') showStatistics($('statistics'), state);
    if (tab === 'graph') showGraph($('graph'), state);
  },
  answer(message) { parameters.answer(message); app.answer = message; session.askState(); },
  end() { ended = true; status('the pipeline has ended; the last frames stay'); session.next(); },
  status,
});
setInterval(() => session.askState(), 1000);

function choose() {
  const nodes = chosen();
  $('panes').replaceChildren();
  app.panes = nodes.map(() => new Pane($('panes'), shared, schedule));
  app.frames = app.frames.filter((frame) => nodes.every((name) => frame.nodes[name]));
  app.at = app.frames.length - 1;
  session.show(nodes, 40);
  session.next();
  schedule();
}

let second = performance.now(), inSecond = 0;
function draw() {
  dirty = false;
  const frame = app.frames[app.at];
  if (!frame) return;
  const nodes = chosen(), fresh = frame !== app.shown;
  if (fresh && !app.paused && !ended) session.next();  // it arrives while this one is drawn
  nodes.forEach((name, i) => {
    const info = session.nodes.find((node) => node.name === name);
    if (frame.nodes[name] && app.panes[i]) app.panes[i].take(info, frame.nodes[name], session.rays[name]);
  });
  if (fresh) {
    ++app.drawn;
    ++inSecond;
    if (app.shownNumber < 0) app.firstPicture = performance.now();
    app.shown = frame;
    app.shownNumber = frame.number;
  }
  const now = performance.now();
  if (now - second > 1000) { app.rate = inSecond * 1000 / (now - second); inSecond = 0; second = now; }
  const time = frame.integrationTime ? `, ${quantity(frame.integrationTime * 1000, 'ms', 3)}` : '';
  $('frame').textContent = `frame ${frame.number}${time}, ${app.paused ? `${app.at + 1} of ${app.frames.length} kept` : `${app.rate.toFixed(0)} pictures/s`}`;
  if (tab === 'pixel') tools(frame, fresh);
}

/// Names come from files, so they are inserted as text, never as HTML.
function tableRow(...cells) {
  const row = element('tr');
  row.append(...cells);
  return row;
}

let lastTools = 0, later = 0;
function tools(frame, fresh) {
  const {marks} = shared, pane = app.panes[0];
  if (!pane || !pane.channels) return;
  const rows = marks.pixel ? app.panes.map((p) => p.valuesAt(marks.pixel)) : [];
  const names = [...new Set(rows.flat().map(([name]) => name))];
  const number = (text, cell = 'td') => element(cell, text, {className: 'n'});
  $('cursor').replaceChildren();
  if (marks.pixel) {
    const heads = app.panes.length > 1 ? app.panes.map((p) => number(p.info.name, 'th')) : [element('th')];
    $('cursor').append(tableRow(element('th', `column ${marks.pixel[0]}, row ${marks.pixel[1]}`), ...heads));
  }
  for (const name of names)
    $('cursor').append(tableRow(element('td', name), ...rows.map((values) => number((values.find(([n]) => n === name) || ['', ''])[1]))));
  const now = performance.now();
  clearTimeout(later);
  if (fresh && now - lastTools < 500 && !app.paused) {  // the plots may skip frames, but not the last one
    later = setTimeout(schedule, 600 - (now - lastTools));
    return;
  }
  lastTools = now;
  const images = pane.shownImages().map((image) => image.name);
  const name = images.includes(marks.channel) && marks.channel !== 'flags' ? marks.channel : images.find((n) => n !== 'flags');
  const channel = pane.channels[name];
  if (!channel) return;
  const region = marks.region || wholeRegion(channel);
  $('histogram-title').textContent = `Histogram of ${name}, ${marks.region ? 'region' : 'whole image'}`;
  drawHistogram($('histogram'), channel, region);
  noise(name, region);
  const line = marks.line || [0, channel.rows >> 1, channel.columns - 1, channel.rows >> 1];
  $('profile-title').textContent = `Profile of ${name}, ${marks.line ? 'along the line' : 'middle row'}${app.panes.length > 1 ? ` (blue: ${pane.info.name}, red: ${app.panes[1].info.name})` : ''}`;
  drawProfile($('profile'), app.panes.filter((p) => p.channels && p.channels[name]).map((p) => ({channel: p.channels[name]})), line);
}

function noise(name, region) {
  const cells = app.panes.map((pane) => {
    const channels = app.frames.map((kept) => kept.nodes[pane.info.name]?.[name]).filter(Boolean).slice(-100);
    const now = pane.channels[name];
    if (!now || channels.length === 0) return null;
    const same = channels.filter((c) => c.rows === now.rows && c.columns === now.columns);
    return {node: pane.info.name, unit: now.unit, middle: median(valuesIn(now, region)), noise: temporalNoise(same, region)};
  }).filter(Boolean);
  app.noise = cells;
  $('noise').replaceChildren(...cells.map((cell) => tableRow(
      element('td', `${cell.node}: median ${quantity(cell.middle, cell.unit)}`),
      element('td', `temporal noise ${quantity(cell.noise.median, cell.unit, 3)} (${cell.noise.frames} frames)`, {className: 'n'}))));
}

function pause(wanted) {
  app.paused = wanted;
  $('pause').textContent = wanted ? 'go on' : 'pause';
  $('pause').classList.toggle('on', wanted);
  if (!wanted) { app.at = app.frames.length - 1; session.next(); }
  schedule();
}
function step(by) {
  if (!app.paused) pause(true);
  app.at = Math.max(0, Math.min(app.frames.length - 1, app.at + by));
  schedule();
}
app.pause = pause;
app.step = step;
app.pcd = () => pcdOf(app.panes[0].channels, app.panes[0].rays, app.panes[0].info);

$('pause').onclick = () => pause(!app.paused);
$('back').onclick = () => step(-1);
$('forward').onclick = () => step(1);
$('node-a').onchange = $('node-b').onchange = choose;
$('save-pcd').onclick = () => {
  const blob = app.pcd();
  blob ? download(blob, `frame_${String(app.shownNumber).padStart(6, '0')}.pcd`) : status('this node has no cloud to save', true);
};
$('save-png').onclick = async () => download(await pngOf(app.panes), `frame_${String(app.shownNumber).padStart(6, '0')}.png`);
for (const button of document.querySelectorAll('[data-tab]')) {
  button.onclick = () => {
    tab = button.dataset.tab;
    for (const other of document.querySelectorAll('[data-tab]')) {
      other.classList.toggle('on', other === button);
      $(other.dataset.tab).hidden = other !== button;
    }
    session.askState();
    schedule();
  };
}
addEventListener('keydown', (event) => {
  if (['INPUT', 'SELECT'].includes(event.target.tagName)) return;
  if (event.key === ' ') { event.preventDefault(); pause(!app.paused); }
  if (event.key === 'ArrowLeft') step(-1);
  if (event.key === 'ArrowRight') step(1);
});
addEventListener('resize', schedule);
