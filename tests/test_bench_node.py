"""The node's benchmark: the cycle written again in C says what ours says; peers and compiler may be missing."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import shutil
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from borechain.cli.bench.bench import bench
from borechain.cli.faults import EnvironmentFault
from node.kernels.record.filter_record import CycleStatus, default_config, new_state

pytestmark = pytest.mark.slow

COUNT = 2.0 * np.pi / 2.0**32  # rad
SOURCE = Path(__file__).parents[1] / "benchmarks" / "node.py"
BETWEEN_CYCLES = ("bias", "scale", "stamp", "down", "P", "now_P", "now_down", "survey_force", "survey_force_cov")

needs_compiler = pytest.mark.skipif(
    shutil.which(shlex.split(os.environ.get("CC") or "cc")[0]) is None, reason="no C compiler here"
)


@pytest.fixture(scope="module")
def node() -> ModuleType:
    spec = importlib.util.spec_from_file_location("benchmarks_node", SOURCE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def recording(node: ModuleType) -> Any:
    return node.record_inputs()


@pytest.fixture(scope="module", params=["every product rounded", "fused products"])
def in_c(node: ModuleType, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    exact = request.param == "every product rounded"
    run_c = node.build_c(tmp_path_factory.mktemp("c"), *((node.UNFUSED,) if exact else ()))
    # the binary yaw is rounded every cycle: another last bit before it may be another count after it
    return run_c, *((0.9, 1e-10) if exact else (8.5, 1e-8))


def assert_same(node: ModuleType, in_c: Any, inputs: Any, config: Any, state: Any) -> Any:
    """Both take the inputs; returns the status bits that came."""
    run_c, counts, relative = in_c
    ours, theirs = (new_state(config) for _ in range(2))
    our_out, their_out = (np.zeros(len(inputs), node.OUTPUT) for _ in range(2))
    node.run_compiled(state, ours, config, inputs, our_out, 2)
    run_c(state, theirs, config, inputs, their_out, 2)
    np.testing.assert_array_equal(our_out["status"], their_out["status"])
    off = (our_out["yaw"] - their_out["yaw"]).astype(np.int32)
    assert np.abs(off).max() <= counts, f"yaw {np.abs(off).max() * COUNT} rad"
    np.testing.assert_allclose(our_out["var"], their_out["var"], rtol=relative, atol=0.0)
    for name in node.STATE.names:
        ours_is, theirs_is = ours[0][name], theirs[0][name]
        if node.STATE[name].base.kind == "i":
            np.testing.assert_array_equal(ours_is, theirs_is, err_msg=name)
        elif name in BETWEEN_CYCLES:
            scale = max(float(np.abs(ours_is).max()), 1e-3 if name == "stamp" else 1e-6)
            np.testing.assert_allclose(ours_is, theirs_is, rtol=0.0, atol=relative * scale, err_msg=name)
    return CycleStatus(int(np.bitwise_or.reduce(our_out["status"])))


@needs_compiler
def test_c_and_ours_agree_over_the_whole_bore(node: ModuleType, in_c: Any, recording: Any) -> None:
    config = default_config()
    seen = assert_same(node, in_c, recording, config, new_state(config))
    assert len(recording) > 3000
    everyday = (
        CycleStatus.BIAS_KNOWN
        | CycleStatus.STARTED
        | CycleStatus.STOPPED
        | CycleStatus.SURVEY_READY
        | CycleStatus.AIDED
    )
    joints = CycleStatus.JOINT_OPENED | CycleStatus.JOINT_CLOSED | CycleStatus.REFERENCE_CHANGED
    assert everyday | joints in seen


def troubled(recording: Any) -> Any:
    """The recording with everything that may go wrong in it."""
    random = np.random.default_rng(3)
    inputs = np.delete(recording, slice(600, 606))  # cycles lost while turning
    inputs["rate"][20, 2] = 0.5  # moved while it learnt its bias
    inputs["rate"][400, 1] = np.nan
    inputs["force"][401, 0] = np.inf
    inputs["rate"][900:903, 2] = 6.5
    inputs["yaw"][1250:1258] += 0.5  # for so long that the filter gives in
    inputs["yaw"][1300::97] += 0.3
    inputs["valid_at"][1350:1370] -= 1.0  # late by two cycles
    inputs["valid_at"][1380:1384] -= 60.0  # beyond the ring
    inputs["valid_at"][1390:1394] += [1.5, 1.0, 0.5, 0.0]  # early, and out of turn
    inputs["aided"][random.random(len(inputs)) < 0.3] = 0
    inputs["hops"][2000:2500] += 3
    inputs["offset"][2500:] += 0.01
    return inputs


@needs_compiler
@pytest.mark.parametrize(
    "change", [{}, {"stamp_std": 0.0, "scale_std": 0.0}, {"lag_cycles": 3, "attitude_factor": 2.0}]
)
def test_they_agree_when_things_go_wrong(node: ModuleType, in_c: Any, recording: Any, change: dict) -> None:
    config = default_config()
    for name, value in change.items():
        config[name] = value
    seen = assert_same(node, in_c, troubled(recording), config, new_state(config))
    assert (
        CycleStatus.BAD_SAMPLE | CycleStatus.RATE_EXCEEDED | CycleStatus.RATE_RECOVERED | CycleStatus.LATE_DROPPED
        in seen
    )
    assert CycleStatus.REJECTED | CycleStatus.YAW_RESET in seen


@needs_compiler
def test_both_see_a_broken_covariance(node: ModuleType, in_c: Any, recording: Any) -> None:
    config = default_config()
    state = new_state(config)
    state["P"][0, 2, 2] = -1.0
    assert CycleStatus.FILTER_FAULT in assert_same(node, in_c, recording[:3], config, state)


@needs_compiler
def test_a_record_laid_out_differently_is_refused(
    node: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(node, "LAYOUTS", (node.CONFIG, *node.LAYOUTS[1:]))
    with pytest.raises(EnvironmentFault, match="laid out differently"):
        node.build_c(tmp_path)


def test_fixed_point_is_measured_on_the_same_recording(node: ModuleType, recording: Any) -> None:
    run_fixed = node.fixed_runner()
    if run_fixed is None:
        pytest.skip("no fixed-point kernels here")
    stretch = node.Stretch(recording, 0, len(recording))
    fixed = node.FixedStretch(stretch)
    stretch.seconds(node.run_compiled)
    fixed.seconds(run_fixed)
    known = np.maximum.accumulate(stretch.outputs["status"] & CycleStatus.AIDED) > 0
    off = (fixed.outputs["yaw"] - stretch.outputs["yaw"]).astype(np.int32)[known] * COUNT
    assert np.abs(off).max() < np.radians(0.03)


@pytest.mark.parametrize(("compiler", "says"), [("no-such-cc", "no 'no-such-cc'"), ("false", "false cannot compile")])
def test_without_a_compiler_it_says_so(
    node: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiler: str, says: str
) -> None:
    monkeypatch.setenv("CC", compiler)
    with pytest.raises(EnvironmentFault, match=says):
        node.build_c(tmp_path)


@pytest.mark.parametrize("peer", ["filterpy", "imufusion"])
def test_a_missing_peer_is_one_line(monkeypatch: pytest.MonkeyPatch, peer: str) -> None:
    for other in {"filterpy", "imufusion"} - {peer}:
        pytest.importorskip(other)
    monkeypatch.setitem(sys.modules, peer, None)
    done = CliRunner().invoke(bench, ["node"])
    assert done.exit_code == 1
    assert len(done.output.strip().splitlines()) == 1
    assert re.match(rf"Error: bench node needs {peer}(\.kalman)?; install the development", done.output)


@needs_compiler
@pytest.mark.statistical
def test_every_pair_is_measured(node: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("filterpy")
    pytest.importorskip("imufusion")
    monkeypatch.setattr(node, "BLOCKS", 1)
    monkeypatch.setattr(node, "PASSES", 1)
    found = node.run()
    assert found["bench"] == "node"
    assert len(found["ratios"]) >= 11
    for row in found["ratios"].values():
        assert row["ratio"] == pytest.approx(row["peer"] / row["ours"])
        assert row["ours"] > 0.0
    assert found["ratios"]["one prediction, one update, against filterpy"]["ratio"] > 10.0
