"""Random numbers by counter: a draw depends on the run, its purpose, the tube and the cycle, on no order of draws.

Philox 4x32 with ten rounds turns a counter of four words and a key of two into four words, bit by bit independent.
Source: Salmon, Moraes, Dror, Shaw, "Parallel random numbers: as easy as 1, 2, 3", SC 2011.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from sim.kernel import kernel

ROUNDS: Final = 10
WORD: Final = np.uint64(0xFFFFFFFF)
HALF: Final = np.uint64(32)
MULTIPLIERS: Final = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
WEYL: Final = (np.uint64(0x9E3779B9), np.uint64(0xBB67AE85))
STEP: Final = 1.0 / 2.0**32


@kernel
def philox_words(counter: Array, key: Array, words: Array) -> None:
    """Fill ``words`` (4,) from ``counter`` (4,) and ``key`` (2,), 32-bit words in uint64."""
    a, b, c, d = counter[0], counter[1], counter[2], counter[3]
    k, m = key[0], key[1]
    for _ in range(ROUNDS):
        first, second = MULTIPLIERS[0] * a, MULTIPLIERS[1] * c
        a, b, c, d = (second >> HALF) ^ b ^ k, second & WORD, (first >> HALF) ^ d ^ m, first & WORD
        k, m = (k + WEYL[0]) & WORD, (m + WEYL[1]) & WORD
    words[0], words[1], words[2], words[3] = a, b, c, d


@kernel
def fill_uniform(counter: Array, key: Array, words: Array, drawn: Array) -> None:
    """Fill ``drawn`` (n,) with numbers inside 0..1, n a multiple of four; ``counter``'s last word counts from 0.

    Parameters
    ----------
    counter, key : see ``philox_words``; the counter's last word is overwritten
    words : (4,) work space
    """
    for block in range(drawn.shape[0] // 4):
        counter[3] = np.uint64(block)
        philox_words(counter, key, words)
        for k in range(4):
            drawn[4 * block + k] = (np.float64(words[k]) + 0.5) * STEP


@kernel
def fill_normal(drawn: Array) -> None:
    """Turn pairs of uniform numbers (n,) into standard normal ones in place, n even. Source: Box and Muller 1958.

    The farthest is at 6.7 sigma, where the smallest of 32-bit numbers ends.
    """
    for k in range(0, drawn.shape[0], 2):
        size = math.sqrt(-2.0 * math.log(drawn[k]))
        turn = math.tau * drawn[k + 1]
        drawn[k], drawn[k + 1] = size * math.cos(turn), size * math.sin(turn)
