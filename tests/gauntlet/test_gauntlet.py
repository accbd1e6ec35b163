"""The gauntlet itself: it repeats, it finds what is planted, and its table is whole."""

import json
from functools import cache
from itertools import combinations, product

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from borechain.cli.gauntlet.gauntlet import gauntlet
from borechain.gauntlet.gauntlet_rig import WORLDS
from borechain.gauntlet.gauntlet_run import ALL, SeedJob, judge_seed, run_seed
from sim.gauntlet.fault_kinds import KINDS
from sim.gauntlet.faulty_world import MINUTE, FaultyWorld
from sim.gauntlet.plan import combined_kinds, drawn_kinds, steps_of
from sim.world.random_streams import random_stream
from telemetry.messages import BASE, ENCODER

COMBINED, PARTS = 300, 2  # seeds in all, and tests that share those of a world; `make study` runs thousands


def test_every_kind_has_a_name_of_its_own_and_draws_steps_in_its_time() -> None:
    assert len({kind.name for kind in KINDS}) == len(KINDS)
    for n, kind in enumerate(KINDS):
        for seed in range(20):
            steps = kind.draw(random_stream(seed, n), 1000.0, 1200.0)
            assert steps
            assert all(1000.0 <= step.at <= 1200.0 for step in steps)


def test_a_kind_that_is_left_out_changes_no_other() -> None:
    every = [(name, step.at) for name, step in steps_of(7, ALL, 0.0, 100.0)]
    without = [(name, step.at) for name, step in steps_of(7, ALL[1:], 0.0, 100.0)]
    assert set(without) < set(every)


def test_seeds_switch_on_different_mixtures_and_always_something() -> None:
    mixtures = {drawn_kinds(seed, ALL) for seed in range(200)}
    assert len(mixtures) > 150
    assert all(mixtures)
    assert 1.5 < np.mean([len(kinds) for kinds in mixtures]) < 5.0


@given(st.integers(1, 12), st.integers(1, 4), st.integers(0, 10**7))
def test_seeds_in_a_row_bring_every_combination_once(kinds: int, together: int, first: int) -> None:
    names = ALL[: max(kinds, together)]
    every = list(combinations(names, together))
    found = [combined_kinds(seed, names, together) for seed in range(first, first + len(every))]
    assert sorted(found) == sorted(every)


@given(
    st.sampled_from((BASE, ENCODER, 1)),
    st.lists(st.tuples(st.floats(0.1, 1e5), st.floats(-1e-3, 1e-3)), min_size=1, max_size=6),
)
def test_a_clock_whose_drift_changes_never_runs_backwards(address: int, drifts: list[tuple[float, float]]) -> None:
    world = a_world().healthy()
    t = before = 0.0
    shown = world.local_clock(address, t)
    for lasting, rate in drifts:
        t += lasting
        world.let_drift(address, t, rate)
        assert world.local_clock(address, t) - shown == pytest.approx(t - before, rel=2e-3)
        before, shown = t, world.local_clock(address, t)
        assert world.true_time(address, shown) == pytest.approx(t, abs=1e-6)


