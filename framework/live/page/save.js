// SPDX-FileCopyrightText: 2026 The tofgraph authors
// SPDX-License-Identifier: BSD-3-Clause
// Files with the displayed cloud or picture.
import {pointsOf, valueAt} from './decode.js';

/// Cloud as PCD: x y z in m, then the amplitude if the frame has one per point. Binary, invalid points are NaN.
export function pcdOf(channels, rays, info) {
  const points = pointsOf(channels, rays, info);
  if (!points) return null;
  const count = points.length / 3;
  const amplitude = channels.amplitude && channels.amplitude.codes.length === count ? channels.amplitude : null;
  const shape = channels.points || channels.range || channels.depth, fields = amplitude ? 4 : 3;
  const header = `# .PCD v0.7 - Point Cloud Data file format
VERSION 0.7
FIELDS x y z${amplitude ? ' amplitude' : ''}
SIZE${' 4'.repeat(fields)}
TYPE${' F'.repeat(fields)}
COUNT${' 1'.repeat(fields)}
WIDTH ${shape.columns}
HEIGHT ${shape.rows}
VIEWPOINT 0 0 0 1 0 0 0
POINTS ${count}
DATA binary
`;
  const values = new Float32Array(count * fields);
  for (let i = 0; i < count; ++i) {
    values.set(points.subarray(3 * i, 3 * i + 3), fields * i);
    if (amplitude) values[fields * i + 3] = valueAt(amplitude, i);
  }
  return new Blob([header, values], {type: 'application/octet-stream'});
}

/// Clouds and images side by side, as displayed.
export async function pngOf(panes) {
  const columns = panes.map((pane) => [pane.cloud.canvas, ...pane.shownImages().map((image) => image.canvas)]);
  const wide = 480, heights = columns.map((canvases) => canvases.reduce((sum, c) => sum + Math.round(wide * c.height / c.width), 0));
  const sheet = new OffscreenCanvas(wide * columns.length, Math.max(...heights)), context = sheet.getContext('2d');
  context.imageSmoothingEnabled = false;
  columns.forEach((canvases, k) => {
    let y = 0;
    for (const canvas of canvases) {
      const high = Math.round(wide * canvas.height / canvas.width);
      context.drawImage(canvas, k * wide, y, wide, high);
      y += high;
    }
  });
  return sheet.convertToBlob({type: 'image/png'});
}

export function download(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
