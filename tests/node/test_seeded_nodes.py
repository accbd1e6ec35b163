"""Nodes that live through everything once tell and know what they told and knew, event by event and word by word.

The figures say that nothing has changed, not that it is right: that the tests beside this one do. Every event stands
there with its cycle and its arguments; fields of messages and of the record are sums by weights that differ, of which
the last digits differ between families of processors. Where a node is to tell otherwise,
``python tests/tools/seeded_nodes.py`` writes them anew, and the change is read.
"""

from __future__ import annotations

import json
import math

import pytest
from node_lives import LIVES
from seeded_nodes import FIGURES, KERNELS, figures_of, weighed

KEPT = json.loads(FIGURES.read_text(encoding="utf-8"))
SUMS = 1e-6  # of the sum of all sizes
QUICK = "joints solved", "cluster"  # in floats


def compare(name: str, kernel: str) -> None:
    found, kept = figures_of(name, kernel), KEPT[f"{name}, {kernel}"]
    for one, other in zip(found["events"], kept["events"], strict=False):
        assert one[:3] == other[:3]
        assert one[3] == {what: given if isinstance(given, str | bool) else pytest.approx(given, rel=1e-4, abs=1e-6)
                          for what, given in other[3].items()}  # fmt: skip
    assert len(found["events"]) == len(kept["events"])
    for part in kept.keys() - {"events"}:
        assert found[part].keys() == kept[part].keys()
        apart = {what: (found[part][what], sums) for what, sums in kept[part].items()
                 if not math.dist(found[part][what], sums) <= SUMS * sums[1] + 1e-15}  # fmt: skip
        assert apart == {}


@pytest.mark.parametrize("name", QUICK)
def test_a_node_tells_and_knows_what_it_did(name: str) -> None:
    compare(name, "float64")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "kernel"),
    [(name, kernel) for name in LIVES for kernel in KERNELS if kernel == "fixed" or name not in QUICK],
)
def test_a_node_in_either_form_tells_and_knows_what_it_did(name: str, kernel: str) -> None:
    compare(name, kernel)


@pytest.mark.parametrize("name", LIVES)
def test_both_forms_told_the_same_but_for_a_few(name: str) -> None:
    """Integers and floats are written apart, and their lives must not part for long."""
    one, other = ({(event[0], event[1]) for event in KEPT[f"{name}, {kernel}"]["events"]} for kernel in KERNELS)
    assert len(one ^ other) <= 0.05 * len(one | other)


def test_a_figure_moves_with_every_number_and_with_their_order() -> None:
    values = [1.0 + 0.02 * k for k in range(50)]
    plain = weighed(values)
    for k in range(49):
        other = values.copy()
        other[k] *= 1.001
        assert math.dist(weighed(other), plain) > SUMS * plain[1]
        other = values.copy()
        other[k], other[k + 1] = other[k + 1], other[k]
        assert math.dist(weighed(other), plain) > SUMS * plain[1]
