"""Campaigns: the world of a rig by other draws, the nodes of a rig bit for bit, a folder that is whole."""

import math
import os
import pickle
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from given_inputs import CYCLE, GIVEN, HEARD, count_other_answers
from hypothesis import given
from hypothesis import strategies as st
from node_by_node import drill_node_by_node

from node.firmware.tube import Tube
from node.kernels.record.node_record import AIDING, MOMENT, READING
from node.kernels.step.address import firmware_addresses
from sim.campaign import engine
from sim.campaign.campaign_folder import MANIFEST, Folder
from sim.campaign.campaign_run import run_campaign
from sim.campaign.chunk import RUNS, Campaign, run_chunk, scenario_digest
from sim.campaign.summary import OverRuns, Sum, honesty_rows
from sim.errors import RigError, ScenarioError
from sim.string.direct_string import DirectString
from sim.string.drawn_string import frames_of
from sim.world.disturbance.records import make_shared, make_tubes
from sim.world.disturbance.sensor_reading import DRAWN, read_sensors
from sim.world.scenario import Scenario, load_scenario, scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow
QUIET_GYRO = {"noise_dps_rthz": (0.0, 0.0, 0.0), "bias_std_dps": (0.0, 0.0, 0.0), "resolution_dps": 0.0}
QUIET_FORCE = {"noise_deg": 0.0, "vibration_mps2": 0.0}


def scenario(**changed: dict[str, Any]) -> Scenario:
    """Three tubes added one by one, five turns each, with every table open to change."""
    usual: dict[str, Any] = {
        "rig": {"tubes": 3, "tube_length_m": 2.0},
        "path": {"straight": {"inclination_deg": 20.0, "azimuth_deg": 35.0}},
        "schedule": {"add_s": 58.0, "stop_s": 32.0, "finish_s": 5.0},
        "rotation": {"turns": 5.0},
        "accelerometer": {"bias_std_deg": 0.002},
        "medium": {"link": "off"},
    }
    return scenario_of({name: usual.get(name, {}) | changed.get(name, {}) for name in usual | changed})


def test_without_noise_every_sensor_reads_what_it_reads_in_the_world_of_a_rig() -> None:
    quiet = scenario(gyroscope=QUIET_GYRO | {"misalignment_std_deg": 0.3}, accelerometer=QUIET_FORCE)
    world, made = World(quiet, 5), Campaign(quiet)
    shared, reading, drawn = make_shared(quiet.file)[0], np.zeros((1, READING)), np.zeros(DRAWN)
    tubes, powered = make_tubes(quiet.file, 5, frames_of(world)), made.string.schedule.powered
    for tube in (1, 2, 3):
        samples = world.sensors.samples(tube)
        for cycle in np.flatnonzero(powered >= tube)[::7].tolist():
            felt, end = made.string.felt, float(world.ends[cycle])
            read_sensors(shared, tubes[tube - 1], False, *felt, drawn, reading, end, int(cycle), tube - 1)
            assert np.allclose(reading[0, :6], samples[cycle], rtol=0.0, atol=2e-9), (tube, cycle)


def test_what_a_rig_gives_its_nodes_gives_the_same_nodes_here_bit_for_bit() -> None:
    string = DirectString(World(scenario(), 2))
    heard = Listener()
    for place, tube in enumerate(string.tubes.values()):
        heard.listen(tube, place)
    before = string.nodes.copy()
    drill_node_by_node(string)
    rows = np.array(heard.rows, GIVEN)
    assert {CYCLE, HEARD} == set(rows["kind"].tolist())
    crews, corrections = zip(
        *((tube._settings_record, tube._corrections) for tube in string.tubes.values()), strict=True
    )
    again = before.copy()
    taken = (np.array(heard.readings), np.array(heard.moments), np.array(heard.aidings))
    tables = (np.concatenate(crews), np.stack(corrections))
    assert count_other_answers(*firmware_addresses(), again, *tables, rows, *taken) == 0
    assert same_bits(again, string.nodes)
    assert not same_bits(again, before)


