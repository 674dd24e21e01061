# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Alternative methods for closing a gap. Each takes a Linearised and returns names and the explained depth, conditions
x superpixels.

None of them uses held-out data, except for the settings of each condition.
"""

import warnings

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from linearised import Normal

MOST_EFFECTS = 6
# Two-sided level for the largest |z| of all columns, with Bonferroni correction, as in the search.
SIGNIFICANCE = 0.005


def normal_quantile(tail):
    """Quantile z with P(Z > z) = tail, by bisection."""
    from math import erfc, sqrt
    low, high = 0.0, 40.0
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if erfc(middle / sqrt(2)) / 2 > tail else (low, middle)
    return low


def greedy(lin):
    """Adds the column with the largest z and those of its probe, refits all, and repeats until no z is significant."""
    normal = Normal(lin)
    groups = lin.groups()
    names, active, used = [], [], set()
    limit = normal_quantile(SIGNIFICANCE / 2 / normal.count)
    while True:
        values, sd = normal.fit(active)
        z = z_values(normal, normal.total(lin.trained, sd), active)
        left = [(np.max(z[indices]), g) for g, (effect, indices) in enumerate(groups)
                if g not in used and (effect in names or len(names) < MOST_EFFECTS)]
        best, g = max(left, default=(0, None))
        if best < limit:
            return names, normal.explained_depth(values)
        used.add(g)
        effect, indices = groups[g]
        if effect not in names:  # otherwise another nonlinear value, such as the other phase
            names.append(effect)
        active.extend(indices)


def z_values(normal, total, active):
    """Score |z| of each column if added to the active ones."""
    count = normal.count
    kept = np.concatenate([np.asarray(active, dtype=int), count + np.arange(normal.targets)]).astype(int)
    score, information = total[:count, -1].copy(), np.diag(total)[:count].copy()
    if len(kept):
        inner = total[np.ix_(kept, kept)] + 1e-4 * np.eye(len(kept))
        through = np.linalg.solve(inner, total[np.ix_(kept, np.arange(count))])
        score -= through.T @ total[kept, -1]
        information -= np.einsum("kc,kc->c", through, total[np.ix_(kept, np.arange(count))])
    seen = information > 1e-6 * np.maximum(np.diag(total)[:count], 1e-12)
    return np.where(seen, np.abs(score) / np.sqrt(np.where(seen, np.maximum(information, 1e-12), 1)), 0)


def group_lasso(lin):
    """All effects at once (Yuan and Lin 2006); among the supports along the path, the one whose refit has the lowest
    extended BIC (Chen and Chen 2008): cross-validation over distances would select many more."""
    normal = Normal(lin)
    effects = sorted(set(lin.effects))
    groups = [np.flatnonzero([effect == e for e in lin.effects]) for effect in effects]
    sd = normal.fit([])[1]
    for _ in range(3):  # the spread between conditions is estimated with the selected effects
        chosen = lasso_groups(lin, normal, groups, sd)
        active = np.concatenate([groups[g] for g in chosen] + [np.array([], dtype=int)]).astype(int)
        values, sd = normal.fit(active)
    return [effects[g] for g in chosen], normal.explained_depth(values)


def lasso_groups(lin, normal, groups, sd, penalties=25):
    """Indices of the selected groups."""
    total = normal.total(lin.trained, sd)
    basis = orthonormal(without_reflectivities(normal, total), groups)
    path = np.geomspace(1, 1e-3, penalties) * largest_penalty(normal, total, basis)
    conditions, supports = np.log(lin.trained.sum()), {()}
    for values in lasso_path(normal, total, basis, path):
        supports.add(tuple(g for g, indices in enumerate(groups) if np.any(values[indices] != 0)))

    def criterion(support):
        active = [c for g in support for c in groups[g]]
        values = normal.solve(total, active)
        columns = sum(basis[g][1].shape[1] for g in support)
        return -values @ total[:-1, -1] + columns * conditions + 2 * len(support) * np.log(len(groups))

    return list(min(supports, key=criterion))


def without_reflectivities(normal, total):
    """Gram matrix with the targets' reflectivities projected out."""
    count = normal.count
    kept = np.append(np.arange(count), total.shape[0] - 1)
    light = np.arange(count, count + normal.targets)
    if len(light) == 0:
        return total
    inner = total[np.ix_(light, light)] + 1e-6 * np.eye(len(light))
    across = total[np.ix_(light, kept)]
    return total[np.ix_(kept, kept)] - across.T @ np.linalg.solve(inner, across)


def orthonormal(gram, groups):
    """Coordinates for each group (indices, matrix) in which its own Gram matrix is the identity."""
    basis = []
    for indices in groups:
        values, vectors = np.linalg.eigh(gram[np.ix_(indices, indices)])
        kept = values > 1e-8 * max(values.max(initial=0), 1e-12)
        basis.append((indices, vectors[:, kept] / np.sqrt(values[kept])))
    return basis


def largest_penalty(normal, total, basis):
    score = without_reflectivities(normal, total)[:-1, -1]
    return max(np.linalg.norm(t.T @ score[indices]) / np.sqrt(t.shape[1]) for indices, t in basis if t.shape[1])


