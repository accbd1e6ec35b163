"""Edges of commands, by hand: exit statuses, files that are named, what is refused before anything connects."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from borechain.cli.calibrate.calibration_output import show_sheet, write_files_whole
from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.ground.query import check_selector, query, watch
from borechain.cli.report_options import logo_text
from borechain.cli.rig import on_screen
from borechain.cli.survey import wall_command
from groundstation.report.sheet import Sheet, SheetTable

SELECTORS = ["borechain//ground", "/borechain", "borechain/", "borechain/#", ""]


@pytest.mark.parametrize(("is_tight", "status"), [(True, 0), (False, 3)])
def test_a_wall_that_is_not_tight_ends_with_status_three(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, is_tight: bool, status: int
) -> None:
    judged = SimpleNamespace(is_tight=is_tight, to_result=lambda: {"verdict": str(is_tight)})
    monkeypatch.setattr("borechain.api.wall", lambda file: judged if file == tmp_path / "w.toml" else None)
    done = CliRunner().invoke(wall_command.wall, [str(tmp_path / "w.toml"), "--json"])
    assert (done.exit_code, json.loads(done.stdout)) == (status, {"verdict": str(is_tight)})


@pytest.mark.parametrize("selector", SELECTORS)
def test_a_selector_that_is_no_key_is_refused_before_anything_connects(
    monkeypatch: pytest.MonkeyPatch, selector: str
) -> None:
    def connected(*_: Any, **__: Any) -> None:
        raise AssertionError("it has connected")

    monkeypatch.setattr("telemetry.media.zenoh_bus.open_client", connected)
    for command in (query, watch):
        done = CliRunner().invoke(command, [selector])
        assert done.exit_code == InputFault.exit_code
        assert not isinstance(done.exception, AssertionError)
    with pytest.raises(InputFault, match="expected a key expression"):
        check_selector(f"{selector}?md=4..12")
    check_selector("borechain/*/ground/trajectory?md=4..12")


def test_a_logo_is_a_picture_of_at_most_a_mebibyte(tmp_path: Path) -> None:
    logo = tmp_path / "logo.svg"
    head = b"<svg>"
    logo.write_bytes(head + b" " * (2**20 - len(head)))
    assert len(logo_text(logo)) == 2**20
    for content in (head + b" " * (2**20 - len(head) + 1), b" " * 1997 + head, b"<png>"):
        logo.write_bytes(content)
        with pytest.raises(InputFault):
            logo_text(logo)
    logo.write_bytes(b" " * 1996 + b"<svg")
    assert logo_text(logo).endswith("<svg")
    logo.write_bytes(b"<svg>\xff")
    with pytest.raises(InputFault, match=r"logo\.svg: not a text$"):
        logo_text(logo)
    with pytest.raises(InputFault, match=r"none\.svg: No such file"):
        logo_text(tmp_path / "none.svg")


def test_a_sheet_is_printed_with_each_fact_table_warning_and_file(capsys: pytest.CaptureFixture[str]) -> None:
    tables = [SheetTable("bias", ("axis", "mg"), (("x", "1.5"), ("y", "-2"))), SheetTable("scale", ("k",), (("z",),))]
    sheet = Sheet("Calibration", (("record", "a.csv"), ("day", "1 May")), tables, ("it is old", "it is cold"))
    show_sheet(sheet, [Path("one.pdf"), Path("two.svg")])
    words = capsys.readouterr().out.split()
    told = "Calibration record a.csv day 1 May bias axis mg x 1.5 y -2 scale k z"
    told += " warning: it is old warning: it is cold wrote one.pdf wrote two.svg"
    assert " ".join(word for word in words if word.isascii() and word.strip("-+|")) == told


def test_files_are_written_all_or_none_and_no_draft_is_left(tmp_path: Path) -> None:
    one, two = tmp_path / "one.pdf", tmp_path / "two.svg"
    one.write_bytes(b"before")
    with pytest.raises(EnvironmentFault, match=r"none/.*two\.svg.*: No such file or directory; nothing was written$"):
        write_files_whole({one: b"1", tmp_path / "none" / "two.svg": b"2"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"one.pdf": b"before"}
    write_files_whole({one: b"1", two: b"2"})
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"one.pdf": b"1", "two.svg": b"2"}


@pytest.mark.parametrize("code", [None, 0])
def test_the_screen_of_a_rig_is_that_of_its_ground_station_and_ends_with_the_process(
    monkeypatch: pytest.MonkeyPatch, code: int | None
) -> None:
    shown: list[Any] = []

    class Screen:
        def __init__(self, *given: Any, ended: Any) -> None:
            shown.append((*given, ended()))

        def run(self) -> None:
            shown.append("ran")

    monkeypatch.setattr("borechain.crew.app.CrewApp", Screen)
    monkeypatch.setattr(on_screen, "user_name", lambda: "anna")
    ground: Any = object()
    process: Any = SimpleNamespace(poll=lambda: code)
    on_screen.show_crew_screen(ground, "rig-3", process)
    assert shown == [(ground, "rig-3", "anna", code is not None), "ran"]
