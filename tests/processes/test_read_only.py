"""Folders that become read-only under a running rig: remounted, in name spaces that the test makes."""

import os
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest
from rigs import Rig, running_rig

pytestmark = pytest.mark.process

APART = ("unshare", "--map-root-user", "--mount")


def refusal_of_name_spaces() -> str:
    """Why nothing can be mounted here, or empty."""
    if shutil.which("unshare") is None or shutil.which("nsenter") is None:
        return "no unshare or nsenter on this machine"
    tried = subprocess.run([*APART, "mount", "--bind", "/tmp", "/tmp"], capture_output=True, text=True, check=False)
    return tried.stderr.strip()


REFUSAL = refusal_of_name_spaces()


def mount(rig: Rig, *words: str | Path) -> None:
    """Mount something where the rig sees it, and no other process."""
    inside = ("nsenter", "--target", str(rig.process.pid), "--user", "--mount", "--preserve-credentials")
    subprocess.run([*inside, *words], check=True, timeout=60.0)


def make_read_only(rig: Rig, folder: Path) -> None:
    mount(rig, "mount", "--bind", folder, folder)
    mount(rig, "mount", "--options", "remount,bind,ro", folder)


def make_writable(rig: Rig, folder: Path) -> None:
    mount(rig, "mount", "--options", "remount,bind,rw", folder)


@pytest.mark.skipif(bool(REFUSAL), reason=f"needs a mount of its own: {REFUSAL}")
def test_read_only_folders_of_a_node_and_the_ground_station_are_told_and_lose_no_survey(
    tmp_path: Path, ask: Any
) -> None:
    def alarms() -> set[tuple[str, str]] | None:
        answer = ask(rig, "borechain/*/ground/alarms")
        return {(row["code"], row["subject"]) for row in answer["rig"]} if answer else None

    def has_measured() -> bool:
        return bool((ask(rig, "borechain/*/ground/status") or {}).get("measurements"))

    with running_rig(tmp_path, "--speed", "20", by=APART) as rig:
        rig.until(has_measured)
        told = {("tube_disk", "tube 1"), ("disk", "database")}
        node, ground = rig.out / "state" / "tube-1", rig.out / "state" / "ground"
        make_read_only(rig, node)
        make_read_only(rig, ground)
        os.kill(rig.pid_of("borechain ground"), signal.SIGKILL)
        rig.until(lambda: told <= (alarms() or set()))
        assert ask(rig, "borechain/*/ground/stations")["stations"]
        make_writable(rig, node)
        make_writable(rig, ground)
        result = rig.result()  # the end may come before a further question of the alarms: it tells those that are left
    assert told.isdisjoint((row["code"], row["subject"]) for row in result["rig_alarms"])
    assert result["restarts"] == 1
    assert result["measurements"] == 6
