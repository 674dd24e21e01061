// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The gap report's only script: a condition's maps at a click. Nothing is loaded from anywhere.
#pragma once

namespace tofgraph::diagnosis {

/// Needs `grid` (superpixels in a row), `palette` (rgb from -1 to 1) and `conditions` (id, simulated, extended, sd in
/// mm; null: nothing is known), `sigmaLimit` (of maps in sd), a select "condition" and an element "condition-maps".
inline constexpr const char* condition_script = R"js(
const panel = document.getElementById("condition-maps"), choice = document.getElementById("condition");
function colour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (palette.length - 1), k = Math.min(Math.floor(at), palette.length - 2);
  return "rgb(" + [0, 1, 2].map(j => Math.round(palette[k][j] * (k + 1 - at) + palette[k + 1][j] * (at - k))) + ")";
}
function escaped(text) { return text.replace(/&/g, "&amp;").replace(/</g, "&lt;"); }
function map(c, values, title, limit, inSd) {
  const side = 264 / grid;
  let body = "";
  values.forEach((v, s) => {
    const known = v !== null, x = s % grid * side, y = Math.floor(s / grid) * side + 24, ratio = v / c.sd[s];
    const at = `${c.id}, row ${Math.floor(s / grid) + 1}, column ${s % grid + 1}`;
    const tip = known ? `${at}: ${v} mm, standard deviation ${c.sd[s]} mm (${ratio.toFixed(1)} sd)` : `${at}: nothing was measured here`;
    body += `<rect x="${x}" y="${y}" width="${side + 0.3}" height="${side + 0.3}" shape-rendering="crispEdges" ` +
      `fill="${known ? colour(0.5 + (inSd ? ratio : v) / (2 * limit)) : "#aaa"}"><title>${escaped(tip)}</title></rect>`;
  });
  const unit = inSd ? "sd" : "mm";
  return `<svg class="chart" role="img" aria-label="${title}" width="276" height="310" viewBox="0 0 276 310" font-size="12" ` +
    `font-family="system-ui, sans-serif"><text class="ink" x="0" y="14" font-weight="600">${title}</text>${body}` +
    `<text class="ink" x="0" y="305">blue: -${limit} ${unit}, white: 0, red: +${limit} ${unit}</text></svg>`;
}
function show(i) {
  const c = conditions[i], sizes = c.simulated.filter(v => v !== null).map(Math.abs);
  const limit = Number(Math.max(...sizes, 1e-3).toPrecision(2));
  const models = String(c.simulated) === String(c.extended) ? [["simulated or extended", c.simulated]]
    : [["simulated", c.simulated], ["extended", c.extended]];
  choice.value = i;
  panel.innerHTML = models.map(([name, values]) => map(c, values, `measured - ${name}`, limit, false)).join("") +
    models.map(([name, values]) => map(c, values, `measured - ${name}, in sd`, sigmaLimit, true)).join("");
}
choice.addEventListener("change", () => show(Number(choice.value)));
document.addEventListener("click", event => {
  const mark = event.target.closest("[data-condition]");
  if (!mark) return;
  show(Number(mark.dataset.condition));
  choice.scrollIntoView({block: "nearest"});
});
show(Number(choice.value));
)js";

}  // namespace tofgraph::diagnosis
