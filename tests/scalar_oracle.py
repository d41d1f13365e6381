"""The documented models for one hypothesis at a time, in plain Python.

The filters compute with kernels in single precision and with tables; particles and grid share
them, so that neither can check the other. These functions follow ``docs/explanation/bayes-filter``
and share no code with the package. Options are read from its documented option classes.
"""

from itertools import product
from math import atan2, cos, erfc, exp, floor, hypot, log, sin, sqrt

import numpy as np


def log_normal_cdf(x):
    """Logarithm of the standard normal distribution function."""
    return log(0.5 * erfc(-x / sqrt(2.0)))


# Places


def pixel_of(east_m, north_m, resolution_m, rows, cols):
    """Row and column of the pixel that holds a place; row 0 is the northern edge."""
    col = floor(east_m / resolution_m)
    row = rows - 1 - floor(north_m / resolution_m)
    return min(max(row, 0), rows - 1), min(max(col, 0), cols - 1)


def bilinear(raster, east_m, north_m, resolution_m):
    """Value between the centres of pixels; beyond the outermost centres that of the edge."""
    rows, cols = raster.shape
    x = min(max(east_m / resolution_m - 0.5, 0.0), cols - 1.0)
    y = min(max(rows - 0.5 - north_m / resolution_m, 0.0), rows - 1.0)
    total = 0.0
    for row in range(rows):
        for col in range(cols):
            share = max(0.0, 1 - abs(x - col)) * max(0.0, 1 - abs(y - row))
            total += share * float(raster[row, col])
    return total


# Motion


def moved(east_m, north_m, bias_rad, log_scale, step_m, heading_rad):
    """Place after a step without noise: length times the scale, heading plus the bias."""
    length_m = step_m * exp(log_scale)
    angle_rad = heading_rad + bias_rad
    return east_m + length_m * cos(angle_rad), north_m + length_m * sin(angle_rad)


def came_from(east_m, north_m, bias_rad, log_scale, back_east_m, back_north_m):
    """Place before a displacement by dead reckoning that ends here."""
    length_m, heading_rad = hypot(back_east_m, back_north_m), atan2(back_north_m, back_east_m)
    return moved(east_m, north_m, bias_rad, log_scale, -length_m, heading_rad)


def white_of(errors):
    """Standard deviation of the part of a heading's error that is new at each step."""
    return errors.heading_sd_rad * sqrt(errors.white_share)


def deviation_of(errors):
    """Standard deviation of the part that is correlated along the path."""
    return errors.heading_sd_rad * sqrt(1 - errors.white_share)


def step_moments(bias_rad, log_scale, step_m, heading_rad, errors):
    """Mean and covariance of a step's displacement where bias, scale and deviations stand still."""
    length_m, white_rad = abs(step_m), white_of(errors)
    mean_m = step_m * exp(white_rad**2 / 2 + log_scale)
    ahead = np.array([cos(heading_rad + bias_rad), sin(heading_rad + bias_rad)])
    left = np.array([-ahead[1], ahead[0]])
    steps = length_m / errors.typical_step_m
    along_var = errors.step_sd_m**2 * steps
    # White noise of each typical step; a longer one is measured once.
    across_var = (length_m * white_rad) ** 2 / min(steps, 1.0)
    return mean_m * ahead, along_var * np.outer(ahead, ahead) + across_var * np.outer(left, left)


# Streets


def map_log_likelihood(distance_m, sd_m):
    """Logarithm of the map's likelihood at a distance from the nearest way."""
    return log(0.97 * exp(-(distance_m**2) / (2 * sd_m**2)) + 0.03 * exp(-distance_m / 30.0))


def map_step(log_map, off, length_m, weights):
    """Log-likelihood of one step by the map, and the probability of being off it after."""
    prior = np.array([1 - off, off])
    leave, come_back = (
        1 - exp(-rate * length_m) for rate in (weights.leave_per_m, weights.return_per_m)
    )
    change = np.array([[1 - leave, leave], [come_back, 1 - come_back]])
    gain = np.array(
        [exp(weights.weight_per_m * length_m * log_map), exp(-weights.off_cost_per_m * length_m)]
    )
    beliefs, log_evidence = forward(prior, [(change, gain)])
    return log_evidence, beliefs[-1][1]


# Serving cell and levels


def serving_log_likelihood(level_dbm, cell, weights):
    """Log Φ((m + h) / σ) of the margin over the best *other* cell."""
    others = [level for band, level in enumerate(level_dbm) if band != cell]
    margin_db = level_dbm[cell] - max(others)
    return log_normal_cdf((margin_db + weights.hysteresis_db) / weights.sd_db)


