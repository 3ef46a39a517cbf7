"""Whether two renderers agree: means with an interval, tiles of 16x16 pixels by Welch's test.

The threshold of the tiles is Bonferroni's for all tiles and channels together.
"""

import os
from math import exp, lgamma

import numpy as np

TILE = 16
# Largest difference of the means that counts as none.
LIMIT = 0.005


def welch(ours, theirs):
    """Largest |t| over tiles and channels, and the threshold for all of them together (two-sided 1 %, few degrees of freedom)."""

    def tiles(runs):
        runs = np.asarray(runs, np.float64)
        n, height, width, channels = runs.shape
        return runs.reshape(n, height // TILE, TILE, width // TILE, TILE, channels).mean(axis=(2, 4)).reshape(n, -1)

    a, b = tiles(ours), tiles(theirs)
    va, vb = a.var(axis=0, ddof=1) / len(a), b.var(axis=0, ddof=1) / len(b)
    spread = np.sqrt(va + vb)
    judged = spread > 0
    t = np.abs(a.mean(axis=0) - b.mean(axis=0))[judged] / spread[judged]
    freedom = ((va + vb) ** 2 / (va**2 / (len(a) - 1) + vb**2 / (len(b) - 1) + 1e-300))[judged]
    p = np.array([two_sided(value, nu) for value, nu in zip(t, freedom)])
    return t.max(), p.min() * len(p), len(p)


def two_sided(t, freedom):
    """P(|T| > t) of Student's distribution, by Simpson's rule on the substituted tail."""
    x = freedom / (freedom + t * t)
    # The regularised incomplete beta function I_x(freedom / 2, 1 / 2), substituted u = x s^2.
    a, b = freedom / 2, 0.5
    s = np.linspace(0, 1, 2001)
    with np.errstate(divide="ignore"):
        values = np.exp((2 * a - 1) * np.log(np.maximum(s, 1e-300))) * (1 - x * s * s) ** (b - 1)
    weights = np.ones(2001)
    weights[1:-1:2], weights[2:-1:2] = 4, 2
    integral = 2 * x**a * (values * weights).sum() / 6000
    return min(1.0, integral * exp(lgamma(a + b) - lgamma(a) - lgamma(b)))


def mean_ratio(ours, theirs):
    """Theirs over ours and its standard error."""
    a, b = [np.asarray(runs, np.float64).mean(axis=(1, 2, 3)) for runs in (ours, theirs)]
    ratio = b.mean() / a.mean()
    relative = np.sqrt(a.var(ddof=1) / len(a) / a.mean() ** 2 + b.var(ddof=1) / len(b) / b.mean() ** 2)
    return ratio, ratio * relative


def table_head():
    return (
        "| scene | against | roulette | runs x samples | mean, theirs over ours | means (0.5 %) | largest t | p, corrected | tiles (1 %) |\n"
        "| --- | --- | --- | --- | --- | --- | ---: | --- | --- |"
    )


def judge(name, peer, roulette, ours, theirs, samples, folder):
    """Prints a line of the table; keeps both means as arrays."""
    ratio, error = mean_ratio(ours, theirs)
    t, p, count = welch(ours, theirs)
    # An interval that reaches beyond the limit has not shown that the means agree.
    low, high = abs(ratio - 1) - 2 * error, abs(ratio - 1) + 2 * error
    means = "differ" if low > LIMIT else "agree" if high <= LIMIT else "not resolved"
    tiles = "some differ" if p <= 0.01 else "agree"
    print(
        f"| {name} | {peer} | {roulette} | {len(ours)} x {samples} | {ratio:.5f} +- {2 * error:.5f} | {means} | {t:.2f} | {min(p, 1):.3f} of {count} | {tiles} |",
        flush=True,
    )
    for who, runs in (("ours", ours), ("theirs", theirs)):
        np.save(os.path.join(folder, f"{name}_{peer}_{who}.npy"), np.mean(runs, axis=0).astype(np.float32))
