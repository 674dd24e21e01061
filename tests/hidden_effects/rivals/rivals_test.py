# SPDX-FileCopyrightText: 2026 The tofgraph authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tests of the rival methods on data with known truth: planted effects are found, absent ones are not. Exits with 77
if their packages are not installed: ./bootstrap rivals."""

import sys
import unittest

try:
    import numpy as np
    from linearised import Linearised, Normal
    from methods import gaussian_process, greedy, group_lasso, normal_quantile, polynomial
    from run import Outcome, SEARCH, compared, table
    from methods import RIVALS
except (ModuleNotFoundError, SystemExit) as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

SIDE, OBSERVABLES = 4, 5
N = SIDE * SIDE
NOISE = np.repeat([3e-4, 1e-3, 1e-3, 1e-3, 1e-3], N)  # of each row


def linearised(seed, planted=(), jitter=5e-4, conditions=40):
    """A rail: one column of the distance, one of the image, one of the null channels, one effect with two columns."""
    random = np.random.default_rng(seed)
    distance = np.repeat(np.linspace(0.6, 6, conditions // 2), 2)
    time = np.tile([1e-3, 4e-3], conditions // 2)
    x, y = np.meshgrid(np.linspace(-1, 1, SIDE), np.linspace(-1, 1, SIDE))
    ones, zero = np.ones(N), np.zeros(N)
    rows = lambda *parts: np.concatenate(parts)
    shapes = [("ramp", lambda z, t: rows(1e-2 * z * ones, zero, zero, zero, zero)),
              ("tilt", lambda z, t: rows(1e-2 * x.ravel() * z, zero, zero, zero, zero)),
              ("null", lambda z, t: rows(zero, zero, zero, 1e-2 * ones, zero)),
              ("wave", lambda z, t: rows(1e-2 * np.cos(3 * z) * ones, 1e-2 * np.sin(3 * z) * ones, zero, zero, zero)),
              ("wave", lambda z, t: rows(1e-2 * np.sin(3 * z) * ones, -1e-2 * np.cos(3 * z) * ones, zero, zero, zero)),
              ("time", lambda z, t: rows(1e-2 * np.log(t / 1e-3) * ones, zero, zero, zero, zero))]
    columns = np.array([[shape(z, t) for z, t in zip(distance, time)] for _, shape in shapes], dtype=np.float32)
    board, light = np.zeros((conditions, 5 * N)), np.zeros((conditions, 5 * N))
    board[:, :N], light[:, N:3 * N] = 1, 1
    target = np.arange(conditions) // 2 % 2
    residual = random.normal(size=board.shape) * NOISE
    residual += jitter * random.normal(size=(conditions, 1)) * board
    residual += 2e-3 * random.normal(size=(conditions, 1)) * light
    residual += np.array([0.1, -0.05])[target][:, None] * light
    for index, size in planted:
        residual += size * columns[index]
    held = np.isin(distance, np.unique(distance)[3::4])
    return Linearised(residual=residual, weight=np.tile(1 / NOISE**2, (conditions, 1)), columns=columns,
                      effects=[name for name, _ in shapes], probes=[0, 1, 2, 3, 3, 4], board=board, light=light,
                      target=target, held_out=held, distance=distance, integration_time=time, superpixels=N,
                      alike={frozenset(("ramp", "scale"))})


class Rivals(unittest.TestCase):

    def test_least_squares_gives_the_planted_values(self):
        lin = linearised(1, [(1, 0.7), (3, 0.4), (4, -0.3)])
        normal = Normal(lin)
        values, sd = normal.fit([1, 3, 4])
        np.testing.assert_allclose(values[[1, 3, 4]], [0.7, 0.4, -0.3], atol=0.05)
        np.testing.assert_allclose(values[-2:], [0.1, -0.05], atol=0.01)  # the reflectivities
        self.assertLess(abs(sd[0] / 5e-4 - 1), 0.5)  # from about 30 conditions
        self.assertLess(abs(sd[1] / 2e-3 - 1), 0.5)

    def test_normal_equations_are_those_of_the_whole_covariance(self):
        """Compares with the inverse of each condition's covariance, computed explicitly."""
        lin = linearised(2, conditions=8)
        normal, sd = Normal(lin), np.array([5e-4, 2e-3])
        brute = np.zeros((len(lin.columns), len(lin.columns)))
        for i in range(8):
            covariance = np.diag(1 / lin.weight[i]) + sd[0]**2 * np.outer(lin.board[i], lin.board[i]) + sd[
                1]**2 * np.outer(lin.light[i], lin.light[i])
            z = lin.columns[:, i].astype(float)
            brute += z @ np.linalg.solve(covariance, z.T)
        total = normal.total(np.ones(8, dtype=bool), sd)
        np.testing.assert_allclose(total[:len(brute), :len(brute)], brute, rtol=1e-6, atol=1e-6 * np.abs(brute).max())

    def test_named_is_what_was_planted(self):
        for method in (greedy, group_lasso):
            lin = linearised(3, [(1, 0.7), (3, 0.4), (4, -0.3)])
            names, explained = method(lin)
            self.assertEqual(sorted(names), ["tilt", "wave"], method.__name__)
            # 0.3 mm of noise and 0.5 mm of jitter; the original error is 5 mm and more.
            self.assertLess(lin.gap(explained, lin.held_out), 1e-3)
            self.assertGreater(lin.gap(0, lin.held_out), 4e-3)

    def test_greedy_is_silent_where_nothing_is(self):
        false = sum(len(greedy(linearised(seed))[0]) for seed in range(20, 40))
        self.assertLessEqual(false, 1)  # at 0.5 % per campaign

    def test_what_names_nothing_closes_a_smooth_gap(self):
        lin = linearised(4, [(0, 0.3), (1, 0.3)])
        for method in (gaussian_process, polynomial):
            names, explained = method(lin)
            self.assertEqual(names, [])
            self.assertLess(lin.gap(explained, lin.held_out), 0.2 * lin.gap(0, lin.held_out), method.__name__)

    def test_held_out_data_are_not_seen(self):
        for method in RIVALS.values():
            one, other = linearised(5, [(1, 0.5)]), linearised(5, [(1, 0.5)])
            other.residual[other.held_out, :N] += 1.0  # one metre
            np.testing.assert_allclose(method(one)[1], method(other)[1], atol=1e-9)

    def test_quantile(self):
        self.assertAlmostEqual(normal_quantile(0.025), 1.959964, places=5)


class Table(unittest.TestCase):

    def test_names_are_compared_with_their_ties(self):
        alike = {frozenset(("ramp", "scale"))}
        self.assertEqual(compared(["scale", "null"], ["ramp", "wave"], alike), (1, 1))
        self.assertEqual(compared([], ["ramp"], alike), (0, 0))

    def test_share_is_of_what_is_above_the_noise(self):
        outcome = lambda after: Outcome(SEARCH, [], 1, 0, 5e-3, after, 1e-3, 2.0)
        self.assertAlmostEqual(outcome(1e-3).closed(), 1.0)
        self.assertAlmostEqual(outcome(2e-3).closed(), 0.75)
        self.assertIsNone(Outcome(SEARCH, [], 0, 0, 1.1e-3, 1e-3, 1e-3, 2.0).closed())
        lines = table([(["wave"], [outcome(1.1e-3)] * (1 + len(RIVALS)))]).splitlines()
        self.assertEqual(lines[2], "| tofgraph | 1 of 1 | 0 | 0 of 1 | 98 % | 1 of 1 | 2.0 |")
        self.assertEqual(len(lines), 3 + len(RIVALS))


if __name__ == "__main__":
    unittest.main()
