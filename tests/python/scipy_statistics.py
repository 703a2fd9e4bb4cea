"""Computes the statistics of comparisons with SciPy, from one JSON case per line.

usage: scipy_statistics.py FILE
"""

import json
import sys

import numpy as np
from scipy import stats


def wilcoxon(case):
    differences = np.array(case["differences"])
    kept = differences[differences != 0.0]
    if not len(kept):
        return [1.0, 0.0]
    ranks = stats.rankdata(np.abs(kept))
    tied = len(np.unique(ranks)) < len(kept)
    if len(kept) > 50:
        p = stats.wilcoxon(kept, method="approx", correction=False).pvalue
    elif not tied:
        p = stats.wilcoxon(kept, method="exact").pvalue
    elif len(kept) <= 12:
        # All combinations of signs.
        p = stats.wilcoxon(kept, method=stats.PermutationMethod()).pvalue
    else:
        # SciPy has no exact test for this case: the distribution of the sum by convolution.
        ways = np.ones(1)
        for rank in (2 * ranks).astype(int):
            step = np.zeros(rank + 1)
            step[[0, rank]] = 0.5
            ways = np.convolve(ways, step)
        below = np.cumsum(ways)
        positive = int(2 * ranks[kept > 0].sum())
        p = min(1.0, 2 * min(below[positive], below[len(ways) - 1 - positive]))
    # The rank-biserial correlation.
    effect = (ranks[kept > 0].sum() - ranks[kept < 0].sum()) / ranks.sum()
    return [p, effect]


def mcnemar(case):
    first, second = case["only"]
    if first + second == 0:
        return [1.0]
    return [stats.binomtest(first, first + second, 0.5).pvalue]


def wilson(case):
    hits, count = case["share"]
    found = stats.binomtest(hits, count).proportion_ci(0.95, method="wilson")
    return [found.low, found.high]


def holm(case):
    p = np.array(case["p"])
    order = np.argsort(p, kind="stable")
    steps = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(steps, 1.0)
    return adjusted.tolist()


def friedman(case):
    blocks = np.array(case["blocks"])
    found = stats.friedmanchisquare(*blocks.T)
    ranks = np.apply_along_axis(stats.rankdata, 1, blocks).mean(axis=0)
    return [found.statistic, found.pvalue, *ranks]


def nemenyi(case):
    k, blocks, difference = case["ranks"]
    unit = np.sqrt(k * (k + 1) / (6 * blocks))
    q = stats.studentized_range.ppf(0.95, k, np.inf) / np.sqrt(2)
    p = stats.studentized_range.sf(difference / unit * np.sqrt(2), k, np.inf)
    return [q * unit, p]


def bootstrap(case):
    """Returns SciPy's interval, which differs slightly because of other samples."""
    values = (np.array(case["values"]),)
    found = stats.bootstrap(
        values, np.mean, n_resamples=10_000, method="percentile", rng=np.random.default_rng(1)
    )
    return [*found.confidence_interval]


with open(sys.argv[1]) as cases:
    for line in cases:
        case = json.loads(line)
        print(json.dumps([float(value) for value in globals()[case["test"]](case)]))
