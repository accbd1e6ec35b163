"""How long a message takes over joints that lose frames in bursts: the distribution that the link's rules give.

A frame is sent again after the timeouts of `telemetry.transport.hop` until it is acknowledged, and the radio itself
makes several attempts at each. A joint is in or out of a burst as a two-state Markov chain, in balance when the
message comes to it; what passes one joint goes on at once over the next.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from telemetry.transport.hop import FIRST_TIMEOUT, LAST_TIMEOUT

Array = npt.NDArray[np.float64]
STEP = 1e-3  # s, of the distributions
SPAN = 40.0  # s
CELLS = round(SPAN / STEP)


@dataclass(frozen=True, slots=True)
class LossyJoint:
    """One joint as a message meets it.

    Parameters
    ----------
    error_rates : of one attempt of the radio, outside bursts and inside
    attempts : of the radio at a frame, each after the first takes ``attempt`` s more
    latency, jitter : s, constant part and mean of the exponential part
    begins, ends : 1/s, rates at which bursts begin outside and end inside; 0 and 1 where there are none
    """

    error_rates: tuple[float, float]
    attempts: int
    attempt: float
    latency: float
    jitter: float
    begins: float = 0.0
    ends: float = 1.0


@lru_cache(maxsize=256)
def joint_delay(joint: LossyJoint) -> Array:
    """Distribution (CELLS,) of the time (s, in steps of STEP) over one joint, without its jitter."""
    rates = np.array(joint.error_rates)
    lost = rates**joint.attempts
    state = np.array([joint.ends, joint.begins]) / (joint.begins + joint.ends)
    found = np.zeros(CELLS)
    at, timeout = 0.0, FIRST_TIMEOUT
    while at < SPAN:
        for failed in range(joint.attempts):
            heard = float(state @ (rates**failed * (1.0 - rates)))
            place = round((at + joint.latency + failed * joint.attempt) / STEP)
            if place < CELLS:
                found[place] += heard
        state = _passed(state * lost, joint, timeout)
        at += timeout
        timeout = min(2.0 * timeout, LAST_TIMEOUT)
    found[-1] += max(1.0 - float(found.sum()), 0.0)
    return found


def message_delay(joints: Sequence[LossyJoint]) -> Array:
    """Distribution (CELLS,) of the time over joints that are independent of each other and jitter alike."""
    from scipy.signal import fftconvolve  # a second, which only the study pays

    total = jitter_distribution(len(joints), joints[0].jitter)
    for joint in joints:
        total = fftconvolve(total, joint_delay(joint))[:CELLS]
    return np.maximum(total, 0.0)


def jitter_distribution(joints: int, mean: float) -> Array:
    """Distribution (CELLS,) of the sum of as many exponentials, each to the nearest step."""
    if mean <= 0.0:
        return np.asarray(np.arange(CELLS) == 0, float)
    from scipy.stats import gamma

    edges = (np.arange(CELLS + 1) - 0.5) * STEP
    return np.asarray(np.diff(gamma.cdf(edges, joints, scale=mean)))


def quantile(distribution: Array, share: float) -> float:
    """Time (s) within which a share of the messages has come."""
    cumulative = np.cumsum(distribution)
    return STEP * float(np.searchsorted(cumulative, share * cumulative[-1]))


def _passed(state: Array, joint: LossyJoint, seconds: float) -> Array:
    """Probabilities of the two states after some time."""
    total = joint.begins + joint.ends
    balance = np.array([joint.ends, joint.begins]) / total * state.sum()
    return np.asarray(balance + (state - balance) * math.exp(-total * seconds))
