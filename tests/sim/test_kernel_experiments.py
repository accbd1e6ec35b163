"""The published form beside ours, what each ingredient buys, integers against floats: figures, tables and commands."""

import math
import subprocess
import sys

import numpy as np
import pytest

from borechain.drilling.rig_processes import PRELOAD
from node.firmware.tube_settings import KERNELS
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import Scheme
from node.kernels.string.encoder_step import COUNTS_PER_TURN
from node.process.tube_command import node
from sim.string.plain_encoder import LINES, PlainEncoder
from sim.studies.ingredients import run as ingredients
from sim.studies.lab import LAB, REST, ROTATING, LabRun
from sim.studies.modes import run as modes
from sim.studies.published_form import published_forms
from sim.studies.scenarios import Tables, change_sections, on_off
from sim.studies.trials import rms_deg
from sim.world.disturbance.white_noise import SAMPLE_RATE_HZ, noise_densities
from sim.world.scenario_file import GyroSection, NodeSection

pytestmark = pytest.mark.slow

SEEDS = 6


def runs(setup: Tables, seeds: int = SEEDS) -> list[LabRun]:
    return [published_forms.run_published((setup, seed)) for seed in range(1, seeds + 1)]


def yaw(found: list[LabRun], window: np.ndarray = REST, hop: int = 0) -> float:
    return rms_deg([r.error[window, hop] for r in found])[0]


def test_the_published_filter_rests_like_the_thesis_and_diverges_while_it_turns() -> None:
    found = runs(published_forms.setup_of(LAB, "published filter"))
    assert 0.02 < yaw(found) < 0.1
    assert yaw(found, ROTATING) > 1.0
    assert yaw(runs(LAB), ROTATING) < 0.05


def test_the_published_scheme_is_as_far_off_as_it_was_found() -> None:
    found = runs(published_forms.setup_of(LAB, "published scheme"))
    low, high = ingredients.STUDIED_DEG["published scheme"]
    assert 0.5 * low < yaw(found) < high
    assert yaw(found) > 5.0 * yaw(runs(LAB))


def test_a_published_node_hands_its_own_yaw_down() -> None:
    two = published_forms.setup_of(modes.TWO, "published filter")
    assert two["node"]["scheme"] == Scheme.ESTIMATE.name.lower()
    found = runs(two, 3)
    assert yaw(found, hop=1) < 0.2
    said = np.array([r.var[REST] for r in found])
    assert (said[:, -1, 1] < said[:, -1, 0]).all()  # taken as white, the errors of the first are averaged away


def test_published_rows_stand_beside_the_thesis_and_ours() -> None:
    result = modes.run_study("two-nodes", 2, lambda: None)
    rows = {(row["case"], row["quantity"]): row for row in result["cases"]}
    for case in modes.CASES["two-nodes"]:
        assert (case.name, "azimuth") in rows
        for form in published_forms.FORMS:
            row = rows[(f"{case.name}, {form}", "azimuth")]
            assert row["published"] == case.published
            assert row["low"] <= row["ours"] <= row["high"]
            assert row["to_reach"] is None


@pytest.mark.parametrize(
    ("name", "link", "window", "factor"),
    [
        ("no scale-factor state", on_off(20.0, 0.0), ROTATING, 2.0),
        ("no delay compensation, instantaneous rate", on_off(20.0, 0.0), REST, 10.0),
        ("no delay compensation", on_off(20.0, 0.0), ROTATING, 10.0),
        ("instantaneous rate", on_off(20.0, 0.0), ROTATING, 2.0),
        ("no edge times, no quadrature", on_off(20.0, 0.0), REST, 2.0),
        ("no zero-rate update", on_off(20.0, 0.0), REST, 5.0),
    ],
)
def test_every_ingredient_is_missed(name: str, link: dict, window: np.ndarray, factor: float) -> None:
    without = runs(change_sections(ingredients.INGREDIENTS[name], aiding=link))
    assert yaw(without, window) > factor * yaw(runs(change_sections(LAB, aiding=link)), window)


def test_each_ingredient_is_off_alone() -> None:
    differing = {
        name: {
            f"{section}.{key}"
            for section, values in setup.items()
            for key, value in values.items()
            if LAB.get(section, {}).get(key) != value
        }
        for name, setup in ingredients.INGREDIENTS.items()
        if not name.startswith("published")
    }
    assert differing.pop("as shipped") == set()
    assert differing["instantaneous rate"] == {"gyroscope.instantaneous"}
    assert (
        differing["no edge times"]
        == differing["no edge times, no quadrature"]
        == {
            "encoder.counts_per_turn",
            "encoder.edge_times",
        }
    )
    assert differing["no scale-factor state"] == differing["no zero-rate update"] == {"node.tuning"}
    assert ingredients.INGREDIENTS["no edge times"]["encoder"]["counts_per_turn"] == COUNTS_PER_TURN


def test_a_plain_encoder_reads_the_middle_of_its_count() -> None:
    encoder, quantum = PlainEncoder(LINES), math.tau / LINES
    said = [encoder.on_cycle(angle, k * PERIOD) for k, angle in enumerate((0.1, 0.1, 1.0, 1.7, 1.7, 1.7))]
    assert [a.sequence for a in said] == [1, 1, 2, 3, 4, 4]
    assert [a.rate for a in said[2:4]] == pytest.approx([0.9 / PERIOD, 0.7 / PERIOD], abs=quantum / PERIOD)
    assert all(abs(a.yaw - angle) <= 0.5 * quantum for a, angle in zip(said, (0.1, 0.1, 1.0, 1.7), strict=False))
    assert said[0].yaw_var == pytest.approx(quantum**2 / 12.0)
    assert [a.rate for a in (said[1], said[-1])] == [0.0, 0.0]


def test_a_single_sample_has_the_noise_of_its_band() -> None:
    gyroscope = GyroSection()
    single = noise_densities(gyroscope.model_copy(update={"instantaneous": True}), PERIOD)
    for one, mean in zip(single, gyroscope.noise_dps_rthz, strict=True):
        assert one / math.sqrt(PERIOD) == pytest.approx(mean * math.sqrt(SAMPLE_RATE_HZ))


def test_every_kernel_can_be_chosen_and_is_warmed_before_the_first_fork() -> None:
    choice = next(p.type for p in node.params if p.name == "kernel")
    assert tuple(choice.choices) == KERNELS  # type: ignore[attr-defined]
    assert [NodeSection(kernel=kernel).kernel for kernel in KERNELS] == list(KERNELS)
    assert set(PRELOAD) == set(KERNELS)
    program = (
        "import borechain.drilling.preload_all\n"
        "from node.kernels.step import node_step as step\n"
        "from node.kernels.step import fixed_step as fixed\n"
        "steps = (step.node_step, fixed.fixed_step)\n"
        "aidings = (step.node_aiding, fixed.fixed_aiding)\n"
        "print(all(k.signatures for k in steps + aidings))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
