"""Who starts processes takes them along; a frozen one is ended and told; a rig has one ground station."""

import os
import resource
import signal
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest
from rigs import Rig, ends, free_endpoint, run, running_rig, titles_of_group

from groundstation.errors import LeaseError
from groundstation.gateway.lease import RigLease
from sim.errors import RigError
from sim.rig.launcher import Tick, Watchdog
from sim.rig.processes import RESTART_LIMIT, ProcessTable
from telemetry.media.zenoh_bus import ZenohBus, open_client, open_router

pytestmark = pytest.mark.process


def test_a_launcher_that_is_killed_leaves_nothing_behind(tmp_path: Path) -> None:
    expected = {"borechain medium", "borechain encoder", "borechain ground", "borechain node 1"}
    with running_rig(tmp_path, "--speed", "20") as rig:
        rig.until(lambda: expected <= set(titles_of_group(rig.process.pid).values()))
        os.kill(rig.process.pid, signal.SIGKILL)
        rig.process.wait()
        assert ends(rig.process.pid)


def test_a_node_that_is_frozen_is_ended_started_again_and_told(tmp_path: Path, ask: Any) -> None:
    with running_rig(tmp_path, "--speed", "20") as rig:
        rig.until(lambda: (ask(rig, "borechain/*/ground/status") or {}).get("measurements"))
        os.kill(rig.pid_of("borechain node 1"), signal.SIGSTOP)
        result = rig.result()
    assert result["restarts"] >= 1
    assert result["measurements"] == 6


def test_a_ground_station_on_a_full_disk_stays_readable_says_so_and_loses_no_survey(tmp_path: Path, ask: Any) -> None:
    """A quota of the system stands for the full disk: the file can be written to and takes no byte more."""

    def is_told(rig: Rig) -> bool:
        return "disk" in {row["code"] for row in ask(rig, "borechain/*/ground/alarms")["rig"]}

    with running_rig(tmp_path, "--speed", "20") as rig:
        rig.until(lambda: (ask(rig, "borechain/*/ground/status") or {}).get("measurements"))
        ground = rig.pid_of("borechain ground")
        before = resource.prlimit(ground, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        rig.until(lambda: is_told(rig))
        assert ask(rig, "borechain/*/ground/stations")["stations"]
        resource.prlimit(ground, resource.RLIMIT_FSIZE, before)
        rig.until(lambda: not is_told(rig))
        result = rig.result()
    assert result["restarts"] == 0
    assert result["measurements"] == 6


def fresh() -> AbstractContextManager[ZenohBus]:
    raise AssertionError("a lease that does not lapse is not looked into")


def test_a_second_ground_station_is_refused_by_name(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    with open_router(endpoint), open_client(endpoint, timeout=20.0) as first:
        RigLease(first, "rig-1", fresh)
        second = run("ground", "--clock", "own", "--endpoint", endpoint, "--folder", str(tmp_path / "second"))
        assert second.returncode == 1
        assert f"rig rig-1: process {os.getpid()} on " in second.stderr
        assert len(second.stderr.strip().splitlines()) == 1
        with open_client(endpoint, timeout=20.0) as other:
            RigLease(other, "rig-2", fresh)


def test_a_lease_ends_with_its_holder(monkeypatch: pytest.MonkeyPatch) -> None:
    endpoint = free_endpoint()
    with open_router(endpoint), open_client(endpoint, timeout=20.0) as second:
        with open_client(endpoint, timeout=20.0) as first:
            RigLease(first, "rig-1", fresh)
            with monkeypatch.context() as hasty:
                hasty.setattr("groundstation.gateway.lease.PATIENCE", 0.0)
                with pytest.raises(LeaseError, match="rig rig-1"):
                    RigLease(second, "rig-1", fresh)
        RigLease(second, "rig-1", fresh)


def test_a_rig_whose_time_stands_still_is_ended_with_what_it_waits_for() -> None:
    watchdog = Watchdog(0.0)
    watchdog.on_tick(Tick("drill tube 2", 1012.5, 1000.0, 2000.0, ("encoder", "base", "2"), (), False, ""))
    with pytest.raises(RigError, match=r"stands at 1012.5 s \(drill tube 2\).* processes 2$"):
        watchdog.check(["encoder", "base"])
    patient = Watchdog(1e6)
    patient.check([])


def test_deaths_count_within_a_time_and_not_for_life(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr("sim.rig.processes.time.monotonic", lambda: now)
    table = ProcessTable({}, [])
    for _ in range(4 * RESTART_LIMIT):
        now += 300.0
        table._count_death("3", "ended with status 1")
    assert table.failures == []
    assert table.restarts["3"] == 4 * RESTART_LIMIT
    for _ in range(RESTART_LIMIT + 1):
        table._count_death("3", "ended with status 1")
    assert "process 3" in table.failures[0]
