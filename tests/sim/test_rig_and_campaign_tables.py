"""Tables of a rig and of a campaign by hand: who hears whom, which runs are missing, errors hop by hop, intervals."""

from __future__ import annotations

import csv
import hashlib
import itertools
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sim.campaign.campaign_folder import Folder
from sim.campaign.chunk import RUNS
from sim.campaign.summary import accuracy_rows, honesty_rows
from sim.rig.port_ends import is_cable, join_ends, radio_hearers
from sim.rig.report import (
    STATION_KEYS,
    TRUTH_KEYS,
    figures_of_merit,
    missing_surveys,
    root_mean_square,
    station_digest,
    station_table,
    stops_of,
    wrap_deg,
    write_files,
    yaw_errors,
)
from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.stepped import Due

UP, LOW = Side.UPPER, Side.LOWER


def test_ends_face_each_other_down_the_string_and_not_through_an_open_joint() -> None:
    ends = join_ends((3, 2, 1), open_top=False)
    assert ends == {
        (BASE, LOW): (ENCODER, Due.UPPER_FRAME), (ENCODER, UP): (BASE, Due.LOWER_FRAME),
        (ENCODER, LOW): (3, Due.UPPER_FRAME), (3, UP): (ENCODER, Due.LOWER_FRAME),
        (3, LOW): (2, Due.UPPER_FRAME), (2, UP): (3, Due.LOWER_FRAME),
        (2, LOW): (1, Due.UPPER_FRAME), (1, UP): (2, Due.LOWER_FRAME),
    }  # fmt: skip
    opened = join_ends((3, 2, 1), open_top=True)
    assert opened == {end: facing for end, facing in ends.items() if end not in ((ENCODER, LOW), (3, UP))}
    assert join_ends((), open_top=True) == {
        (BASE, LOW): (ENCODER, Due.UPPER_FRAME),
        (ENCODER, UP): (BASE, Due.LOWER_FRAME),
    }


@given(st.integers(1, 6), st.integers(1, 7), st.booleans(), st.booleans())
@example(3, 6, True, True)
def test_by_radio_is_heard_who_is_near_enough_over_closed_joints(
    tubes: int, reach: int, below: bool, open_top: bool
) -> None:
    string = tuple(range(tubes, 0, -1))
    chain = (ENCODER, *string)
    side = LOW if below else UP
    for place, sender in enumerate(chain):
        expected = []
        for other in range(place + 1, len(chain)) if below else range(place - 1, -1, -1):
            if abs(other - place) > reach or (open_top and (place == 0 or other == 0)):
                break
            joints = tuple(chain[k] for k in range(len(chain)) if min(place, other) < k <= max(place, other))
            expected.append((chain[other], Due.UPPER_FRAME if below else Due.LOWER_FRAME, joints))
        assert list(radio_hearers(string, sender, side, reach, open_top=open_top)) == expected
    assert list(radio_hearers(string, 99, side, reach, open_top=open_top)) == []


def test_the_cable_is_between_base_and_head() -> None:
    assert {(a, s) for a in (ENCODER, BASE, 1, 2) for s in Side if is_cable(a, s)} == {
        (BASE, UP),
        (BASE, LOW),
        (ENCODER, UP),
    }


@given(st.integers(1, 900), st.integers(0, 700), st.sets(st.integers(0, 9)))
@example(250, 100, {0})
@example(1, RUNS - 1, set())
def test_runs_that_are_missing_are_those_of_no_chunk_cut_at_whole_chunks(
    first: int, more: int, there: set[int]
) -> None:
    """Chunks that are there may end before the first run asked for, or begin after the last."""
    chunks = [(k * RUNS + 1, (k + 1) * RUNS) for k in sorted(there)]
    last = first + more
    folder = Folder.__new__(Folder)
    folder.chunks = lambda: iter(chunks)  # type: ignore[method-assign]
    found = folder.missing(first, last)
    held = {run for begin, end in chunks for run in range(begin, end + 1)}
    assert [run for begin, end in found for run in range(begin, end + 1)] == [
        run for run in range(first, last + 1) if run not in held
    ]
    for begin, end in found:
        assert (begin - 1) // RUNS == (end - 1) // RUNS  # of one whole chunk
    for (_, end), (begin, _) in itertools.pairwise(found):
        assert begin > end + 1 or end % RUNS == 0  # and no shorter than need be


def columns(**values: Any) -> dict[str, Any]:
    return {name: np.asarray(value) for name, value in values.items()}


