// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
/// @file The gap report's only script: a condition's maps at a click. Nothing is loaded from anywhere.
#pragma once

namespace tofgraph::diagnosis {

/// Needs `grid` (superpixels in a row), `palette` (rgb from -1 to 1) and `conditions` (simulated, extended, sd in mm;
/// null: nothing is known), a select "condition" and an element "condition-maps".
inline constexpr const char* condition_script = R"js(
const panel = document.getElementById("condition-maps"), choice = document.getElementById("condition");
function colour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (palette.length - 1), k = Math.min(Math.floor(at), palette.length - 2);
  return "rgb(" + [0, 1, 2].map(j => Math.round(palette[k][j] * (k + 1 - at) + palette[k + 1][j] * (at - k))) + ")";
}
function map(values, sd, title, limit) {
  const side = 288 / grid;
  let body = "";
  values.forEach((v, s) => {
    const known = v !== null, x = s % grid * side, y = Math.floor(s / grid) * side + 24;
    const tip = known ? `${v} mm, standard deviation ${sd[s]} mm (${(v / sd[s]).toFixed(1)} sd)` : "nothing was measured here";
    body += `<rect x="${x}" y="${y}" width="${side + 0.3}" height="${side + 0.3}" ` +
      `fill="${known ? colour(0.5 + v / (2 * limit)) : "#aaa"}"><title>${tip}</title></rect>`;
  });
  return `<svg class="chart" role="img" aria-label="${title}" width="300" height="334" viewBox="0 0 300 334" font-size="12" ` +
    `font-family="system-ui, sans-serif"><text class="ink" x="0" y="14" font-weight="600">${title}</text>${body}` +
    `<text class="ink" x="0" y="329">blue: -${limit} mm, white: 0, red: +${limit} mm</text></svg>`;
}
function show(i) {
  const c = conditions[i], sizes = c.simulated.filter(v => v !== null).map(Math.abs);
  const limit = Number(Math.max(...sizes, 1e-3).toPrecision(2));
  choice.value = i;
  panel.innerHTML = String(c.simulated) === String(c.extended) ? map(c.simulated, c.sd, "measured - simulated or extended", limit)
    : map(c.simulated, c.sd, "measured - simulated", limit) + map(c.extended, c.sd, "measured - extended", limit);
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
