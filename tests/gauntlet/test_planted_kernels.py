"""Defects of a node's kernels, planted one by one: each is found by a check that the kernels as they are pass.

What is compiled cannot be patched, so the step is run in its parts, which is the same bit for bit, and between them a
part of what the kernels did is undone.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from node_by_node import NodeByNode
from string_of_one import Sample, Spoil, StringOfOne

from node.firmware.sensor_limits import SensorLimits
from node.kernels.arithmetic.formats import Array
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.record.node_record import END, JOINED, START
from node.kernels.step.node_step import REFUSED, begin_step, end_step, say_events

SAMPLES = 32  # cycles, of a survey
LASTS = 40  # cycles, of a fault that ends within a stop
Step = Callable[[Array, Array, Array, Array, Array], int]


class StepInParts:
    """``node.kernels.step.node_step.node_step`` by its parts; a plant undoes what they did."""

    def __call__(self, nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
        node = nodes[0]
        state = node["filter"]
        before = int(state["surveyed"]), int(state["still_cycles"])
        waits = begin_step(nodes, settings, parameters, self.seen(readings), moment)
        if waits == REFUSED:
            return say_events(node)
        self.undo(node, *before)
        joined = int(moment[JOINED] != 0.0)
        status = run_cycle(state, node["config"], node["rate"], node["force"], moment[START], moment[END], joined)
        surveyed = int(state["surveyed"])
        says = end_step(nodes, settings, moment, status, waits)
        self.undo(node, surveyed, int(state["still_cycles"]))
        return says

    def seen(self, readings: Array) -> Array:
        """What of the readings the step sees."""
        return readings

    def undo(self, node: Any, surveyed: int, still_cycles: int) -> None:
        """Undo what was done to these fields of the filter."""


class SaturationSeenAbove(StepInParts):
    """Only the upper end of a range counts as saturated."""

    def seen(self, readings: Array) -> Array:
        limits = SensorLimits()
        lower = -0.99 * np.repeat([limits.rate_range, limits.force_range], 3)
        readings[:, :6] = np.maximum(readings[:, :6], lower)
        return readings


class SurveyOfSubstitutedForce(StepInParts):
    """A faulty accelerometer does not keep a node from surveying by the force that stands for its reading."""

    def undo(self, node: Any, surveyed: int, still_cycles: int) -> None:
        if node["guard"]["force"]["fault"] != 0:
            node["filter"]["surveyed"] = surveyed


class AverageGoesOn(StepInParts):
    """When an accelerometer recovers, the average of the stop goes on over what stood for its readings."""

    was_faulty = False

    def undo(self, node: Any, surveyed: int, still_cycles: int) -> None:
        is_faulty = bool(node["guard"]["force"]["fault"] != 0)
        if self.was_faulty and not is_faulty:
            node["filter"]["still_cycles"] = still_cycles
        self.was_faulty = is_faulty


def drilled(step: Step | None, spoil: Spoil) -> StringOfOne:
    """A string of one tube: by its kernel, or by another step, which a kernel would not take."""
    string = StringOfOne(1, spoil, blocks=1)
    if step is None:
        return string.run()
    string.tube._loop = string.tube._loop._replace(step=step)
    driver = NodeByNode(string.string, lambda tube, cycle: spoil(cycle, string.world.imu_sample(tube, cycle)))
    for cycle in range(string.cycles):
        driver.step(cycle)
    return string


def resting() -> int:
    """Cycle within the stop of the string, soon after its begin."""
    return StringOfOne(1, blocks=1).resting(0, 0.1)


def saturation_is_told_at_either_end(step: Step | None) -> str:
    limits, at = SensorLimits(), resting()
    for first, code, size in ((2, "gyro_saturated", limits.rate_range), (3, "force_saturated", limits.force_range)):
        for end in (size, -size):

            def spoil(cycle: int, sample: Sample, k: int = first, value: float = end) -> Sample:
                # noise of the others goes on, so that nothing repeats itself
                return [*sample[:k], value, *sample[k + 1 :]] if at <= cycle < at + 5 else sample

            told = drilled(step, spoil).codes(at)
            if code not in told:
                return f"a reading of {end:.1f} is {told}"
    return ""


def a_survey_is_the_mean_of_what_was_read(step: Step | None) -> str:
    at = resting()
    held: Sample = []

    def spoil(cycle: int, sample: Sample) -> Sample:
        if cycle == at - 1:
            held[:] = sample
        return [*sample[:3], *held[3:]] if at <= cycle < at + LASTS else sample

    string = drilled(step, spoil)
    read = string.world.sensors.samples(1)[:, 3:]
    surveys = [survey for survey in string.string.run.surveys if survey.cycle >= at]
    for survey in surveys:
        rows = slice(survey.cycle - SAMPLES + 1, survey.cycle + 1)
        off = np.abs(np.array(survey.measurement.imus[0].force) - read[rows].mean(axis=0)).max()
        if off > 1e-9:
            return f"the survey of cycle {survey.cycle} is {off:.1e} m/s^2 off what was read"
    return "" if surveys else "no survey"


PLANTED: dict[str, tuple[Callable[[], Step], Callable[[Step | None], str]]] = {
    "saturation seen on one side only": (SaturationSeenAbove, saturation_is_told_at_either_end),
    "survey of the substituted force": (SurveyOfSubstitutedForce, a_survey_is_the_mean_of_what_was_read),
    "average over the substituted force": (AverageGoesOn, a_survey_is_the_mean_of_what_was_read),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_defect_of_a_kernel_is_found(name: str) -> None:
    plant, find = PLANTED[name]
    assert find(None) == ""
    found = find(plant())
    print(f"{name}: {found}")
    assert found != ""


def test_a_step_in_parts_is_the_step() -> None:
    whole, parts = drilled(None, lambda _, sample: sample), drilled(StepInParts(), lambda _, sample: sample)
    assert np.array_equal(whole.string.run.yaw, parts.string.run.yaw, equal_nan=True)
    assert np.array_equal(whole.string.run.var, parts.string.run.var, equal_nan=True)
    assert whole.codes() == parts.codes()
