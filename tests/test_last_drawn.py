"""What a set of drawn defects showed last: identifiers, nameless streams, titles, chips, yaws heard, cues of a rack."""

from __future__ import annotations

import socket
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import example, given
from hypothesis import strategies as st

from borechain.cli.calibrate.mwd import magnetometer, mwd
from borechain.cli.survey import survey_options
from borechain.cli.survey.survey_options import SurveyFiles
from groundstation.survey.adjustment.starting_point import _vars_of_turns
from node.process import tube_command
from sim.rig import realtime_run
from sim.rig.rack_operator import RackOperator
from sim.rig.realtime_run import HeardYaw, Surface
from sim.rig.stepper import Acted
from sim.world.scenario_file import CalibrationSection
from telemetry.media.can_identifier import PRIORITIES, Identifier
from telemetry.messages import NodeFlag, NodeMode, NodeState, Side
from telemetry.runtime.step_stream import StepListener


@given(bits=st.integers(0, (1 << 29) - 1))
@example((len(PRIORITIES) << 26) - 1)
@example(len(PRIORITIES) << 26)
@example((1 << 29) - 1)
def test_an_identifier_is_its_parts_or_of_none_of_our_priorities(bits: int) -> None:
    found = Identifier.unpack(bits)
    assert (found is None) is (bits >> 26 > 6)  # seven classes, 0 the most urgent
    if found is not None:
        assert found.pack() == bits
        assert (int(found.priority), found.type, found.part) == (bits >> 26, bits >> 21 & 31, bits & 31)
        assert (found.source, found.destination) == (bits >> 13 & 255, bits >> 5 & 255)


@pytest.mark.parametrize("said", [struct.pack(">I", 0), b"", struct.pack(">I", 1) + b"\xff"])
def test_who_says_no_name_is_not_joined(said: bytes, tmp_path: Path) -> None:
    joined: list[str] = []
    listener = StepListener(tmp_path / "s", lambda name, _: joined.append(name), lambda *_: None)
    with socket.socket(socket.AF_UNIX) as stranger:
        stranger.settimeout(5.0)
        stranger.connect(str(tmp_path / "s"))
        stranger.sendall(said)
        stranger.shutdown(socket.SHUT_WR)
        assert listener.wait(1.0)
        assert stranger.recv(1) == b""  # it is closed
    assert joined == []
    listener.close()


@pytest.mark.parametrize("command", [mwd, magnetometer])
def test_how_many_parameters_is_asked_for(command: click.Command) -> None:
    result = CliRunner().invoke(command, ["record.csv"])
    assert result.exit_code == 2
    assert "--parameters" in result.output


