"""The cluster: several IMUs in one tube, fused by inverse variance into one reading.

Every gyroscope has its own constant bias: what each reads at rest beside the mean of all is learnt and taken off, so
that the fused rate, and the bias that the filter knows, stay the same whichever IMU is left out.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.integers import multiply_q31, quotient_q30
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import (
    angular_square,
    bounded_deviation,
    bounded_ratio,
    by_type,
    mean_of_total,
    times_factor,
)
from node.kernels.arithmetic.quantity import NONE
from node.kernels.filter.priors import set_noise
from node.kernels.filter.resets import doubt_bias
from node.kernels.record.filter_record import RING
from node.kernels.record.node_record import TEMPERATURE
from node.kernels.sensors.cluster_watch import choose_imus, compare_imus, tell_members, watch_imus
from node.kernels.sensors.correction import USUAL
from node.kernels.string.encoder_rate import is_heard

MEMORY: Final = 1000  # cycles at rest, of the running mean of an offset


@by_type(lambda a, weight, total: times_factor(a, quotient_q30(weight, total)))
def weighted_share(a: float, weight: float, total: float) -> float:
    """A share of a weighted mean, that ``of_weighed`` makes of their sum; integers divide here."""
    return weight * a


@by_type(lambda a, total: a)
def of_weighed(a: float, total: float) -> float:
    """A sum of what was ``weighted_share``, as the mean."""
    return a / total


@by_type(lambda own: (own >> 4) * (own >> 4))
def noise_share(own: float) -> float:
    """A relative noise (Q24, at most 200) as a variance, Q40."""
    return own * own


@by_type(lambda part, std: multiply_q31(part, min(int(angular_square(std)) >> 16, 1 << 31)) << 7)
def part_of(part: float, std: float) -> float:
    """The part (Q40) of the variance of a rate (rad/s, of at most 0.04 deg/s in integers)."""
    return part * std**2


@kernel
def fuse_readings(readings: Array, weights: Array, fused: Array) -> None:
    """Inverse-variance mean sum w_i x_i / sum w_i into ``fused`` (k). Source: thesis eq. 3.42.

    Parameters
    ----------
    readings : (n, k or more), one row an IMU
    weights : (n or more,) inverse variances; a reading of weight 0 may be anything, numbers or none
    """
    total: float = 0
    for i in range(weights.shape[0]):
        total += weights[i] if weights[i] > 0 else 0
    for j in range(fused.shape[0]):
        fused[j] = 0
    for i in range(weights.shape[0]):
        if weights[i] > 0:
            for j in range(fused.shape[0]):
                fused[j] += weighted_share(readings[i, j], weights[i], total)
    for j in range(fused.shape[0]):
        fused[j] = of_weighed(fused[j], total)


@kernel
def follow_offsets(rates: Array, fused: Array, samples: int, offsets: Array) -> None:
    """Running means over ``samples`` cycles at rest of what each gyroscope reads beside the ``fused`` rate (3, rad/s).

    d_n = d_(n-1) + (w - w_fused - d_(n-1)) / n; ``rates`` and ``offsets`` are (n, 3), rad/s.
    """
    for i in range(rates.shape[0]):
        for j in range(3):
            offsets[i, j] += mean_of_total(rates[i, j] - fused[j] - offsets[i, j], samples)


@kernel
def fuse_imus(node: Any, settings: Any, readings: Array) -> None:
    """Judge the IMUs in one cycle and leave their fused reading in the node, NaN if none is sane.

    ``readings`` are raw, those of ``node.kernels.step.node_step.node_step``; corrected they lie in ``node.cluster``.
    """
    cluster = node.cluster
    watch_imus(cluster, settings, readings)
    expect_reading(node, settings.imus)
    compare_imus(node, settings)
    count = choose_imus(cluster, settings.imus)
    if tell_members(node, settings.imus) and count > 0:
        reweigh_cluster(node, settings)
    slot = cluster.cycles % RING
    for k in range(settings.imus):
        cluster.used[k] = cluster.chosen[k]
        cluster.weights[k] = settings.weight[k] if cluster.used[k] == 1 else 0
        cluster.ring_used[k, slot] = cluster.used[k]
        for i in range(3):
            cluster.ring_force[k, slot, i] = cluster.readings[k, 3 + i]
    cluster.cycles += 1
    fused = cluster.fused[:]
    take_mean(cluster.readings[:], cluster.weights, count, fused, node.rate, node.force)
    take_mean(readings, cluster.weights, count, fused, node.raw_rate, node.raw_force)
    node.temperature = mean_temperature(readings, cluster.used, settings.imus, count)


@kernel
def take_mean(readings: Array, weights: Array, count: int, fused: Array, rate: Array, force: Array) -> None:
    """Fused ``rate`` (3) and ``force`` (3) of the ``count`` IMUs in use; ``fused`` (6) is work space."""
    if count > 0:
        fuse_readings(readings, weights, fused)
    for i in range(3):
        rate[i] = fused[i] if count > 0 else NONE
        force[i] = fused[3 + i] if count > 0 else NONE


@kernel
def mean_temperature(readings: Array, used: Array, imus: int, count: int) -> float:
    """Mean temperature (C) of the ``count`` IMUs in use."""
    total: float = 0
    for k in range(imus):
        if used[k] == 1:
            total += readings[k, TEMPERATURE]
    return mean_of_total(total, count) if count > 0 else USUAL


@kernel
def expect_reading(node: Any, imus: int) -> None:
    """Rate (rad/s) and force (m/s^2) that the node would read in this cycle if nothing had changed: (6).

    While IMUs are apart and no encoder is heard the rate before they were: what was fused since is not evidence
    against one of them.
    """
    state, guard, cluster = node.filter, node.guard, node.cluster
    heard = is_heard(node)
    held = False
    for k in range(imus):
        held = held or (not heard and cluster.apart[k] != 0)
    for i in range(3):
        rate = state.static_bias[i] + state.bias[i]
        if i == 2:
            rate += guard.rate if heard else guard.sane_rate
        if not held:
            cluster.expected[i] = rate
        cluster.expects[i] = cluster.expected[i]
        cluster.expects[3 + i] = -times_factor(node.config.gravity, state.now_down[i])


@kernel
def begin_cluster(node: Any, settings: Any) -> None:
    """Weigh the IMUs in use for the first time in a session."""
    for k in range(settings.imus):
        node.cluster.chosen[k] = node.cluster.used[k]
    reweigh_cluster(node, settings)


@kernel
def reweigh_cluster(node: Any, settings: Any) -> None:
    """Noise of the configuration in use for the IMUs chosen, and the doubt in a bias that is now another mean.

    var(b' - b) = sigma_b^2 sum (w'_i - w_i)^2 noise_i^2: every gyroscope wanders by itself.
    """
    cluster, config = node.cluster, node.config
    before: float = 0
    after: float = 0
    changed: float = 0
    for k in range(settings.imus):
        before += settings.weight[k] if cluster.used[k] == 1 else 0
        after += settings.weight[k] if cluster.chosen[k] == 1 else 0
    for k in range(settings.imus):
        moved = bounded_ratio(settings.weight[k], after) if cluster.chosen[k] == 1 else 0
        moved -= bounded_ratio(settings.weight[k], before) if cluster.used[k] == 1 else 0
        changed += noise_share(times_factor(settings.noise[k], moved))
    set_noise(config, settings, after)
    for i in range(3):
        doubt_bias(node.filter, i, part_of(changed, settings.plain_bias_std[i]))


@kernel
def all_used(node: Any, settings: Any) -> bool:
    """Whether no IMU is left out."""
    count = 0
    for k in range(settings.imus):
        count += node.cluster.used[k]
    return bool(count == settings.imus)


@kernel
def learn_offsets(node: Any, settings: Any) -> None:
    """Take a cycle at rest, all IMUs in use, into the offsets of their gyroscopes."""
    cluster, mount, imus = node.cluster, node.mount, settings.imus
    if not all_used(node, settings):
        return
    mount.rate_samples = min(mount.rate_samples + 1, MEMORY)
    middle = cluster.fused[:3]
    fuse_readings(cluster.rates[:], cluster.weights, middle)
    follow_offsets(cluster.rates[:imus], middle, mount.rate_samples, mount.rate_offset)


@kernel
def survey_imus(node: Any, settings: Any, samples: int) -> None:
    """Mean force of each IMU that was in use over the newest ``samples`` cycles, with the covariance of the mean.

    C = sum (f - m)(f - m)^T / (n (n - 1)), as ``node.kernels.filter.moving_average.average_force``.
    """
    cluster = node.cluster
    for k in range(settings.imus):
        used = 1
        for n in range(samples):
            if cluster.ring_used[k, (cluster.cycles - samples + n) % RING] == 0:
                used = 0
        cluster.survey_used[k] = used
        if used == 1:
            average_ring_forces(
                cluster, cluster.ring_force[k], samples, cluster.survey_force[k], cluster.survey_force_cov[k]
            )


@kernel
def average_ring_forces(cluster: Any, forces: Array, samples: int, middle: Array, cov: Array) -> None:
    """Mean (3) of the newest ``samples`` of a ring of ``forces`` (RING, 3) and its covariance (3, 3)."""
    first = cluster.cycles - samples
    for i in range(3):
        middle[i] = 0
        for n in range(samples):
            middle[i] += forces[(first + n) % RING, i]
        middle[i] = mean_of_total(middle[i], samples)
    for i in range(3):
        for j in range(i, 3):
            total: float = 0
            for n in range(samples):
                slot = (first + n) % RING
                total += bounded_deviation(forces[slot, i] - middle[i]) * bounded_deviation(forces[slot, j] - middle[j])
            cov[i, j] = mean_of_total(total, samples * (samples - 1))
            cov[j, i] = cov[i, j]