def test_honesty_is_hop_by_hop_over_nodes_that_know_their_yaw_with_intervals_over_runs() -> None:
    epochs = columns(
        run=[1, 1, 1, 2, 2, 2, 2],
        hop=[1, 1, 6, 1, 1, 6, 6],
        turning=[False] * 7,
        known=[True, True, True, True, True, True, False],
        yaw_error=[0.02, 0.04, 0.09, 0.01, -0.03, 0.20, 9.0],
        systematic_error=[0.01, 0.01, 0.03, -0.01, 0.01, 0.05, 0.0],
        yaw_var=[1e-4, 4e-4, 1e-3, 2e-4, 4e-4, 1e-2, 1.0],
        systematic_var=[1e-4, 1e-4, 1e-3, 1e-4, 2e-4, 1e-3, 1.0],
    )
    one, six = honesty_rows([epochs])
    assert (one["state"], one["hop"], one["count"]) == ("at rest", 1, 4)
    assert (six["hop"], six["count"]) == (6, 2)
    random = np.array([0.01, 0.03, 0.02, -0.04])
    assert one["yaw_rms_deg"] == pytest.approx(math.degrees(math.sqrt(np.mean(random**2))))
    runs = [np.mean([0.01**2 / 1e-4, 0.03**2 / 4e-4]), np.mean([0.02**2 / 2e-4, 0.04**2 / 4e-4])]
    half = 1.96 * np.std(runs, ddof=1) / math.sqrt(2.0)
    assert one["nees"] == pytest.approx(np.mean(runs))
    assert (one["nees_low"], one["nees_high"]) == pytest.approx((np.mean(runs) - half, np.mean(runs) + half), rel=1e-3)
    total = [[0.02**2 / 2e-4, 0.04**2 / 5e-4], [0.01**2 / 3e-4, 0.03**2 / 6e-4]]
    assert one["nees_total"] == pytest.approx(np.mean([np.mean(run) for run in total]))
    assert six["nees"] == pytest.approx(np.mean([0.06**2 / 1e-3, 0.15**2 / 1e-2]))
    assert one["inside_95_percent"] == 100.0
    assert six["inside_95_percent"] == pytest.approx(50.0)  # (0.09^2 / 0.002, 0.2^2 / 0.011) against 1.96^2


def test_accuracy_is_depth_by_depth_and_without_yaws_that_are_not_trusted() -> None:
    surveys = columns(
        run=[1, 1, 2, 2, 2],
        md=[2.0, 4.0, 2.0004, 4.0, 4.0],
        trusted=[True, True, True, False, True],
        inclination_error=[0.01, 0.02, 0.03, 0.04, 0.05],
        azimuth_error=[0.1, 0.2, 0.3, 9.0, math.nan],
    )
    two, four = accuracy_rows([surveys])
    assert (two["md_m"], two["count"], two["untrusted"]) == (2.0, 2, 0)
    assert (four["md_m"], four["count"], four["untrusted"]) == (4.0, 3, 1)
    assert two["inclination_rms_deg"] == pytest.approx(math.degrees(math.sqrt((0.01**2 + 0.03**2) / 2)))
    assert four["inclination_rms_deg"] == pytest.approx(math.degrees(math.sqrt((0.02**2 + 0.04**2 + 0.05**2) / 3)))
    assert two["azimuth_rms_deg"] == pytest.approx(math.degrees(math.sqrt((0.1**2 + 0.3**2) / 2)))
    assert four["azimuth_rms_deg"] == pytest.approx(math.degrees(0.2))
    assert two["azimuth_low_deg"] < two["azimuth_rms_deg"] < two["azimuth_high_deg"]


class World:
    """Two tubes whose yaws, errors and stops are given; a bit that goes a metre every hundred seconds."""

    end = 400.0
    phases = tuple(
        SimpleNamespace(kind=kind, start=start, end=end, tube=tube)
        for kind, start, end, tube in (
            ("add", 0.0, 60.0, 1), ("drill", 60.0, 100.0, 1), ("stop", 100.0, 130.0, 1),
            ("add", 130.0, 200.0, 2), ("drill", 200.0, 300.0, 2), ("stop", 300.0, 330.0, 2),
        )
    )  # fmt: skip

    def yaw_truth(self, tube: int, at: float) -> float:
        return 7.0 * tube + 0.01 * at

    def systematic_error(self, tube: int, at: float) -> float:
        return 0.001 * tube + 1e-6 * at

    def bit_depth(self, t: float) -> float:
        return t / 100.0

    def truth_station(self, md: float) -> dict[str, float]:
        return {
            "md_m": md,
            "inclination_deg": 0.5 * md,
            "azimuth_deg": 179.0,
            "north_m": md,
            "east_m": 2 * md,
            "tvd_m": 3 * md,
            "more": 1.0,
        }


def measured(world: World, tube: int, at: float, off: float, hops: int) -> dict[str, Any]:
    yaw = math.degrees(world.yaw_truth(tube, at) + off) % 360.0
    return {
        "tube": tube,
        "station_at_s": at,
        "yaw_deg": yaw,
        "hops": hops,
        "sigma_yaw_deg": 0.3,
        "sigma_systematic_deg": 0.4,
    }


def test_errors_of_yaws_are_random_ones_by_hop_and_all_of_them_normalised() -> None:
    world: Any = World()
    rows = yaw_errors([measured(world, 1, 110.0, 0.02, 2), measured(world, 2, 310.0, -0.03, 1)], world)
    assert [row[0] for row in rows] == [2, 1]
    assert [row[1] for row in rows] == pytest.approx([0.02 - 0.00111, -0.03 - 0.00231])
    assert [row[2] for row in rows] == pytest.approx([off**2 / math.radians(0.5) ** 2 for off in (0.02, 0.03)])