def lasso_path(normal, total, basis, path, sweeps=60):
    """Values of all columns at each penalty, by block coordinate descent with warm starts."""
    gram = without_reflectivities(normal, total)
    big = np.zeros((normal.count, sum(t.shape[1] for _, t in basis)))
    blocks, at = [], 0
    for indices, t in basis:
        big[indices, at:at + t.shape[1]] = t
        blocks.append(slice(at, at + t.shape[1]))
        at += t.shape[1]
    inner, score = big.T @ gram[:-1, :-1] @ big, big.T @ gram[:-1, -1]
    # The largest eigenvalue of a block bounds its curvature; 1 if the basis is from these data.
    bound = [np.linalg.eigvalsh(inner[b, b])[-1] if b.stop > b.start else 1.0 for b in blocks]
    values, solutions = np.zeros(at), []
    gradient = score.copy()  # of the residual
    for penalty in path:
        for _ in range(sweeps):
            most = 0.0
            for block, curvature in zip(blocks, bound):
                size = block.stop - block.start
                if size == 0 or curvature <= 0:
                    continue
                wanted = values[block] + gradient[block] / curvature
                length = np.linalg.norm(wanted)
                shrunk = wanted * max(0.0, 1 - penalty * np.sqrt(size) / curvature / length) if length > 0 else wanted
                step = shrunk - values[block]
                if np.any(step):
                    values[block] = shrunk
                    gradient -= inner[:, block] @ step
                    most = max(most, np.abs(step).max())
            if most < 1e-3 * max(np.abs(values).max(initial=0), 1e-9):
                break
        solutions.append(big @ values)
    return solutions


def process(inputs, values, known, points):
    """Gaussian process regression with one length scale per input and noise, all fitted; predicted at every input."""
    some = np.random.default_rng(0).permutation(np.flatnonzero(known))[:points]
    scale = max(values[some].std(), 1e-9)
    kernel = ConstantKernel(1.0) * RBF(np.ones(inputs.shape[1]), (0.05, 100)) + WhiteKernel(0.1, (1e-6, 10))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        fitted = GaussianProcessRegressor(kernel).fit(inputs[some], values[some] / scale)
    return scale * fitted.predict(inputs)


def gaussian_process(lin, points=800):
    """Discrepancy model without names: one process for the means of the conditions, over distance, integration time
    and amplitude, with board displacements as noise; one for pixel deviations, also over the image."""
    n = lin.superpixels
    side = int(round(np.sqrt(n)))
    depth = lin.depth(lin.residual)
    amplitude = np.where(lin.weight[:, n:2 * n] > 0, lin.residual[:, n:2 * n], np.nan)
    seen = np.array([np.nanmean(row) if np.isfinite(row).any() else 0.0 for row in amplitude])
    ideal = np.log(lin.integration_time) - 2 * np.log(lin.distance)
    conditions = np.stack([lin.distance, np.log(lin.integration_time), ideal + seen], axis=1)
    conditions = (conditions - conditions.mean(axis=0)) / np.maximum(conditions.std(axis=0), 1e-9)
    there = np.isfinite(depth).any(axis=1)
    means = np.array([np.nanmean(row) if ok else 0.0 for row, ok in zip(depth, there)])
    common = process(conditions, means, there & lin.trained, points)
    place = np.stack([np.arange(n) % side, np.arange(n) // side], axis=1) / max(side - 1, 1) - 0.5
    inputs = np.concatenate([np.repeat(conditions, n, axis=0), np.tile(2 * place, (len(depth), 1))], axis=1)
    known = np.isfinite(depth).ravel() & np.repeat(lin.trained, n)
    within = process(inputs, np.nan_to_num(depth - means[:, None]).ravel(), known, points)
    return [], common[:, None] + within.reshape(depth.shape)


def polynomial(lin, most=6, folds=5):
    """Polynomial in the distance for each superpixel: the usual calibration of such cameras, its degree selected by
    cross-validation over distances. It names nothing."""
    depth = lin.depth(lin.residual)
    middle, half = (lin.distance.max() + lin.distance.min()) / 2, max(np.ptp(lin.distance) / 2, 1e-9)
    powers = np.polynomial.legendre.legvander((lin.distance - middle) / half, most)
    fold = np.searchsorted(np.unique(lin.distance[lin.trained]), lin.distance) % folds

    def fitted(degree, chosen):
        explained = np.zeros_like(depth)
        for s in range(lin.superpixels):
            known = np.isfinite(depth[:, s]) & chosen
            if known.sum() > degree + 1:
                values = np.linalg.lstsq(powers[known, :degree + 1], depth[known, s], rcond=None)[0]
                explained[:, s] = powers[:, :degree + 1] @ values
        return explained

    def loss(degree):
        return sum(np.nansum((depth - fitted(degree, lin.trained & (fold != f)))[lin.trained & (fold == f)]**2)
                   for f in range(folds))

    return [], fitted(min(range(most + 1), key=loss), lin.trained)


RIVALS = {"greedy largest z": greedy, "group LASSO": group_lasso, "Gaussian process": gaussian_process,
          "polynomial a pixel": polynomial}
