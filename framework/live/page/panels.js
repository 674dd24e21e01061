// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Parameters, statistics and the graph.
import {quantity} from './images.js';

export const element = (name, text, attributes = {}) => {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  Object.assign(made, attributes);
  return made;
};
const seconds = (s) => s === 0 ? '' : s < 1e-3 ? `${(s * 1e6).toFixed(0)} \u00b5s` : s < 1 ? `${(s * 1e3).toFixed(2)} ms` : `${s.toFixed(2)} s`;

/// Range of a slider: the declared one if both ends are close, else a factor of ten around the value.
function sliderRange(parameter) {
  const value = Math.abs(parameter.number) || 0;
  const low = parameter.min !== null && parameter.min > value / 100 ? parameter.min : 0;
  const usual = Math.max(value * 5, parameter.unit === 'm' ? 0.05 : parameter.unit === 'counts' ? 500 : value > 0 ? 0 : 1);
  const high = parameter.max !== null && parameter.max <= usual * 20 ? parameter.max : usual;
  return [low, high];
}

function rangeText(parameter) {
  const text = (v) => quantity(v, parameter.unit, 6);
  if (parameter.min === null && parameter.max === null) return '';
  if (parameter.max === null) return `at least ${text(parameter.min)}`;
  return parameter.min === null ? `at most ${text(parameter.max)}` : `${text(parameter.min)} to ${text(parameter.max)}`;
}

export class Parameters {
  constructor(section, set) {
    this.section = section;
    this.set = set;
    this.rows = {};
  }

  /// Creates the controls of the live parameters once; later calls only update values changed elsewhere.
  update(state) {
    const live = state.nodes.flatMap((node) => node.parameters.map((p) => ({node, p})));
    const names = live.map(({node, p}) => `${node.name}.${p.name}`).join();
    if (names !== this.names) this.build(live);
    this.names = names;
    for (const {node, p} of live) this.rows[`${node.name}.${p.name}`].value.textContent = p.value || 'not given';
    this.changes.replaceChildren(...state.changes.slice(-20).reverse().map(
        (c) => element('li', c.problem ? `refused: ${c.node}, ${c.parameter} = ${c.value}: ${c.problem}`
            : `from frame ${c.frame}: ${c.node}, ${c.parameter} = ${c.value}`)));
  }

  build(live) {
    this.changes = element('ul');
    this.section.replaceChildren();
    if (live.length === 0) this.section.append(element('p', 'No stage of this pipeline has a parameter that may change while it runs.', {className: 'hint'}));
    let last = null;
    for (const {node, p} of live) {
      if (node !== last) this.section.append(element('h2', `${node.name} (${node.stage})`));
      last = node;
      this.section.append(this.row(node, p));
    }
    this.section.append(element('h2', 'Changes'), this.changes);
  }

  row(node, p) {
    const box = element('div', undefined, {className: 'parameter', title: p.text});
    const label = element('label', p.name), value = element('span', p.value), answer = element('div', rangeText(p), {className: 'answer'});
    label.append(value);
    const field = element('input', undefined, {size: 10, placeholder: 'value with unit'});
    field.setAttribute('aria-label', `${node.name}, ${p.name}`);
    const send = (text) => this.set(node.name, p.name, text);
    box.append(label);
    if (p.type === 'bool') {
      const check = element('input', undefined, {type: 'checkbox', checked: p.value === 'true'});
      check.onchange = () => send(check.checked ? 'true' : 'false');
      label.prepend(check);
    } else {
      const [low, high] = sliderRange(p);
      const slider = element('input', undefined, {type: 'range', min: low, max: high, step: p.type === 'integer' ? 1 : (high - low) / 500});
      slider.value = Number.isFinite(p.number) ? p.number : low;
      const written = () => p.unit === 'm' ? `${Number((slider.value * 1000).toPrecision(4))} mm` : `${Number(Number(slider.value).toPrecision(4))}${p.unit ? ' ' + p.unit : ''}`;
      slider.oninput = () => { field.value = written(); };
      slider.onchange = () => send(written());
      field.onchange = () => send(field.value);
      box.append(slider, field);
    }
    box.append(answer);
    this.rows[`${node.name}.${p.name}`] = {value, answer};
    return box;
  }

  answer(message) {
    const row = this.rows[`${message.node}.${message.parameter}`];
    if (!row) return;
    row.answer.classList.toggle('bad', Boolean(message.problem));
    row.answer.textContent = message.problem || (message.reply.pending ? 'comes with the next frame' : `since frame ${message.reply.frame}`);
  }
}

export function showStatistics(section, state) {
  const table = element('table');
  table.innerHTML = '<tr><th>node</th><th class="n">frames</th><th class="n">median</th><th class="n">99 %</th><th class="n">longest</th></tr>';
  for (const node of state.nodes) {
    const row = element('tr');
    row.append(element('td', node.name));
    for (const text of [node.frames, seconds(node.median_s), seconds(node.p99_s), seconds(node.max_s)])
      row.append(element('td', String(text), {className: 'n'}));
    table.append(row);
  }
  const of = state.frames_expected ? ` of ${state.frames_expected}` : '';
  section.replaceChildren(table, element('p', `${state.frames}${of} frames done, ${state.dropped} dropped.`));
}

/// Nodes in their order, and the channels along each edge with their meaning.
export function showGraph(section, state) {
  const written = JSON.stringify(state.nodes.map((node) => [node.name, node.inputs, node.channels]));
  if (section.written === written) return;
  section.written = written;
  section.replaceChildren();
  for (const node of state.nodes) {
    if (node.inputs.length) section.append(element('div', '\u2193', {className: 'arrow'}));
    const box = element('div', undefined, {className: 'node'});
    box.append(element('b', node.name), document.createTextNode(` ${node.stage}: ${node.summary}`));
    if (node.inputs.length) box.append(element('div', `reads ${node.inputs.join(', ')}`, {className: 'edge'}));
    if (node.channels.length) {
      const list = element('ul');
      for (const channel of node.channels) list.append(element('li', channel.text, {className: channel.new ? 'new' : ''}));
      box.append(element('div', 'hands on (bold: made or changed here)', {className: 'edge'}), list);
    }
    section.append(box);
  }
}
