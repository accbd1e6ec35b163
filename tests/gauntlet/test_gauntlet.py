"""The gauntlet itself: it repeats, it finds what is planted, and its table is whole."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from borechain.cli.gauntlet.gauntlet import gauntlet
from borechain.gauntlet.run import ALL, run_seed, shrink
from groundstation.service import model
from sim.gauntlet.kinds import KINDS
from sim.gauntlet.plan import drawn_kinds, steps_of
from sim.world.streams import stream


def test_every_kind_has_a_name_of_its_own_and_draws_steps_in_its_time() -> None:
    assert len({kind.name for kind in KINDS}) == len(KINDS)
    for n, kind in enumerate(KINDS):
        for seed in range(20):
            steps = kind.draw(stream(seed, n), 1000.0, 1200.0)
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


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 4))
def test_seeds_hold_and_repeat_bit_for_bit(seed: int) -> None:
    first, second = run_seed(seed), run_seed(seed)
    assert first.violations == []
    assert first == second


@pytest.mark.slow
def test_a_depth_without_a_bracket_is_found_and_shrunk(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last reading before the survey stands for its depth, as it once did."""

    def last_before(log: model.DepthLog, epoch: int, time: float) -> float | None:
        track = log._tracks.get(epoch)
        before = [md for at, md in zip(track.at, track.md, strict=True) if at <= time] if track is not None else []
        return before[-1] if before else None

    monkeypatch.setattr(model.DepthLog, "at", last_before)
    monkeypatch.setattr(model.DepthLog, "_judge_jump", lambda *_arguments: None)
    failed = next(
        outcome for seed in range(1, 40) if (outcome := run_seed(seed, ["depth-jumps-up", "loss"])).violations
    )
    worst = shrink(replace(failed, kinds=(*failed.kinds, "duplicates")))
    assert worst.kinds == ("depth-jumps-up",)
    assert "is placed at" in worst.violations[0]


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
