"""How good a renderer is, from several pictures that differ by their seeds alone.

No reference is needed: with unbiased renderers the mean squared error of a picture is its variance, and the variance
over seeds can be compared between an RGB and a spectral renderer, whose pictures differ a little in colour.

    relMSE = mean over pixels p of  Σ_c V[p, c] / (Σ_c M[p, c]² + 3 (0.01 B)²)

V is the unbiased variance over seeds, c the channel, M the mean over the seeds of all contestants (each with equal
weight, so that nobody's noise makes its own denominator) and B the mean of M over pixels and channels. The trimmed
form leaves out each contestant's worst 0.1 % of pixels: a few fireflies then can't decide the race.

    efficiency = 1 / (relMSE · seconds per picture)
"""

import math

import numpy as np

TRIMMED_SHARE = 0.001
FLOOR = 0.01


def denominator(stacks):
    """Σ_c M² + floor, per pixel; `stacks` are arrays (seed, height, width, channel), one per contestant."""
    mean = np.mean([stack.mean(axis=0) for stack in stacks], axis=0)
    return np.sum(mean**2, axis=-1) + mean.shape[-1] * (FLOOR * mean.mean()) ** 2


def relative_mse(stack, below, trimmed=False):
    """relMSE of one picture of the stack, given the denominator `below`."""
    error = (np.sum(stack.var(axis=0, ddof=1), axis=-1) / below).reshape(-1)
    if trimmed:
        error = np.sort(error)[: len(error) - math.ceil(TRIMMED_SHARE * len(error))]
    return float(error.mean())


def efficiency(stack, seconds, below, trimmed=False):
    return 1 / (relative_mse(stack, below, trimmed) * float(np.mean(seconds)))


def jackknife_ratio(rounds, statistic):
    """(ratio, low, high): exp of `statistic`'s logarithm with a 95 % interval.

    `statistic(keep)` gets the indices of the rounds to use and returns a ratio. Leaving out whole rounds (all
    contestants' pictures of one round) keeps what a noisy machine did to all of them alike out of the interval.
    """
    everything = np.arange(rounds)
    centre = math.log(statistic(everything))
    without = np.array([math.log(statistic(np.delete(everything, r))) for r in everything])
    error = math.sqrt((rounds - 1) / rounds * np.sum((without - without.mean()) ** 2))
    reach = student_t_975(rounds - 1) * error
    return tuple(math.exp(v) for v in (centre, centre - reach, centre + reach))


def student_t_975(freedom):
    """The 0.975 quantile of Student's t: expansion in 1/ν (Abramowitz & Stegun 26.7.5), within 0.2 % for ν ≥ 5."""
    z = 1.959963985
    terms = (
        z,
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
    )
    return sum(term / freedom**i for i, term in enumerate(terms))
