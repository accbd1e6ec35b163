"""Rigs under keys: over TLS with a node cut off, and with keys that change in the middle of a hole."""

from __future__ import annotations

import datetime
from pathlib import Path

from rigs import REPOSITORY, free_endpoint, running_rig

from borechain.drilling.inline import InlineRig
from borechain.pki.rig_keys import add_tube, init_rig, rotate_keys
from sim.rig.ground_settings import ground_settings
from sim.rig.rig_progress import RigProgress
from sim.rig.rig_result import rig_result
from sim.world.scenario import load_scenario
from sim.world.world import World
from telemetry.messages import BASE, ENCODER, DepthReading, Side, SurveyMeasurement
from telemetry.presentation.msgpack_codec import encode_message


def make_keys(folder: Path) -> Path:
    now = datetime.datetime.now(datetime.UTC)
    init_rig(folder, "rig-1", now)
    for tube in (1, 2, 3):
        add_tube(folder, tube, now)
    return folder


def seal_alarms(rows: list[dict[str, object]]) -> list[dict[str, object]]:
    return [row for row in rows if row["code"] in ("seal_refused", "key_file")]


def test_a_rig_over_tls_survives_the_power_cut_of_a_node(tmp_path: Path) -> None:
    keys, endpoint = make_keys(tmp_path / "stick"), free_endpoint().replace("tcp/", "tls/")
    words = ("--keys", str(keys), "--endpoint", endpoint, "--fault", "kill-node:2@240+20")
    with running_rig(tmp_path, *words) as rig:
        result = rig.result()
    assert [s["measurements"] for s in result["stations"]] == [3, 2, 1]
    assert result["missing"] == []
    assert seal_alarms(result["rig_alarms"]) == []
    held = "".join(path.read_text(errors="replace") for path in rig.out.rglob("*") if path.is_file())
    secrets = [line.split('"')[-2] for line in (keys / "tube-2.keys").read_text().splitlines() if line.endswith('"')]
    assert not any(secret in held for secret in secrets if len(secret) >= 32)


def test_keys_change_in_the_middle_of_a_hole_and_forgers_come_and_no_survey_is_lost(tmp_path: Path) -> None:
    keys = make_keys(tmp_path / "stick")
    world = World(load_scenario(REPOSITORY / "scenarios" / "rig-3.toml", ()), 1)
    middle = 0.5 * (world.begin + world.end)
    changed: list[float] = []

    def change(progress: RigProgress) -> None:
        if not changed and progress.rig_time > middle:
            changed.append(progress.rig_time)
            rotate_keys(keys, datetime.datetime.now(datetime.UTC))
        if len(changed) == 1 and progress.rig_time > middle + 20.0:
            changed.append(progress.rig_time)
            for address in (BASE, ENCODER, 2):
                now = world.local_clock(address, progress.rig_time)
                for frame in (b"\x01" * 60, b"\x00" * 60):
                    rig.stepper.processes[address].on_frame(Side.LOWER, frame, now)
            now = world.local_clock(BASE, progress.rig_time)
            rig.stepper.processes[BASE].on_depth(encode_message(DepthReading(10**9, progress.rig_time, 0.0, ())), now)

    rig = InlineRig(world, ground_settings(world), "rig-1", tmp_path, keys=keys)
    try:
        rig.run(change)
        result = rig_result({path: rig.ask(path) for path in ("stations", "measurements", "column", "alarms")}, world)
        stored = [one.message for one in rig.ground.store.messages()]
        processes = rig.stepper.processes
        newest = {a: processes[a].endpoint.seals.ring.newest for a in (BASE, ENCODER, 1, 2, 3)}  # type: ignore[union-attr]
    finally:
        rig.close()
    assert len(changed) == 2
    assert set(newest.values()) == {2}
    assert result["missing"] == []
    assert result["measurements"] == 6
    assert sum(isinstance(message, SurveyMeasurement) for message in stored) == 6
    told = {row["subject"]: str(row["detail"]) for row in seal_alarms(result["rig_alarms"])}
    assert told.keys() == {"ground station", "encoder", "tube 2"}
    assert told["ground station"].startswith("3 refused")
    assert told["encoder"].startswith("2 refused")
