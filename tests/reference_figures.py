# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Figures of reference_results.py: 6.3, 6.4 and 6.9 to 6.11 of the reference, for the simulated camera."""

import math

HEAD = ('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w} {h}" font-family="sans-serif" font-size="12">\n'
        '<rect width="{w}" height="{h}" fill="white"/>\n{body}\n</svg>\n')


def grid(found, value, target):
    """Dictionary {(distance in mm, time in ms): value} for a target of a calibration."""
    places = zip(found["target"], found["distance"], found["integration_time"], found[value])
    return {(round(d), t): v for k, d, t, v in places if int(k) == target}


def colour(share):
    """Colour from blue through white to red. @param share 0 to 1"""
    share = min(max(share, 0), 1)
    low, middle, high = (33, 102, 172), (247, 247, 247), (178, 24, 43)
    a, b, s = (low, middle, 2 * share) if share < 0.5 else (middle, high, 2 * share - 1)
    return "#" + "".join(f"{round(x + s * (y - x)):02x}" for x, y in zip(a, b))


def label(x, y, words, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}"{more}>{words}</text>'


def surface(values, left, top, title, unit, logarithmic):
    """Surface over distance and time, seen from above the corner of small values, far lines first."""
    distances, times = (sorted({key[i] for key in values}) for i in (0, 1))
    heights = {key: math.log10(v) if logarithmic else v for key, v in values.items()}
    low, high = min(heights.values()), max(heights.values())
    at = lambda i, j: (left + 60 + 150 * i / (len(distances) - 1) + 90 * j / (len(times) - 1),
                       top + 210 - 80 * j / (len(times) - 1)
                       - 110 * (heights[distances[i], times[j]] - low) / (high - low))
    parts = [label(left + 20, top + 14, title)]
    for j in reversed(range(len(times) - 1)):
        for i in range(len(distances) - 1):
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            if any((distances[a], times[b]) not in heights for a, b in corners):
                continue
            mean = sum(heights[distances[a], times[b]] for a, b in corners) / 4
            points = " ".join("{:.1f},{:.1f}".format(*at(a, b)) for a, b in corners)
            parts.append(f'<polygon points="{points}" fill="{colour((mean - low) / (high - low))}" stroke="#555" '
                         'stroke-width="0.4"/>')
    numbers = [10 ** v if logarithmic else v for v in (low, high)]
    parts += ticks_of(left, top, distances, times, numbers, logarithmic)
    parts.append(label(left + 20, top + 30, f"{numbers[0]:.0f} to {numbers[1]:.0f} {unit}" +
                       (", logarithmic" if logarithmic else ""), ' fill="#777"'))
    return "\n".join(parts)


def ticks_of(left, top, distances, times, numbers, logarithmic):
    """Axes of a surface: distances in front, times on the right, values on the left; each with ticks."""
    line = lambda x, y, u, v: (f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{u:.1f}" y2="{v:.1f}" stroke="#777"/>')
    parts = [line(left + 60, top + 210, left + 210, top + 210), line(left + 210, top + 210, left + 300, top + 130),
             line(left + 60, top + 100, left + 60, top + 210)]
    grey, right = ' fill="#777" text-anchor="middle"', ' fill="#777" text-anchor="end"'
    for i, distance in enumerate(distances):
        x = left + 60 + 150 * i / (len(distances) - 1)
        long = distance % 2000 == 1000
        parts.append(line(x, top + 210, x, top + (216 if long else 213)))
        if long:
            parts.append(label(x, top + 228, f"{distance // 1000}", grey))
    parts.append(label(left + 135, top + 243, "distance, m", grey))
    for j, time in enumerate(times):
        x, y = left + 210 + 90 * j / (len(times) - 1), top + 210 - 80 * j / (len(times) - 1)
        long = time in (0.5, 2, 7, 16, 50)
        parts.append(line(x, y, x + (6 if long else 3), y))
        if long:
            parts.append(label(x + 8, y + 4, f"{time:g}", ' fill="#777"'))
    parts.append(label(left + 268, top + 205, "time, ms", ' fill="#777"'))
    low, high = numbers
    if logarithmic:
        values = [10 ** k for k in range(-3, 8) if low <= 10 ** k <= high]
        share = lambda v: math.log(v / low) / math.log(high / low)
    else:
        step = next(s for k in range(-2, 5) for s in (10 ** k, 2 * 10 ** k, 5 * 10 ** k) if (high - low) / s <= 5)
        values = [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
        share = lambda v: (v - low) / (high - low)
    for v in values:
        y = top + 210 - 110 * share(v)
        parts += [line(left + 56, y, left + 60, y), label(left + 53, y + 4, f"{v:g}", right)]
    return parts


def surfaces(found):
    """Figures 6.3 and 6.4: error of the distance and amplitude of the centre pixels."""
    parts = []
    for row, (name, target) in enumerate((("100 % black", 1), ("white", 0))):
        error = {key: v - key[0] for key, v in grid(found, "measured_mean", target).items()}
        amplitude = grid(found, "amplitude", target)
        for column, (values, what, unit, log) in enumerate(((error, "measured less true distance", "mm", False),
                                                            (amplitude, "amplitude", "counts", True))):
            parts.append(surface(values, 330 * column, 250 * row, f"{name}: {what}", unit, log))
    return HEAD.format(w=680, h=500, body="\n".join(parts))


def maps(found, names, optima, full):
    """Figures 6.9 to 6.11: RMSE over distance and time, one panel per target.

    @param optima for each target {distance in mm: time in ms}, framed
    @param full for each target {distance in mm: time in ms} above which a tap is full: grey
    """
    parts = []
    low, high = math.log(min(v for v in found["rmse"] if v > 0)), math.log(60)
    for target, name in enumerate(names):
        values = grid(found, "rmse", target)
        distances, times = (sorted({key[i] for key in values}) for i in (0, 1))
        left, top = 56 + 270 * (target % 3), 30 + 230 * (target // 3)
        width, height = 210 / len(times), 170 / len(distances)
        parts.append(label(left, top - 8, name))
        for (distance, time), rmse in sorted(values.items()):
            x, y = left + width * times.index(time), top + height * distances.index(distance)
            best = time == optima[target][distance]
            filled = "#999999" if time > full[target][distance] else colour((math.log(rmse) - low) / (high - low))
            parts.append(f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" '
                         f'fill="{filled}"' +
                         (' stroke="black"/>' if best else "/>"))
        for i, distance in enumerate(distances):
            parts.append(label(left - 5, top + height * (i + 0.5) + 4, f"{distance / 1000:g}",
                               ' text-anchor="end" fill="#777"'))
        for time in (times[0], times[len(times) // 2], times[-1]):
            parts.append(label(left + width * (times.index(time) + 0.5), top + 184, f"{time:g}",
                               ' text-anchor="middle" fill="#777"'))
    parts.append(label(56, 482, "RMSE over distance (m, downwards) and integration time (ms): blue "
                       f"{math.exp(low):.1f} mm, red 60 mm or more, logarithmic"))
    parts.append(label(56, 498, "grey: a tap would be full; framed: the optimum of each distance, among the other times"))
    return HEAD.format(w=850, h=510, body="\n".join(parts))