@cache
def a_world() -> FaultyWorld:
    return FaultyWorld.of_tables(MINUTE, 1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
def test_seeds_hold_and_repeat_bit_for_bit(seed: int) -> None:
    first, second = run_seed(seed), run_seed(seed)
    assert first.violations == []
    assert first == second


@pytest.mark.slow
@pytest.mark.parametrize(("world", "part"), list(product(range(WORLDS), range(PARTS))))
def test_combined_seeds_hold(world: int, part: int) -> None:
    # each worker computes one world, not all of them
    seeds = [seed for seed in range(1, COMBINED + 1) if seed % WORLDS == world][part::PARTS]
    failed = [outcome for seed in seeds if (outcome := judge_seed(SeedJob(seed))).violations]
    assert [(outcome.seed, outcome.kinds, outcome.violations) for outcome in failed] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "kinds"),
    [
        (20205, ("node-cut", "database-deleted", "splice")),  # a recorded state kept a dead tube fresh
        (20063, ("bytes-rot", "same-number")),  # a stranger spoke for a tube without power
        (30271, ("ground-disk-refuses", "encoder-slips")),  # a slip that found no room on the disk
        (40291, ("not-finite", "encoder-slips")),  # the one that saw it stood beside one without a gyroscope
        (50000, ("encoder-slips", "frozen")),  # the one that saw it stood alone
        (50001, ("encoder-slips", "cut-while-saving")),  # the yaws of two neighbours parted at rest
        (72, ("same-number", "encoder-slips")),  # a joint that was solved anew took the slip, against its marks
        (51416, ("cut-again-and-again", "node-memory-lost", "splice")),  # a recorded state of an epoch before the last
        (104026, ("cut-while-saving", "not-finite", "encoder-slips")),  # one rested, the other was blind
        (102831, ("database-deleted", "gyro-saturated", "encoder-slips")),  # it was forgotten that one was blind
        (700999, ("cut-while-saving", "database-old", "length-wrong")),  # while an order of the crew was written down
        (107936, ("cut-while-saving", "frozen")),  # the power went while it saved what it had missed
        (206677, ("gyro-saturated", "encoder-slips")),  # the one that saw it had just started, the other was blind
        (206003, ("clock-jumps", "joint-severed")),  # an aiding of before a turning came to a clock that was ahead
        (200389, ("frozen", "force-saturated")),  # a clipped force was levelled by before it counted as a fault
        (201908, ("depth-jumps-down", "ground-off-across-stop", "depth-backwards")),  # why depths were refused
        (207889, ("same-number", "replay", "splice")),  # the first word of a tube, recorded, opened the door for more
        (213809, ("encoder-from-zero", "ground-cut", "bytes-rot", "database-deleted")),  # the first stand was a stop
        (213984, ("encoder-from-zero", "ground-cut", "depth-jumps-up")),  # a jump from one epoch to the next
        (305006, ("bytes-rot", "bursts", "gyro-step")),  # the encoder repeated itself to a node that had turned
        (321753, ("surveys-lost", "not-finite")),  # the survey came with the last word of the run
        # the ground station knows of the stop from its second half only
        (322663, ("encoder-from-zero", "cut-again-and-again", "node-memory-rots", "database-deleted")),
        (409896, ("same-number", "encoder-slips")),  # a stranger with the same number had nothing to say
        (502133, ("frozen", "bytes-rot")),  # the ground station had not moved since it stood still
        (502246, ("all-cut", "encoder-slips")),  # the power went while both began to contradict
        (417334, ("encoder-from-zero", "same-number", "gyro-stuck", "encoder-slips")),  # nor does an older epoch
        (403035, ("folders-swapped", "encoder-slips")),  # both had saved the yaw of another place
        (144714, ("gyro-stuck", "encoder-slips")),  # it slipped in the cycles that a gyroscope repeated itself in
        (118333, ("gyro-stuck", "gyro-saturated", "encoder-dead", "encoder-slips")),  # and the other was blind
        (117024, ("frozen", "node-memory-lost", "node-disk-refuses")),  # a state without a time had waited
        (144802, ("frozen", "node-memory-rots", "same-number")),  # the same
        (100342, ("gyro-step", "gyro-scale")),  # the yaw was opened at rest, and the resting encoder not heard again
        (
            632171,
            ("old-receipts", "database-old", "encoder-slips"),
        ),  # the word of a reset went with the database
        (653470, ("gyro-step", "encoder-slips", "wild-numbers")),  # its clock was gone when the yaw was reset
        # an aiding that came too late counted as used
        (653438, ("surveys-lost", "gyro-saturated-below", "encoder-slips", "wild-numbers")),
        # a stand of a time that was doubtful before the ground station's start
        (1010316, ("ground-cut", "depth-jumps-down", "depth-backwards")),
        # the first stand was a stop, which was kept shorter than it was
        (1000528, ("encoder-from-zero", "ground-cut", "old-receipts", "database-deleted")),
        # nor was it when no tube surveyed, and the encoder had started since the bit came to it
        (1107259, ("encoder-from-zero", "old-receipts", "node-memory-rots", "ground-disk-refuses", "database-deleted")),
        # a stop was judged in the moment of another epoch, before any tube was known
        (1002690, ("encoder-cut", "bytes-rot", "folders-swapped", "database-deleted")),
        # who began to listen after the other had begun to contradict
        (1205090, ("node-cut", "encoder-from-zero", "bursts", "joint-deaf", "encoder-slips")),
        # a survey that became overdue with the last word of the run
        (1205930, ("encoder-from-zero", "bytes-rot", "boots-damaged", "force-stuck", "depth-lost")),
        # stands that began in a doubtful time and went on after it
        (2001346, ("cut-again-and-again", "node-memory-rots", "depth-backwards")),
        (2012043, ("ground-off-across-stop", "node-memory-lost", "depth-jumps-down")),
        # a stop for which the string was lifted off the bottom, as far as the depth told
        (2007872, ("bytes-rot", "depth-lost", "depth-jumps-down", "depth-backwards")),
        # states without a time that were sent in again, among some of an earlier start
        (2014942, ("old-receipts", "bytes-rot", "ground-disk-refuses", "splice")),
        # one of before that had never come up
        (2101463, ("node-cut", "replay")),
        # a wrong stand that was in doubt only as long as anybody listened
        (2102135, ("frozen", "encoder-boots-lost", "depth-jumps-down")),
        # a stranger that made up the length of a string of which one tube was not known
        (2201462, ("node-memory-rots", "same-number", "database-deleted")),
        # all lost their power as the string turned, and the encoder slipped before the first was back
        (9377568, ("all-cut", "encoder-slips")),
        # the same, a second after it had slipped
        (9343416, ("all-cut", "encoder-dead", "encoder-slips")),
        # the first word that came after the ground station had stood still said nothing of a tube
        (9375046, ("frozen", "bytes-rot")),
        (51633, ("surveys-lost", "gyro-step")),  # a gyroscope that turned its tube while nothing corrected it
    ],
)
def test_seeds_that_failed_once_hold(seed: int, kinds: tuple[str, ...]) -> None:
    assert run_seed(seed, kinds=kinds).violations == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2])