@pytest.mark.parametrize(
    ("name", "suffix", "needs"),
    [("plot", "svg", ["matplotlib"]), ("report", "pdf", ["matplotlib", "typst"]), ("out", "csv", [])],
)
def test_what_a_file_needs_is_asked_for_before_anything_is_computed(
    name: str, suffix: str, needs: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(survey_options, "check_installed", lambda *modules: asked.extend(modules))
    none = dict.fromkeys(("out", "by_source", "plot", "export_tool", "report"))
    SurveyFiles(**none | {name: Path(f"a.{suffix}")}).check(SimpleNamespace(programme=None))  # type: ignore[arg-type]
    assert asked == needs


@pytest.mark.parametrize(
    ("sources", "needs"),
    [
        ((), False),
        (("iio:a",), False),
        (("mpu6500:1",), True),
        (("iio:a", "mpu6500:1"), True),
        (("vn100:/dev/x",), False),
    ],
)
def test_one_chip_on_a_bus_needs_its_library(
    sources: tuple[str, ...], needs: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(tube_command, "check_installed", lambda *modules: asked.extend(modules))
    monkeypatch.setattr("node.process.node_host.run_node", lambda *given: asked.append(f"{len(given[2])} sources"))
    words = [word for source in sources for word in ("--imu", source)]
    result = CliRunner().invoke(tube_command.node, ["--tube", "3", *words], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert asked == [*(["smbus2"] if needs else []), f"{len(sources)} sources"]


def state(tube: int, at: float, yaw: float, flags: int = 0) -> NodeState:
    return NodeState(
        tube, at, 2, NodeMode.TRACKING, yaw, 4e-6, 1e-6, (0.01, 0.0, -0.01), 1e-3, 0.01, 9e-6, 2.0, 1e-8,
        NodeFlag(flags), 5, 0,
    )  # type: ignore[arg-type]  # fmt: skip


def test_a_yaw_is_compared_at_its_own_time_and_kept_by_whether_the_string_turned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[float, ...]] = []
    monkeypatch.setattr(realtime_run, "yaw_error", lambda _, *given: asked.append(given) or 0.25)
    monkeypatch.setattr(realtime_run, "fastest_at", lambda _, at: 2.0 if at > 50.0 else 0.0)
    heard = {1: HeardYaw()}
    coming = [
        state(1, 40.0, 1.5),
        state(1, 60.0, 1.75),
        state(2, 60.0, 1.0),
        state(1, 70.0, 2.0, NodeFlag.YAW_UNTRUSTED),
    ]
    surface: Any = SimpleNamespace(heard=heard, _world="world")
    surface.endpoint = SimpleNamespace(receive=lambda *_: [SimpleNamespace(message=one) for one in coming])
    Surface.on_frame(surface, Side.LOWER, b"", 1.0)
    assert asked == [(1, 1.5, 40.0), (1, 1.75, 60.0), (1, 2.0, 70.0)]
    assert (heard[1].states, heard[1].known) == (3, False)
    (resting,), (turning,) = heard[1].resting, heard[1].turning
    assert resting == (0.25, pytest.approx(4e-6))
    assert turning[1] == pytest.approx(4e-6 + 4.0 * coming[1].clock_var)


class Doors:
    """A ground station that is asked and ordered."""

    def __init__(self, shown: Any, answer: Any = "done") -> None:
        self.shown, self.answer, self.orders = shown, answer, list[Any]()

    def ask(self, path: str) -> Any:
        assert path == "recalibration"
        return self.shown

    def command(self, name: str, order: dict[str, str]) -> Any:
        self.orders.append((name, order))
        return self.answer


def test_an_operator_of_a_rack_does_what_each_cue_says() -> None:
    attitudes = tuple((10.0 * k, -5.0 * k) for k in range(9))
    operator = RackOperator(SimpleNamespace(section=CalibrationSection(attitudes_deg=attitudes, record_s=20.0)), 3)  # type: ignore[arg-type]
    known = {"rig_time_s": 1.0, "proposal": "abcd"}
    for cue, order in (
        ("begin", {"action": "begin", "tubes": "1,2,3"}),
        ("attitude 1", {"action": "attitude", "seconds": "20", "pitch_deg": "0", "roll_deg": "-0"}),
        ("attitude 3", {"action": "attitude", "seconds": "20", "pitch_deg": "20", "roll_deg": "-10"}),
        ("solve", {"action": "solve"}),
        ("confirm", {"action": "confirm", "proposal": "abcd"}),
    ):
        doors: Any = Doors(known)
        assert operator.act_on_cue(doors, cue) is Acted.DONE
        assert doors.orders == [("recalibrate", order)]
    silent: Any = Doors(None)
    early: Any = Doors(known | {"rig_time_s": None})
    deaf: Any = Doors(known, None)
    assert [operator.act_on_cue(one, "solve") for one in (silent, early, deaf)] == [
        Acted.NO_ANSWER,
        Acted.LATER,
        Acted.NO_ANSWER,
    ]
    assert (silent.orders, early.orders) == ([], [])


def test_the_turn_of_a_look_is_that_of_its_tube_and_its_make_up() -> None:
    root = np.arange(25.0).reshape(5, 5)
    cov = root @ root.T  # three tubes, two make-ups
    looks: Any = SimpleNamespace(tube=np.array([0, 2]), make_up=np.array([1, 0]))
    string: Any = SimpleNamespace(turn_cov=cov, count=3)
    for found, (tube, make_up) in zip(_vars_of_turns(looks, string), ((0, 4), (2, 3)), strict=True):
        both = np.zeros(5)
        both[[tube, make_up]] = 1.0
        assert found == pytest.approx(both @ cov @ both)
