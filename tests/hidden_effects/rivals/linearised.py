# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reader for the output of hidden_effects_linearisation: generalised least squares over conditions, shared by all
methods here.

A condition's covariance is that of its superpixels plus a board displacement (jitter, m) and a change in light (ln), as
in the search; each target's reflectivity is a column that is always included.
"""

import dataclasses
import functools

import h5py
import numpy as np

DISTANCE = 0


@dataclasses.dataclass
class Linearised:
    residual: np.ndarray  # conditions x rows (observables x superpixels)
    weight: np.ndarray  # 1 / variance; 0: unknown
    columns: np.ndarray  # columns x conditions x rows
    effects: list  # per column
    probes: list  # per column: those of one probe are tested together
    board: np.ndarray  # conditions x rows, change per metre
    light: np.ndarray  # conditions x rows, change per factor e
    target: np.ndarray  # per condition, -1: its reflectivity is known
    held_out: np.ndarray
    distance: np.ndarray
    integration_time: np.ndarray
    superpixels: int
    alike: set  # of frozensets of two effects

    @property
    def trained(self):
        return ~self.held_out

    def groups(self):
        """List of (effect, indices of its columns), one per probe."""
        found = {}
        for index, key in enumerate(zip(self.effects, self.probes)):
            found.setdefault(key, []).append(index)
        return [(effect, np.array(indices)) for (effect, _), indices in found.items()]

    def depth(self, rows):
        """Converts the distances in rows to depths: conditions x superpixels; NaN where unknown."""
        n = self.superpixels
        known = self.weight[:, :n] > 0
        return np.where(known, rows[:, :n] / np.where(known, self.board[:, :n], 1), np.nan)

    def gap(self, explained, conditions):
        """Root mean square of the remaining depth error, m."""
        return float(np.sqrt(np.nanmean((self.depth(self.residual) - explained)[conditions] ** 2)))


def read(path):
    with h5py.File(path, "r") as file:
        words = lambda name: [word.decode() for word in file[name][()]]
        variance = file["variance"][()].astype(float)
        lin = Linearised(
            residual=file["residual"][()].astype(float), weight=np.where(np.isfinite(variance), 1 / variance, 0),
            columns=np.array([file["columns"][key][()] for key in sorted(file["columns"])], dtype=np.float32),
            effects=words("names/effect"), probes=[int(p) for p in file["names/probe"][()]],
            board=file["nuisances/board"][()].astype(float), light=file["nuisances/light"][()].astype(float),
            target=file["conditions/target"][()].astype(int), held_out=file["conditions/held_out"][()] > 0,
            distance=file["conditions/distance"][()], integration_time=file["conditions/integration_time"][()],
            superpixels=int(file["superpixels"][0]), alike={frozenset(pair.split()) for pair in words("alike")})
    return with_maps(lin)


def with_maps(lin):
    """Adds the pixel map effects: a free value in each superpixel, of the distance or the light."""
    n = lin.superpixels
    conditions, rows = lin.residual.shape
    maps = np.zeros((2 * n, conditions, rows), dtype=np.float32)
    for s in range(n):
        maps[s, :, s] = 1e-3  # m
        for observable in (1, 2):  # amplitude, intensity
            maps[n + s, :, observable * n + s] = 1e-2
    first = max(lin.probes, default=-1) + 1
    return dataclasses.replace(
        lin, columns=np.concatenate([lin.columns, maps]), effects=lin.effects + n * ["fixed_pattern"] + n *
        ["pixel_response"], probes=lin.probes + n * [first] + n * [first + 1])


class Normal:
    """Normal equations of all columns, the targets' reflectivities and the residual; any set of conditions."""

    def __init__(self, lin):
        self.lin = lin
        self.targets = int(lin.target.max(initial=-1)) + 1
        self.count = len(lin.columns)
        conditions = len(lin.residual)
        self.gram, self.cross, self.random = [], [], []
        for i in range(conditions):
            reflectivity = np.zeros((self.targets, lin.residual.shape[1]))
            if lin.target[i] >= 0:
                reflectivity[lin.target[i]] = lin.light[i]
            z = np.concatenate([lin.columns[:, i].astype(float), reflectivity, lin.residual[i:i + 1]])
            u = np.stack([lin.board[i], lin.light[i]])
            zw, uw = z * lin.weight[i], u * lin.weight[i]
            self.gram.append(zw @ z.T)
            self.cross.append(zw @ u.T)
            self.random.append(uw @ u.T)

    def total(self, chosen, sd):
        """Gram matrix in the inverse covariance, summed over conditions. sd: of jitter (m) and light (ln)."""
        scale = np.diag(sd)
        total = np.zeros_like(self.gram[0])
        for i in np.flatnonzero(chosen):
            middle = scale @ np.linalg.inv(np.eye(2) + scale @ self.random[i] @ scale) @ scale
            total += self.gram[i] - self.cross[i] @ middle @ self.cross[i].T
        return total

    def spread(self, chosen, values):
        """Standard deviations of jitter and light between conditions, estimated from the residuals for given values."""
        squares, noise = [], []
        full = np.append(-values, 1.0)
        for i in np.flatnonzero(chosen):
            inverse = np.linalg.pinv(self.random[i])
            squares.append((inverse @ (full @ self.cross[i])) ** 2)
            noise.append(np.diag(inverse))
        floor = np.array([2e-5, 2e-4]) ** 2
        return np.sqrt(np.maximum(np.mean(squares, axis=0) - np.mean(noise, axis=0), floor))

    def solve(self, total, active):
        """Values of all columns and reflectivities; inactive ones are 0. A weak prior regularises undetermined ones."""
        kept = np.concatenate([np.asarray(active, dtype=int), self.count + np.arange(self.targets)]).astype(int)
        values = np.zeros(self.count + self.targets)
        if len(kept):
            information = total[np.ix_(kept, kept)] + 1e-4 * np.eye(len(kept))
            values[kept] = np.linalg.solve(information, total[kept, -1])
        return values

    def fit(self, active, rounds=3):
        """Consistent values and standard deviations, fitted to the data that are not held out. Effects must not
        increase the scatter between conditions over that without effects: otherwise a bad fit would justify itself."""
        sd = self.without_effects
        for _ in range(rounds):
            values = self.solve(self.total(self.lin.trained, sd), active)
            sd = np.minimum(self.spread(self.lin.trained, values), self.without_effects)
        return values, sd

    @functools.cached_property
    def without_effects(self):
        sd = np.array([5e-3, 2e-2])
        for _ in range(3):
            sd = self.spread(self.lin.trained, self.solve(self.total(self.lin.trained, sd), []))
        return sd

    def explained_depth(self, values):
        rows = np.tensordot(values[:self.count].astype(np.float32), self.lin.columns, axes=1)
        return self.lin.depth(rows.astype(float))
