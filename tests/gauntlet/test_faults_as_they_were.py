"""Every fault does what it did, step by step: what is asked of the rig, read in its world and left on its disks."""

from __future__ import annotations

import json

import pytest
from fault_figures import FIGURES, everything, figure_of_kind

from sim.gauntlet.faulty_world import MINUTE, FaultyWorld

EXACT = 1e-9  # of sums of floats, whose last bits differ between families of processors


def test_every_fault_does_what_it_did() -> None:
    found, kept = everything(), json.loads(FIGURES.read_text("utf-8"))
    assert list(found) == list(kept)
    assert {
        name: (found[name], kept[name]) for name in kept if found[name] != pytest.approx(kept[name], rel=EXACT)
    } == {}


def test_a_figure_knows_a_fault_that_is_smaller_by_little(monkeypatch: pytest.MonkeyPatch) -> None:
    world = FaultyWorld.of_tables(MINUTE, 1)
    before = figure_of_kind("depth-scale", world)
    monkeypatch.setattr(
        FaultyWorld, "scale_depth", lambda self, scale, t: self._scales.append((self.bit_depth(t), 0.99 * scale))
    )
    assert figure_of_kind("depth-scale", world) != pytest.approx(before, rel=EXACT)
