"""Every command of ``borechain calibrate`` hands over what was asked for, of its kind and with all its numbers."""

from __future__ import annotations

import importlib
from dataclasses import fields
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from borechain.cli.calibrate.calibration_output import WantedFiles
from groundstation.report.calibrations.calibration_request import (
    AllanRequest,
    AttitudesRequest,
    MagnetometerRequest,
    MwdRequest,
    QualityRequest,
    RestsRequest,
    TemperatureRequest,
    TurntableRequest,
)

ROOM = "borechain.cli.calibrate"
COMMANDS: list[tuple[str, str, type, tuple[str, ...], dict[str, Any]]] = [
    ("linear", "turntable", TurntableRequest, ("--reference", "720", "--jig-deg", "0.1", "0.2", "--unit", "g",
      "--full-scale", "9", "--force"), {"reference": 720.0, "jig_deg": (0.1, 0.2), "unit": "g", "full_scale": 9.0,
      "force": True}),
    ("linear", "attitudes", AttitudesRequest, ("--temperature-c", "21", "--jig-deg", "0.3", "0.4"),
     {"temperature_c": 21.0, "jig_deg": (0.3, 0.4), "free_yaw": None, "force": False}),
    ("mwd", "mwd", MwdRequest, ("--parameters", "12"), {"force": False, "parameters": "12"}),
    ("mwd", "magnetometer", MagnetometerRequest, ("--parameters", "30", "--field-ut", "50", "--dip-deg", "65"),
     {"field_ut": 50.0, "dip_deg": 65.0, "parameters": "30"}),
    ("mwd", "qc", QualityRequest, ("--full-scale", "7"), {"full_scale": 7.0, "magnetometers": None}),
    ("temperature_command", "temperature", TemperatureRequest, ("--unit", "g"), {"unit": "g"}),
    ("rests_command", "rests", RestsRequest, ("--gyroscope-out", "g.json"), {}),
    ("allan_command", "allan", AllanRequest, ("--rate", "100"), {}),
]  # fmt: skip


@pytest.mark.parametrize(("module", "name", "kind", "words", "values"), COMMANDS, ids=[row[1] for row in COMMANDS])
def test_a_command_hands_over_its_request_and_the_files(
    module: str, name: str, kind: type, words: tuple[str, ...], values: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    handed: list[tuple[Any, ...]] = []
    room = importlib.import_module(f"{ROOM}.{module}")
    monkeypatch.setattr(room, "deliver_calibration", lambda *given: handed.append(given))
    command: click.Command = getattr(room, name)
    shared = ("--out", "o.json", "--plot", "p.svg", "--subject", "it", "--serial", "7", "--number", "N1", "--json")
    result = CliRunner().invoke(command, ["record.csv", *words, *shared], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    ((request, wanted, *more),) = handed
    assert type(request) is kind
    assert request.file == Path("record.csv")
    assert {key: getattr(request, key) for key in values} == values
    assert type(wanted) is WantedFiles
    told = (wanted.file, wanted.out, wanted.plot, wanted.subject, wanted.serial, wanted.number, wanted.as_json)
    assert told == (Path("record.csv"), Path("o.json"), Path("p.svg"), "it", "7", "N1", True)
    assert (wanted.certificate, wanted.date, wanted.due, wanted.language) == (None, None, None, "en")
    assert more == ([Path("g.json")] if name == "rests" else [])
    assert {field.name for field in fields(kind)} >= set(values)
