"""Small rooms of the simulator and what leans on them: hints, stops, chunks, weights, verdicts, facts, rigs."""

from __future__ import annotations

import contextlib
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from seeded_worlds import DRAWN

from borechain.gauntlet import covered_states
from borechain.rig_search import live_rigs, who_is_there
from sim.campaign import engine
from sim.campaign.chunk import Campaign
from sim.rig.report import stops_of
from sim.studies.relay import run as relay
from sim.studies.scenarios import change_sections
from sim.studies.weighting import run as weighting
from sim.world.parsing import spelling_hint
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import BASE, Side

STRING: dict[str, Any] = {
    "rig": {"tubes": 2, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 40.0}},
    "schedule": {"add_s": 30.0, "joint_s": 10.0, "stop_s": 32.0, "finish_s": 7.0},
}


def test_a_word_that_is_near_is_offered_and_all_are_named() -> None:
    assert spelling_hint("tubs", ["stop", "tubes"]) == "did you mean tubes? expected one of stop, tubes"
    assert spelling_hint("x", ["stop", "tubes"]) == "expected one of stop, tubes"


def test_rigs_on_a_bus_are_named_once_in_order() -> None:
    asked: list[Any] = []

    def bus(*tokens: str) -> Any:
        return SimpleNamespace(tokens=lambda *given: asked.append(given) or tokens)  # type: ignore[func-returns-value]

    two = bus("borechain/b/@lease/1", "borechain/a/@lease/2", "borechain/b/@lease/3")
    assert live_rigs(two) == ["a", "b"]
    assert who_is_there(two) == "rigs with a ground station: a, b"
    assert who_is_there(bus()) == "no rig has a ground station here"
    assert set(asked) == {("borechain/*/@lease/*", 1.0)}


@pytest.mark.parametrize("change", [{}, {"blocks": 3}])
def test_a_string_stands_from_each_stop_until_it_drills_again_or_to_the_end(change: dict[str, Any]) -> None:
    tables = change_sections(STRING, schedule=change)
    if change:
        tables = change_sections(tables, rig={"tubes_at_start": 2}, rotation={"advance_m": 1.0})
    world = World(scenario_of(tables), 1)
    stops = [phase for phase in world.phases if phase.kind == "stop"]
    assert len(stops) > 1
    following = [*stops[1:], None]
    for (stop, until), one, after in zip(stops_of(world), stops, following, strict=True):
        assert stop is one
        drills = [p.start for p in world.phases if p.kind == "drill" and (after is None or p.end <= after.start + 1e-9)]
        assert until == (world.end if after is None else max(drills))


def test_a_campaign_dates_what_a_tube_knew_by_the_tube_s_own_cycles() -> None:
    scenario = scenario_of(change_sections(dict(DRAWN), encoder={"phase": "random"}))
    found, world = Campaign(scenario).chunk(3, 3), World(scenario, 3)
    assert min(world.phase(1), world.phase(2)) > 0.0
    for columns, tube_of in ((found.epochs, lambda row: 3 - row["hop"]), (found.surveys, lambda row: row["tube"])):
        assert len(columns["at"]) > 0
        for k, at in enumerate(columns["at"]):
            tube = int(tube_of({name: values[k] for name, values in columns.items() if name in ("hop", "tube")}))
            assert np.abs(world.ends + world.phase(tube) - at).min() < 1e-9


def test_runs_of_one_process_are_computed_in_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "run_chunk", lambda *given: given)
    monkeypatch.setattr(engine, "usable_cores", lambda: 1)
    given: Any = (b"scenario", [(3, 5), (6, 9)], "local", None)
    assert list(engine.compute_chunks(*given)) == [((3, 5), (b"scenario", 3, 5)), ((6, 9), (b"scenario", 6, 9))]
    assert engine.work_of((b"s", 1, 2)) == ((1, 2), (b"s", 1, 2))  # type: ignore[comparison-overlap]


def test_weights_of_a_sequence_are_powers_of_its_places() -> None:
    steps: list[None] = []
    result = weighting.run_study(lambda: steps.append(None))
    assert len(steps) == weighting.count_steps()
    for power, scheme in enumerate(("equal", "linear", "quadratic", "cubic")):
        places = [np.arange(1.0, n + 1.0) ** power for n in (2, 3, 4)]
        for found, wanted in zip(result["weights"][scheme], places, strict=True):
            assert found == pytest.approx((wanted / wanted.sum()).tolist())


@pytest.mark.parametrize(
    ("nees", "holds"),
    [
        (relay.CONSISTENT[0], True), (relay.CONSISTENT[1], True), (math.nextafter(relay.CONSISTENT[0], 0.0), False),
        (math.nextafter(relay.CONSISTENT[1], 9.0), False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["nees_rest", "nees_turning", "nees_total"])
def test_a_scheme_is_consistent_with_each_of_its_figures_at_its_bounds(
    monkeypatch: pytest.MonkeyPatch, name: str, nees: float, holds: bool
) -> None:
    good = dict.fromkeys(("nees_rest", "nees_turning", "nees_total"), 1.0)
    monkeypatch.setattr(relay, "over_cores", lambda _seeds, _step: contextlib.nullcontext(lambda _run, jobs: jobs))
    monkeypatch.setattr(relay, "hop_rows", lambda _scheme, _runs: [good, good | {name: nees}])
    result = relay.run_study(2, 3, lambda: None)
    assert set(result["consistent"].values()) == {holds}
    assert len(result["cases"]) == 2 * len(result["consistent"]) == 2 * relay.count_steps(2, 3) // 3


def test_facts_of_a_process_are_what_is_wrong_with_it() -> None:
    place = SimpleNamespace(neighbours={Side.UPPER: None, Side.LOWER: 2})
    endpoint = SimpleNamespace(
        clock=SimpleNamespace(synchronised=False), mail=SimpleNamespace(outbox_size=5), place=place
    )
    frozen, disks = {BASE}, {BASE: SimpleNamespace(refusal=28), 1: SimpleNamespace(refusal=0), 2: None}
    stepper = SimpleNamespace(
        processes={BASE: SimpleNamespace(endpoint=endpoint), 1: SimpleNamespace(endpoint=endpoint)},
        is_frozen=frozen.__contains__,
    )
    rig: Any = SimpleNamespace(
        stepper=stepper, disk=disks.__getitem__, ground=None, off={}, now=5.0,
        world=SimpleNamespace(phases=[SimpleNamespace(kind="hold", end=5.0), SimpleNamespace(kind="drill", end=9.0)]),
    )  # fmt: skip
    assert list(covered_states._facts_of_process(rig, BASE)) == [
        f"{BASE} frozen", f"{BASE} disk 28", f"{BASE} without rig time", f"{BASE} many wait", f"{BASE} deaf UPPER",
    ]  # fmt: skip
    endpoint.mail.outbox_size, endpoint.clock.synchronised = 4, True
    assert list(covered_states._facts_of_process(rig, 1)) == ["1 few wait", "1 deaf UPPER"]
    assert list(covered_states._facts_of_process(rig, 2)) == ["2 off"]
    facts = list(covered_states.facts_of(SimpleNamespace(**{**vars(rig), "disk": disks.get})))  # type: ignore[arg-type]
    assert facts[0] == "phase drill"
    assert "2 off" in facts
    assert "1 few wait" in facts