def same_bits(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether all fields are the same bit for bit; padding between two of them is ignored."""
    if one.dtype.names is None:
        return one.tobytes() == other.tobytes()
    return all(same_bits(one[name], other[name]) for name in one.dtype.names)


class Listener:
    """What the nodes of a string were given and what they answered, in the order of it."""

    def __init__(self) -> None:
        self.rows: list[tuple[int, int, int]] = []
        self.readings: list[np.ndarray] = []
        self.moments: list[np.ndarray] = []
        self.aidings: list[np.ndarray] = []

    def keep(self, kind: int, place: int, answer: int, *given: np.ndarray) -> int:
        self.rows.append((kind, place, answer))
        empty = (np.zeros((1, READING)), np.zeros(MOMENT), np.zeros(AIDING))
        reading, moment, aiding = (*given, empty[2]) if kind == CYCLE else (*empty[:2], *given)
        self.readings.append(reading)
        self.moments.append(moment)
        self.aidings.append(aiding)
        return answer

    def listen(self, tube: Tube, place: int) -> None:
        """Stand between a tube and its firmware."""
        loop = tube._loop

        def step(nodes: Any, crews: Any, corrections: Any, readings: Any, moment: Any) -> int:
            given = (readings.copy(), moment.copy())
            return self.keep(CYCLE, place, int(loop.step(nodes, crews, corrections, readings, moment)), *given)

        def aiding(nodes: Any, crews: Any, taken: Any) -> int:
            given = taken.copy()
            return self.keep(HEARD, place, int(loop.aiding(nodes, crews, taken)), given)

        tube._loop = loop._replace(step=step, aiding=aiding)


def test_a_run_depends_on_its_seed_alone() -> None:
    pickled = pickle.dumps(scenario())
    alone = run_chunk(pickled, 7, 7)
    among = run_chunk(pickled, 5, 8)
    for name, values in alone.surveys.items():
        of_run = among.surveys[name][among.surveys["run"] == 7]
        assert np.array_equal(values, of_run, equal_nan=values.dtype.kind == "f"), name
    assert len(np.unique(among.surveys["yaw_error"])) == len(among.surveys["yaw_error"])


def test_every_stop_is_surveyed_and_the_nodes_are_honest() -> None:
    chunk = Campaign(scenario()).chunk(1, 40)
    surveys = chunk.surveys
    assert len(surveys["run"]) == 40 * (1 + 2 + 3)
    assert np.unique(np.round(surveys["md"], 3)).tolist() == [2.0, 4.0, 6.0]
    assert np.degrees(np.sqrt(np.mean(surveys["inclination_error"] ** 2))) < 0.01
    assert np.all(surveys["trusted"])
    for row in honesty_rows([chunk.epochs]):
        assert row["nees_low"] < 1.4, row
        assert row["nees_high"] > 0.6, row


def test_errors_are_distributed_as_those_of_the_string_of_the_studies() -> None:
    from scipy.stats import ks_2samp

    of_campaign = Campaign(scenario()).chunk(101, 180).surveys
    normed = of_campaign["yaw_error"] / np.sqrt(of_campaign["yaw_var"] + of_campaign["systematic_var"])
    of_string = []
    for seed in range(1, 31):
        for survey in DirectString(World(scenario(), seed)).drill().surveys:
            m = survey.measurement
            of_string.append(survey.error / np.sqrt(m.yaw_var + m.systematic_var))
    assert ks_2samp(normed, of_string).pvalue > 0.01
    spread = np.sqrt(of_campaign["yaw_var"])
    assert abs(np.median(spread) - np.median([np.sqrt(s.measurement.yaw_var) for s in [survey]])) < 0.2 * np.median(
        spread
    )


@pytest.mark.parametrize(
    ("changed", "key"),
    [
        ({"torsion": {}}, "torsion"),
        ({"node": {"imus": 4}}, "node.imus"),
        ({"node": {"kernel": "fixed"}}, "node.kernel"),
        ({"encoder": {"phase": "random"}}, "encoder.phase"),
        ({"joints": {"unseen_std_deg": 0.1}}, "joints.unseen_std_deg"),
    ],
)
def test_what_a_campaign_cannot_express_names_the_rig(changed: dict[str, Any], key: str) -> None:
    with pytest.raises(ScenarioError, match=rf"{key}.*borechain rig"):
        Campaign(scenario(**changed))


def test_a_campaign_cut_off_goes_on_and_equals_the_uninterrupted_bit_for_bit(tmp_path: Path) -> None:
    one = scenario()
    asked = {"name": "three", "first": 1, "runs": RUNS + 6, "engine": "local", "scheduler": None}
    whole = run_campaign(one, path=tmp_path / "whole", step=nothing, **asked)
    cut = run_campaign(one, path=tmp_path / "cut", step=nothing, **asked | {"runs": 5})
    assert cut["computed"] == 5
    (tmp_path / "cut" / "surveys-00000006-00000064.parquet").write_bytes(b"half")  # its epochs were never renamed
    resumed = run_campaign(one, path=tmp_path / "cut", step=nothing, **asked)
    assert resumed["computed"] == RUNS + 1
    assert {k: v for k, v in resumed.items() if k != "computed"} == {k: v for k, v in whole.items() if k != "computed"}
    for table in ("surveys", "epochs"):
        folders = [Folder(tmp_path / f, "three", scenario_digest(one)) for f in ("whole", "cut")]
        kept, again = (list(folder.read(table, 1, RUNS + 6)) for folder in folders)
        for name in kept[0]:
            assert (
                np.concatenate([c[name] for c in kept]).tobytes() == np.concatenate([c[name] for c in again]).tobytes()
            )
    table_kept = pq.read_table(next((tmp_path / "whole").glob("surveys-*.parquet")))
    assert all(field.metadata[b"description"] for field in table_kept.schema)
    assert run_campaign(one, path=tmp_path / "cut", step=nothing, **asked)["computed"] == 0


def nothing() -> None:
    """Ignore the progress."""


def test_a_folder_of_another_campaign_is_refused_by_what_differs(tmp_path: Path) -> None:
    Folder(tmp_path, "three", "0123")
    with pytest.raises(RigError, match="scenario_digest '0123', not '4567'"):
        Folder(tmp_path, "three", "4567")
    (tmp_path / MANIFEST).write_text("{")
    with pytest.raises(RigError, match=MANIFEST):
        Folder(tmp_path, "three", "0123")
    (tmp_path / MANIFEST).unlink()
    (tmp_path / "other.parquet").touch()
    with pytest.raises(RigError, match="holds tables but no"):
        Folder(tmp_path, "three", "0123")


def test_what_is_missing_ends_at_whole_chunks_and_skips_what_is_there(tmp_path: Path) -> None:
    folder = Folder(tmp_path, "three", "0123")
    assert folder.missing(1, 130) == [(1, 64), (65, 128), (129, 130)]
    for name in ("00000003-00000005", "00000065-00000128"):
        (tmp_path / f"epochs-{name}.parquet").touch()
    assert folder.missing(1, 130) == [(1, 2), (6, 64), (129, 130)]
    assert folder.missing(4, 66) == [(6, 64)]


def test_a_full_disk_keeps_the_chunks_before_and_says_so(tmp_path: Path) -> None:
    folder = Folder(tmp_path, "three", "0123")
    chunk = Campaign(scenario()).chunk(1, 1)
    folder.keep(1, 1, chunk)
    blocked = tmp_path / "surveys-00000002-00000002.parquet"
    blocked.mkdir()  # what cannot be replaced stands for a disk that is full
    with pytest.raises(RigError, match="chunks before it are kept"):
        folder.keep(2, 2, chunk)
    assert list(folder.chunks()) == [(1, 1)]
    assert not list(tmp_path.glob(".*tmp"))


def test_an_interval_is_over_runs_not_over_rows_and_not_over_chunks() -> None:
    run = np.repeat([1, 2, 3, 4], 100)
    values = np.repeat([1.1, 2.2, 3.3, 4.4], 100)
    whole, parts = OverRuns(), OverRuns()
    whole.add(run, values)
    for k in (3, 1, 4, 2):
        parts.add(run[run == k], values[run == k])
    assert whole.interval == parts.interval
    assert (whole.rows, whole.runs) == (400, 4)
    mean, low, high = whole.interval
    assert mean == pytest.approx(2.75)
    assert high - low == pytest.approx(2 * 1.96 * np.std([1.1, 2.2, 3.3, 4.4], ddof=1) / 2.0, rel=1e-4)


@given(st.lists(st.floats(-1e200, 1e200), max_size=50))
def test_a_sum_is_exact(values: list[float]) -> None:
    total = Sum()
    for value in values:
        total.add(value)
    assert total.value == math.fsum(values)


def test_dask_gives_the_same_rows_and_does_again_what_a_killed_worker_had_begun(tmp_path: Path) -> None:
    from distributed import Client, LocalCluster

    one = scenario()
    asked = {"name": "three", "first": 1, "runs": 2 * RUNS + 3}
    here = run_campaign(one, path=tmp_path / "here", engine="local", scheduler=None, step=nothing, **asked)
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        pids = client.run(os.getpid)
        killed: list[int] = []

        def step() -> None:
            if not killed:
                killed.append(next(iter(pids.values())))
                os.kill(killed[0], signal.SIGKILL)

        address = cluster.scheduler_address
        there = run_campaign(one, path=tmp_path / "there", engine="dask", scheduler=address, step=step, **asked)
    assert killed
    assert there == here


def test_a_cluster_that_is_not_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "CONNECT_TIMEOUT", 0.5)
    with pytest.raises(RigError, match=r"tcp://127.0.0.1:1: expected a dask scheduler"):
        list(engine.compute_chunks(pickle.dumps(scenario()), [(1, 1)], "dask", "tcp://127.0.0.1:1"))


def test_the_scenarios_of_the_program_that_a_campaign_can_express() -> None:
    assert Campaign(load_scenario(Path("wellbore-1"))).node_cycles == 20806
    with pytest.raises(ScenarioError, match="torsion"):
        Campaign(load_scenario(Path("torsion-10")))