def level_covariance(errors, site, one, other):
    """Covariance of the errors of two lists of levels (band, metres along the path), without noise.

    Slow and fast errors of two cells have the same correlation: 1 for a cell with itself; the
    common share, and within a site that of sites, for two of them.
    """
    found = np.empty((len(one), len(other)))
    for i, (a, here_m) in enumerate(one):
        for j, (b, there_m) in enumerate(other):
            alike = errors.common_share + errors.site_share * (site[a] == site[b])
            alike, apart_m = 1.0 if a == b else alike, abs(here_m - there_m)
            slow = errors.slow_db**2 * exp(-apart_m / errors.slow_m)
            fast = errors.fast_db**2 * exp(-apart_m / errors.fast_m)
            found[i, j] = alike * (slow + fast) + errors.device_db**2
    return found


def levels_log_density(errors, site, levels):
    """Log density of all levels of a path as one Gaussian, but for ½ log 2π each.

    ``levels`` are rows of band, metres along the path, error (reported less predicted level) and
    further variance, of white noise and of what else is new.
    """
    if not levels:
        return 0.0
    key = [(band, at_m) for band, at_m, _, _ in levels]
    error_db = np.array([one[2] for one in levels])
    covariance = level_covariance(errors, site, key, key) + np.diag([one[3] for one in levels])
    _, log_det = np.linalg.slogdet(covariance)
    return -0.5 * (error_db @ np.linalg.solve(covariance, error_db) + log_det)


OTHER_DBM, OTHER_DB2, OTHER_M = -90.0, 15.0**2, 150.0
"""The levels of a cell that the prediction is wrong about: a Gauss-Markov process."""


def other_log_density(levels, errors, more_db2=0.0):
    """Log density of levels (metres, dBm) of such a cell, but for ½ log 2π each.

    They have the white errors of others, half the variance of fast ones, and what is more.
    """
    at_m, level = np.array(levels).T
    covariance = OTHER_DB2 * np.exp(-np.abs(at_m[:, None] - at_m) / OTHER_M)
    white_db2 = errors.white_db**2 + errors.fast_db**2 / 2 + more_db2
    covariance += white_db2 * np.eye(at_m.size)
    off, (_, log_det) = level - OTHER_DBM, np.linalg.slogdet(covariance)
    return -0.5 * (off @ np.linalg.solve(covariance, off) + log_det)


def level_forecast(errors, site, levels, band, at_m):
    """Mean and variance of the error of one more level, given all before: simple kriging."""
    wanted = [(band, at_m)]
    variance = level_covariance(errors, site, wanted, wanted)[0, 0]
    if not levels:
        return 0.0, variance
    key = [(one, there_m) for one, there_m, _, _ in levels]
    covariance = level_covariance(errors, site, key, key) + np.diag([one[3] for one in levels])
    by = np.linalg.solve(covariance, level_covariance(errors, site, key, wanted)[:, 0])
    error_db = np.array([one[2] for one in levels])
    return by @ error_db, variance - by @ level_covariance(errors, site, key, wanted)[:, 0]


def bound_log_likelihood(level_dbm, candidates_dbm, censored, sd_db):
    """Mean likelihood over the candidates of a level, or of a bound on it."""
    likelihoods = []
    for predicted_dbm in candidates_dbm:
        deviation = (level_dbm - predicted_dbm) / sd_db
        if censored == 0:
            likelihoods.append(exp(-0.5 * deviation**2))
        else:
            # Below: the received level, predicted plus error, is under the bound.
            side = deviation if censored < 0 else -deviation
            likelihoods.append(exp(log_normal_cdf(side)))
    return log(sum(likelihoods) / len(likelihoods))


def report_log_likelihood(table, site, path, reports, options, floor):
    """Log-likelihood of the last of some reports for one hypothesis, whose cells have no faults.

    Parameters
    ----------
    table : (rows, cols, cells) array
        Predicted levels.
    path : sequence of ((row, col), metres along the path)
        Of the hypothesis at each report.
    reports : sequence of mapping
        ``serving``, a band or None; ``levels``, rows of band and level; ``absent``, bands, at most
        one; ``limit``, the level that it is below; ``bounds``, rows of bands, level and side.
    options : EvidenceOptions
    floor : float
        Metres that the last report counts for, and how far the hypothesis may lie beside the true
        position.
    """
    errors, (counted_m, spacing_m) = options.levels, floor
    beside = 2 * options.beside_db**2 * (1 - exp(-spacing_m / options.beside_m))
    white = errors.white_db**2 + beside
    every = [
        [(band, at_m, level - table[pixel][band], white) for band, level in report["levels"]]
        for (pixel, at_m), report in zip(path, reports, strict=True)
    ]
    before = [level for levels in every[:-1] for level in levels]
    report, (pixel, at_m) = reports[-1], path[-1]
    here, total = table[pixel], 0.0
    if report["serving"] is not None:
        weight = counted_m * options.serving.weight_per_m
        total += weight * serving_log_likelihood(here, report["serving"], options.serving)
    after = before + every[-1]
    by_levels = levels_log_density(errors, site, after) - levels_log_density(errors, site, before)
    for band in report["absent"]:
        mean, variance = level_forecast(errors, site, after, band, at_m)
        sd_db = sqrt(variance + white + errors.absent_db**2)
        by_levels += log_normal_cdf((report["limit"] - here[band] - mean) / sd_db)
    total += errors.weight * by_levels
    for bands, level, side in report["bounds"]:
        weight = options.bound_weight * (1 - exp(-2 * counted_m / 50.0))
        sd_db = sqrt(errors.slow_db**2 + errors.fast_db**2 + errors.white_db**2)
        total += weight * bound_log_likelihood(level, [here[band] for band in bands], side, sd_db)
    return total


