"""A node that steps on an emulated chip beside one that steps in this process, and a rig of them."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from chip_tools import needs
from click.testing import CliRunner, Result
from one_node import node_of
from rough_node import RoughNode

from borechain.cli.rig.rig_command import rig
from node.firmware.chip_node import ChipError, ChipNode
from node.kernels.step.fixed_node import FixedNode

SCENARIOS = Path(__file__).parents[3] / "scenarios"
needs_compiler = needs("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi")
needs_emulator = needs("qemu-system-arm", "qemu-system-arm")


@needs_compiler
@needs_emulator
@pytest.mark.slow
def test_a_chip_does_what_the_host_does_and_shows_it() -> None:
    """Its float64 record too, with a change from outside between two cycles."""
    nodes = ChipNode(), FixedNode()
    rigs = [RoughNode(2, np.random.default_rng(4)) for _ in nodes]
    records = [node_of(2, 1, np.random.default_rng(4)) for _ in nodes]
    for k in range(250):
        said = []
        for node, rough, own in zip(nodes, rigs, records, strict=True):
            if k == 100:
                own[0]["filter"]["yaw_known"] = 0
            said.append(node.step(*own, *rough.step(k)))
            if k % 3:
                said[-1] += 1000 * node.aiding(*own[:2], rough.aiding(k))
        assert said[0] == said[1], k
        for name in ("filter", "guard", "events", "cluster"):
            assert records[0][0][name].tobytes() == records[1][0][name].tobytes(), (k, name)


@needs_compiler
@needs_emulator
@pytest.mark.slow
def test_a_chip_that_ends_is_told_and_leaves_nothing() -> None:
    node, records = ChipNode(), node_of(1, 0, np.random.default_rng(4))
    node._chip._process.kill()
    rough = RoughNode(1, np.random.default_rng(4))
    with pytest.raises(ChipError, match="the emulated chip: expected it to run, it has ended with status -9"):
        node.step(*records, *rough.step(0))
    ends = node._chip._to, node._chip._from
    node._chip._end()
    for end in ends:
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(end)


def drill(scenario: Path, *words: str | Path) -> Result:
    return CliRunner().invoke(rig, [str(scenario), "--inline", "--seed", "1", "--json", *map(str, words)])


@needs_compiler
@needs_emulator
@pytest.mark.statistical
@pytest.mark.timeout(900)
def test_a_rig_on_chips_has_the_digest_of_the_host(tmp_path: Path) -> None:
    shutil.copy(SCENARIOS / "wellbore-1-path.csv", tmp_path)
    fixed = tmp_path / "fixed.toml"
    fixed.write_text((SCENARIOS / "rig-3.toml").read_text() + '\n[node]\nkernel = "fixed"\n')
    host = drill(fixed, "--out", tmp_path / "host")
    chips = drill(SCENARIOS / "rig-3.toml", "--chip", "all", "--out", tmp_path / "chips")
    assert (host.exit_code, chips.exit_code) == (0, 0), host.output + chips.output
    assert json.loads(host.stdout)["digest"] == json.loads(chips.stdout)["digest"]


@pytest.mark.parametrize("chips", ["0", "4", "2,x", "every", "1,1"])
def test_tubes_that_the_string_has_not_are_refused(chips: str, tmp_path: Path) -> None:
    done = drill(SCENARIOS / "rig-3.toml", "--chip", chips, "--out", tmp_path / "run")
    assert done.exit_code != 0
    assert f"--chip {chips}: expected all, or numbers of tubes from 1 to 3 with commas" in done.output
    assert not (tmp_path / "run").exists()


def test_a_missing_emulator_is_named_with_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = drill(SCENARIOS / "rig-3.toml", "--chip", "2", "--out", tmp_path / "run")
    assert done.exit_code != 0
    assert "install Debian's gcc-arm-none-eabi" in done.output
    assert not (tmp_path / "run").exists()