def test_a_survey_is_of_a_stop_until_the_next_drilling_and_each_that_is_missing_is_named() -> None:
    world: Any = World()
    assert [(stop.start, until) for stop, until in stops_of(world)] == [(100.0, 200.0), (300.0, 400.0)]
    for at, misses in ((99.9, True), (100.0, False), (200.0, False), (200.1, True)):
        taken = [measured(world, 1, at, 0.0, 1), measured(world, 1, 350.0, 0.0, 1), measured(world, 2, 300.0, 0.0, 1)]
        assert missing_surveys(taken, world) == ([{"tube": 1, "bit_md_m": 1.3}] if misses else [])
    assert missing_surveys([], world) == [
        {"tube": 1, "bit_md_m": 1.3}, {"tube": 1, "bit_md_m": 3.3}, {"tube": 2, "bit_md_m": 3.3},
    ]  # fmt: skip


def stations(world: Any) -> list[dict[str, Any]]:
    served = []
    for k, md in enumerate((1.0, 4.0, 6.0)):
        row = {key: 0.125 * n + k for n, key in enumerate(STATION_KEYS)} | {
            "md_m": md,
            "azimuth_deg": -179.0 + k,
            "extra": 5,
        }
        served.append(
            row
            | {
                "inclination_deg": 0.5 * md + 0.1 * (k + 1),
                "north_m": md + 0.3,
                "east_m": 2 * md + 0.4,
                "tvd_m": 3 * md,
            }
        )
    return station_table(served, world)


def test_figures_of_merit_are_root_mean_squares_beside_the_truth(tmp_path: Path) -> None:
    world: Any = World()
    rows = stations(world)
    assert all(set(row) == {*STATION_KEYS, "truth"} and set(row["truth"]) == set(TRUTH_KEYS) for row in rows)
    taken = [
        measured(world, 1, 110.0, 0.02, 2),
        measured(world, 2, 310.0, -0.03, 1),
        measured(world, 1, 310.0, 0.05, 2),
    ]
    figures = figures_of_merit(rows, taken, world)
    assert figures["inclination_rms_deg"] == pytest.approx(math.sqrt((0.01 + 0.04 + 0.09) / 3))
    assert figures["azimuth_rms_deg"] == pytest.approx(
        math.sqrt((3.0**2 + 4.0**2) / 2)
    )  # the first leans by half a degree
    assert figures["toe_error_m"] == pytest.approx(0.5)
    assert figures["yaw_rms_deg_by_hop"][0] == pytest.approx(math.degrees(0.03231))
    assert figures["yaw_rms_deg_by_hop"][1] == pytest.approx(
        math.degrees(math.hypot(0.01889, 0.05 - 0.00131) / math.sqrt(2))
    )
    assert figures["nees_by_hop"] == pytest.approx(
        [0.03**2 / math.radians(0.5) ** 2, (0.02**2 + 0.05**2) / 2 / math.radians(0.5) ** 2]
    )
    assert figures_of_merit([], [], world) == {
        "azimuth_rms_deg": None, "inclination_rms_deg": None, "toe_error_m": None,
        "yaw_rms_deg_by_hop": [], "nees_by_hop": [],
    }  # fmt: skip
    write_files(tmp_path, {"stations": rows, "figures": figures})
    table = list(csv.DictReader((tmp_path / "stations.csv").read_text().splitlines()))
    for line, row in zip(table, rows, strict=True):
        assert {key: float(line[key]) for key in STATION_KEYS} == {key: row[key] for key in STATION_KEYS}
        assert {key: float(line[f"truth_{key}"]) for key in TRUTH_KEYS} == row["truth"]
    assert json.loads((tmp_path / "result.json").read_text()) == {"stations": rows, "figures": figures}
    assert sorted(file.name for file in tmp_path.iterdir()) == ["result.json", "stations.csv"]


def test_a_digest_is_of_every_bit_of_every_number_in_its_place() -> None:
    rows = stations(World())
    exact = (
        "["
        + ", ".join("[" + ", ".join(f'"{float(row[key]).hex()}"' for key in STATION_KEYS) + "]" for row in rows)
        + "]"
    )
    assert station_digest(rows) == hashlib.sha256(exact.encode()).hexdigest()


@pytest.mark.parametrize(
    ("angle", "wrapped"), [(180.0, 180.0), (-180.0, 180.0), (181.0, -179.0), (-540.0, 180.0), (359.0, -1.0), (0.0, 0.0)]
)
def test_an_angle_lies_beyond_minus_180_up_to_180(angle: float, wrapped: float) -> None:
    assert wrap_deg(angle) == wrapped


def test_a_root_mean_square_of_nothing_is_none() -> None:
    assert root_mean_square([]) is None
    assert root_mean_square([3.0, -4.0]) == pytest.approx(math.sqrt(12.5))