# Going back along a track


def ancestor_probabilities(later, earlier, log_weight, moved_m, variances, log_jump):
    """Probability of each earlier hypothesis: its weight times how well it reaches the later one.

    ``variances`` are those of place, bias and scale; ``log_jump`` is the least that counts.
    """
    place_var, bias_var, scale_var = variances
    length_m, heading_rad = hypot(*moved_m), atan2(moved_m[1], moved_m[0])
    terms = []
    for one, weight in zip(earlier.T, log_weight, strict=True):
        east, north, bias, scale = (float(x) for x in one[:4])
        reached = moved(east, north, bias, scale, length_m, heading_rad)
        turned = atan2(sin(later[2] - bias), cos(later[2] - bias))
        apart = (later[0] - reached[0]) ** 2 + (later[1] - reached[1]) ** 2
        fit = apart / place_var + turned**2 / bias_var + (later[3] - scale) ** 2 / scale_var
        terms.append(exp(max(-0.5 * fit, log_jump) + float(weight)))
    return np.array(terms) / sum(terms)


# Discrete and linear problems with exact answers


def forward(prior, steps):
    """Beliefs and log evidence of a hidden Markov model; steps are (transition, likelihood)."""
    belief, log_evidence, beliefs = np.asarray(prior, dtype=float), 0.0, []
    for transition, likelihood in steps:
        joint = [
            sum(belief[i] * transition[i][j] for i in range(len(belief))) * likelihood[j]
            for j in range(len(likelihood))
        ]
        total = sum(joint)
        log_evidence += log(total)
        belief = np.array(joint) / total
        beliefs.append(belief)
    return beliefs, log_evidence


def path_sum(prior, steps):
    """Logarithm of the sum over all paths of prior, transitions and likelihoods."""
    count, total = len(prior), 0.0
    for path in product(range(count), repeat=len(steps) + 1):
        term = prior[path[0]]
        for (transition, likelihood), i, j in zip(steps, path, path[1:], strict=False):
            term *= transition[i][j] * likelihood[j]
        total += term
    return log(total)


def joint_gaussian(mean, covariance, transitions, processes, readings, noise):
    """Means and covariances of all states given all readings, solved as one Gaussian.

    Readings are of the whole state; row 0 of them belongs to the prior's state. Transition and
    process k lead from state k to state k + 1.
    """
    n, count = len(mean), len(readings)
    precision, shift = np.zeros((n * count, n * count)), np.zeros(n * count)
    precision[:n, :n] += np.linalg.inv(covariance)
    shift[:n] += np.linalg.solve(covariance, mean)
    for k in range(count - 1):
        at = slice(k * n, (k + 2) * n)
        both = np.hstack([-transitions[k], np.eye(n)])
        precision[at, at] += both.T @ np.linalg.inv(processes[k]) @ both
    for k, reading in enumerate(readings):
        at = slice(k * n, (k + 1) * n)
        precision[at, at] += np.linalg.inv(noise)
        shift[at] += np.linalg.solve(noise, reading)
    spread = np.linalg.inv(precision)
    means = (spread @ shift).reshape(count, n)
    return means, np.array([spread[k * n : (k + 1) * n, k * n : (k + 1) * n] for k in range(count)])


def three_taps(shift_px, variance_px2):
    """Shares of the nearest pixel and its neighbours with a given mean and variance."""
    nearest = round(shift_px)
    beside = shift_px - nearest
    variance = max(variance_px2, abs(beside) * (1 - abs(beside)))
    places = np.array([-1.0, 0.0, 1.0])
    moments = np.array([np.ones(3), places, places**2])
    shares = np.linalg.solve(moments, [1.0, beside, variance + beside**2])
    return {nearest + int(k): float(share) for k, share in zip(places, shares, strict=True)}
