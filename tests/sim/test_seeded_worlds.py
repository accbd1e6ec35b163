"""Short worlds with everything on show what they showed: one figure each of all that they read, draw and tell.

The figures are sums by weights that differ, so a draw that is moved, a term of another sign or a unit that is left out
shows wherever it stands. They say that nothing has changed, not that it is right: that the tests beside this one do.
Where a world is to read otherwise, ``python tests/tools/seeded_worlds.py`` writes them anew, and the change is read.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from seeded_worlds import FIGURES, RESTING, SEED, WORLDS, drawn, drilled, figure_of, records_by, shown_by

from node.kernels.arithmetic.formats import PERIOD
from sim.instruments.instrument_table import INSTRUMENTS
from sim.world.scenario import scenario_of
from sim.world.sensors import Sensors
from sim.world.world import World

KEPT = json.loads(FIGURES.read_text())
EXACT, FILTERED = 1e-9, 1e-6  # of sums of floats, whose last bits differ between families of processors


def compare(found: dict[str, float], kept: dict[str, float], rel: float) -> None:
    assert list(found) == list(kept)
    apart = {
        what: (found[what], kept[what]) for what in kept if found[what] != pytest.approx(kept[what], rel=rel, abs=1e-12)
    }
    assert apart == {}


@pytest.mark.parametrize("name", WORLDS)
def test_a_world_shows_what_it_showed(name: str) -> None:
    compare(dict(shown_by(name)), KEPT[name], EXACT)


@pytest.mark.parametrize("name", INSTRUMENTS)
def test_an_instrument_writes_what_it_wrote(name: str) -> None:
    compare(dict(records_by(name)), KEPT[f"records of {name}"], FILTERED)


def test_a_string_knows_what_it_knew() -> None:
    compare(dict(drilled()), KEPT["drilled"], FILTERED)


@pytest.mark.parametrize(("name", "kept"), [("plain", "campaign"), ("rough", "field")])
def test_a_campaign_keeps_what_it_kept(name: str, kept: str) -> None:
    compare(dict(drawn(name)), KEPT[kept], FILTERED)


def test_a_figure_moves_with_every_number_and_with_their_order() -> None:
    values = np.linspace(1.0, 2.0, 50)
    for k in range(49):
        other = values.copy()
        other[k] *= 1.0 + 1e-6
        assert figure_of(other) != pytest.approx(figure_of(values), rel=EXACT)
        other = values.copy()
        other[[k, k + 1]] = other[[k + 1, k]]
        assert figure_of(other) != pytest.approx(figure_of(values), rel=EXACT)


def test_a_quiet_world_reads_gravity_and_the_turn_of_its_head() -> None:
    """Beside the figures, by hand: at rest 9.8 m/s^2 whatever the lean, and 2.5 turns over the whole block."""
    quiet = {"noise_dps_rthz": (1e-9,) * 3, "bias_std_dps": (0.0,) * 3, "constant_bias_dps": (0.0,) * 3}
    tables = {
        **RESTING,
        "gyroscope": quiet | {"constant_bias_std_dps": 0.0, "scale_factor_std": 0.0, "resolution_dps": 0.0},
        "accelerometer": {"noise_deg": 1e-9, "bias_std_deg": 0.0, "vibration_mps2": 0.0, "gravity_mps2": 9.8},
        "joints": {"mount_tilt_std_deg": 0.0},
    }
    world = World(scenario_of(tables), SEED)
    samples = Sensors(world).samples(2)
    at_rest = np.abs(samples[:, 2]) < 1e-9
    assert np.linalg.norm(samples[at_rest, 3:], axis=1) == pytest.approx(9.8, rel=1e-6)
    assert samples[:, 2].sum() * PERIOD == pytest.approx(2.5 * 2.0 * np.pi, rel=1e-6)
    lean = np.degrees(np.arccos(-samples[at_rest, 5] / 9.8))
    assert lean == pytest.approx(12.0, abs=1e-3)