def test_seeds_of_a_string_that_is_drilled_in_hold(seed: int) -> None:
    assert run_seed(seed, plan="drilled-in").violations == []


@pytest.mark.statistical
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("block", range(8))
@pytest.mark.parametrize(("plan", "count"), [("minute", 250), ("drilled-in", 25)])
def test_two_thousand_seeds_hold(plan: str, count: int, block: int) -> None:
    first = 10_000 + count * block
    failed = [
        outcome for seed in range(first, first + count) if (outcome := judge_seed(SeedJob(seed, plan=plan))).violations
    ]
    assert [(outcome.seed, outcome.kinds, outcome.violations) for outcome in failed] == []


def test_the_command_lists_its_kinds_and_refuses_others() -> None:
    listed = CliRunner().invoke(gauntlet, ["--list"])
    assert [line.split()[0] for line in listed.output.splitlines()] == list(ALL)
    refused = CliRunner().invoke(gauntlet, ["--faults", "node-cut,melt"])
    assert refused.exit_code == 2
    assert "'melt'" in refused.output


@pytest.mark.slow
def test_one_seed_is_one_object() -> None:
    shown = CliRunner().invoke(gauntlet, ["--seed", "3", "--exactly", "loss", "--json"])
    row, figures = map(json.loads, shown.output.splitlines())
    assert (row["seed"], row["faults"], row["violations"]) == (3, ["loss"], [])
    assert (figures["seeds"], figures["failed"]) == (1, 0)


def test_a_gyroscope_of_a_wrong_scale_is_not_taken_for_an_encoder_that_stands() -> None:
    """At the stop it turns by the step that its bias took for the scale: it has changed itself, and surveys."""
    outcome = run_seed(3, kinds=["gyro-scale"])
    assert (outcome.measurements, outcome.violations) == (2, [])
    assert "survey_missing" not in outcome.told


def test_an_encoder_that_dies_is_told_as_the_encoder_whichever_tube_calls_it_what() -> None:
    assert "reference" in run_seed(3, kinds=["encoder-dead"]).told
