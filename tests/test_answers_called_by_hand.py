"""What commands of links, exports, surveys and keys ask for, write and end with, by a stub of what computes."""

from __future__ import annotations

import contextlib
import hashlib
import json
from datetime import UTC, date, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from called_instead import Given, instead
from click.testing import CliRunner
from printed_output import cells, run_command

from borechain import __version__
from borechain.cli.export import export_command
from borechain.cli.link import can, chip_command, link_output
from borechain.cli.link.pipe import pipe
from borechain.cli.link.soil_command import soil
from borechain.cli.pki import pki as pki_room
from borechain.cli.report_options import PaperRequest
from borechain.cli.survey import survey as survey_room
from borechain.cli.survey.clearance_command import clearance
from borechain.cli.survey.survey_options import HolePaperRequest, SurveyFiles
from groundstation.report.document import ReportPapers
from groundstation.survey.exports.live_hole import LivePlace
from telemetry.errors import MediumError

# links


def test_the_load_of_a_joint_is_told_in_percent_by_tubes_and_bit_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [(7, "native", "fd", 5e5, 0.125), (9, "tunnel", "classic", 125e3, 1.5)]
    asked = instead(monkeypatch, "telemetry.application.can_load.load_table", rows)
    words = ("--tubes", "7", "--tubes", "9", "--bitrate", "500000", "--data-ratio", "2", "--sealed")
    lines = run_command(can.load, *words).output.splitlines()
    assert asked == [((7, 9), (5e5,), 2.0, {"sealed": True})]
    assert lines[0].strip() == "load of the top joint, sealed"
    assert [cells(line) for line in lines if "fd" in line] == [["7", "native", "fd", "500000", "12.5"]]
    said = json.loads(run_command(can.load, "--json").output)
    assert said["load"][1] == {
        "tubes": 9, "profile": "tunnel", "frames": "classic", "bitrate": 125000, "load_percent": 150.0,
    }  # fmt: skip
    assert asked[1] == ((10, 25, 50), (125e3, 500e3, 1e6), 4.0, {"sealed": False})
    assert "sealed" not in run_command(can.load).output


def test_a_foreign_dbc_is_compared_and_each_difference_is_a_line(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    own = run_command(can.dbc).output
    file = tmp_path / "their.dbc"
    file.write_text(own)
    assert run_command(can.dbc, "--check", str(file)).output == "no difference\n"
    monkeypatch.setattr("telemetry.presentation.can_dbc.database_differences", lambda _database: ["one", "two"])
    done = run_command(can.dbc, "--check", str(file))
    assert (done.exit_code, done.output) == (2, f"Error: {file}: one\n{file}: two\n")
    for content in (b"nothing of it {", b"\xff\xfe\x81"):
        file.write_bytes(content)
        done = run_command(can.dbc, "--check", str(file))
        assert (done.exit_code, "expected a DBC file" in done.output) == (2, True)


@pytest.mark.parametrize("fails", ["", "line", "bus", "run"])
@pytest.mark.parametrize(("frames", "is_fd"), [("fd", True), ("classic", False)])
def test_a_chip_is_bridged_and_both_ends_are_given_back(
    monkeypatch: pytest.MonkeyPatch, fails: str, frames: str, is_fd: bool
) -> None:
    told: Given = []

    def failing(name: str) -> None:
        if fails == name:
            raise MediumError(f"{name} is gone")

    class Line:
        def __init__(self, *given: Any) -> None:
            failing("line")
            told.append(given)

        def close(self) -> None:
            told.append("line closed")

    class Bridge:
        def __init__(self, serial: Any, controller: Any, *, fd: bool, tell: Any) -> None:
            assert fd is is_fd
            self.counters = {"to_chip": 2, "from_chip": 3}
            tell("it speaks")

        def run(self) -> None:
            failing("run")

    def opened(open_bus: Any, channel: str, fd: bool, _none: None) -> Any:
        failing("bus")
        assert (channel, fd) == ("can7", is_fd)
        return SimpleNamespace(shutdown=lambda: told.append("bus closed"))

    monkeypatch.setattr("telemetry.media.serial_line.SerialLine", Line)
    monkeypatch.setattr("telemetry.media.chip_bridge.ChipBridge", Bridge)
    monkeypatch.setattr("telemetry.media.can_port.open_controller", opened)
    words = ["--line", "/dev/chip", "--bus", f"can7,frames={frames}", "--speed", "115200"]
    done = CliRunner().invoke(chip_command.chip, words)
    said = ["chip at /dev/chip, segment can7", "chip: it speaks"] if fails in ("", "run") else []
    counts = ["carried: from_chip 3, to_chip 2"] if said else []
    error = [f"Error: {fails} is gone"] if fails else []
    assert (done.exit_code, done.stderr.splitlines()) == (int(bool(fails)), [*said, *counts, *error])
    opened_line = [(Path("/dev/chip"), 115200)] if fails != "line" else []
    assert told == [*opened_line, *(["bus closed"] if said else []), *(["line closed"] if opened_line else [])]


def test_a_segment_that_is_none_is_wrong_input() -> None:
    done = CliRunner().invoke(chip_command.chip, ["--line", "/dev/chip", "--bus", "can0,frames=none"])
    assert (done.exit_code, done.stderr.startswith("Error: --bus: ")) == (2, True)


def test_links_are_shown_and_drawn_as_asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    kept = instead(monkeypatch, "groundstation.report.style.save_figure", None)
    for name in ("draw_pipe", "draw_soil", "draw_soil_map"):
        monkeypatch.setattr(f"groundstation.report.plots_radio.{name}", lambda *given, name=name: (name, *given[1:]))
    plot = str(tmp_path / "a.svg")
    done = run_command(pipe, "--radius-cm", "5", "--plot", plot)
    assert done.output.strip().startswith("Pipe of 5 cm at 5 GHz: 0.26 % carbon, ")
    assert kept[0][0][0] == "draw_pipe"
    rho = float(done.output.split("carbon, ")[1].split("e-8")[0]) * 1e-8
    assert kept[0][0][1] == pytest.approx(rho, rel=1e-2)
    said = json.loads(run_command(soil, "--water", "0.1", "--distance-m", "0.2", "--plot", plot, "--json").output)
    assert len(said["links"]) == 1
    title = run_command(soil, "--sand", "0.2", "--clay", "0.4", "--map", "--plot", plot).output.splitlines()[0].strip()
    assert title == "Through soil at 868 MHz: 0.2 sand, 0.4 clay, 1.5 g/cm^3"
    assert [figure[0] for figure, _ in kept] == ["draw_pipe", "draw_soil", "draw_soil_map"]
    assert kept[-1][1] == Path(plot)
    sought: Given = []
    monkeypatch.setattr(link_output, "check_installed", lambda *names: sought.append(names))
    link_output.check_plot(None)
    link_output.check_plot(Path("a.png"))
    assert sought == [("scipy", "matplotlib")]


# exports and surveys


def test_an_export_has_its_site_its_day_and_its_count(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    site = SimpleNamespace(holes=(1, 2, 3))
    answered = instead(monkeypatch, "borechain.api.answer_survey", "an answer")
    of_survey = instead(monkeypatch, "groundstation.survey.exports.export_request.site_of_survey", site)
    of_wall = instead(monkeypatch, "groundstation.survey.exports.export_request.site_of_wall", site)
    made = instead(monkeypatch, "groundstation.survey.exports.export_request.exported_bytes", b"12345")
    judged = SimpleNamespace(wall="a wall", judgement="judged")
    walls = instead(monkeypatch, "borechain.api.wall", judged)
    monkeypatch.setattr(export_command, "day_of_file", lambda: date(2026, 5, 4))
    out = tmp_path / "o.dxf"
    file = tmp_path / "hole-7.csv"
    words = ("hole", str(file), "--format", "dxf", "--out", str(out))
    done = run_command(export_command.export, *words)
    assert done.output == f"{out}: dxf, 3 holes, 5 bytes\n"
    assert of_survey == [("an answer", "hole-7", date(2026, 5, 4))]
    run_command(export_command.export, *words, "--name", "B", "--date", "2025-01-02")
    assert of_survey[1] == ("an answer", "B", date(2025, 1, 2))
    assert answered[0][0].file == file
    words = ("wall", "w.toml", "--format", "ifc", "--out", str(out), "--hole", "K1", "--grid-crs", "EPSG:1")
    done = run_command(export_command.export, *words)
    assert done.output == f"{out}: ifc, 1 holes, 5 bytes\n"
    assert of_wall == [("a wall", "judged", date(2026, 5, 4), "EPSG:1")]
    assert (walls, made[-1], out.read_bytes()) == ([(Path("w.toml"),)], (site, "ifc", "K1"), b"12345")


def test_a_live_hole_is_asked_of_its_ground_station(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    told: Given = []

    @contextlib.contextmanager
    def connect(*given: Any, **named: Any) -> Any:
        told.append((*given, named))
        yield SimpleNamespace(ask=lambda path: f"the {path}")

    monkeypatch.setattr("borechain.client.connect_to_ground", connect)
    monkeypatch.setattr(export_command, "day_of_file", lambda: date(2026, 5, 4))
    made = instead(monkeypatch, "groundstation.survey.exports.live_hole.site_of_live", "a site")
    written = instead(monkeypatch, "borechain.cli.export.export_command.write_export", None)
    out = tmp_path / "o.xml"
    words = ("live", "--rig", "rig-7", "--endpoint", "tcp/127.0.0.1:9", "--format", "witsml", "--out", str(out))
    run_command(export_command.export, *words, "--origin", "1", "2", "3", "--grid-crs", "EPSG:9")
    assert told == [("tcp/127.0.0.1:9", "rig-7", {"keys_place": None, "role": "operator"})]
    assert made == [("rig-7", "the trajectory", "the column", LivePlace((1.0, 2.0, 3.0), "EPSG:9"), date(2026, 5, 4))]
    assert written == [("a site", "witsml", None, out)]


def test_a_survey_is_checked_answered_and_written_before_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    told: Given = []
    answer = SimpleNamespace(result={"a": 1})
    monkeypatch.setattr(SurveyFiles, "check", lambda _self, request: told.append(("checked", request.file)))
    monkeypatch.setattr("borechain.api.answer_survey", lambda request: told.append(("asked", request.file)) or answer)
    monkeypatch.setattr(survey_room, "write_survey", lambda one, *_: told.append(("written", one)))
    monkeypatch.setattr(survey_room, "show_survey", lambda result: told.append(("shown", result)))
    run_command(survey_room.survey, "f.csv")
    file = Path("f.csv")
    before: Given = [("checked", file), ("asked", file), ("written", answer)]
    assert told == [*before, ("shown", {"a": 1})]
    told.clear()
    assert (json.loads(run_command(survey_room.survey, "f.csv", "--json").output), told) == ({"a": 1}, before)


def test_every_file_of_a_survey_has_what_belongs_in_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tables = "groundstation.survey.requests.survey_tables"
    stations = instead(monkeypatch, f"{tables}.station_table_text", "stations")
    sources = instead(monkeypatch, f"{tables}.source_table_text", "sources")
    drawn = instead(monkeypatch, "groundstation.report.plots.draw_survey", "figure")
    kept = instead(monkeypatch, "groundstation.report.style.save_figure", None)
    found = SimpleNamespace(frame="frame")
    answer: Any = SimpleNamespace(result={"stations": "rows", "site": "s"}, found=found, tool_text=lambda: "tool")
    paper: Any = SimpleNamespace(to_pdf=lambda one: b"report" if one is answer else b"")
    places = {name: tmp_path / name for name in ("out", "by_source", "plot", "export_tool", "report")}
    survey_room.write_survey(answer, SurveyFiles(**dict.fromkeys(places)), paper)  # type: ignore[arg-type]
    assert (list(tmp_path.iterdir()), stations, sources, kept) == ([], [], [], [])
    survey_room.write_survey(answer, SurveyFiles(**places), paper)  # type: ignore[arg-type]
    assert (stations, sources, drawn) == ([("rows", "frame", "s")], [(found,)], [(answer,)])
    assert kept == [("figure", tmp_path / "plot")]
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "out": "stations", "by_source": "sources", "export_tool": "tool", "report": "report",
    }  # fmt: skip


@pytest.mark.parametrize("is_file", [True, False])
def test_a_report_names_its_papers_its_day_and_the_hash_of_what_it_was_made_of(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, is_file: bool
) -> None:
    file = tmp_path / "f.csv"
    if is_file:
        file.write_bytes(b"rows")
    made = instead(monkeypatch, "groundstation.report.hole_report.hole_report", "a document")
    printed = instead(monkeypatch, "groundstation.report.document.report_pdf", b"pdf")
    books = PaperRequest("D1", "B", "the contractor", "fr", None)
    answer: Any = SimpleNamespace(request=SimpleNamespace(file=file))
    paper = HolePaperRequest(datetime(2026, 5, 4), "project", "client", "serial", "calibration", books)
    assert paper.to_pdf(answer) == b"pdf"
    assert printed == [("a document",)]
    one, papers, origin = made[0]
    assert one is answer
    assert tuple(getattr(papers, name) for name in papers.__dataclass_fields__) == ("project", "serial", "calibration")
    inputs = [("SHA-256 of f.csv", hashlib.sha256(b"rows").hexdigest())] if is_file else []
    expected = (date(2026, 5, 4), __version__, inputs, ReportPapers("D1", "B", "the contractor", "client", "fr", ""))
    assert tuple(getattr(origin, name) for name in origin.__dataclass_fields__)[:4] == expected
    before = datetime.now(UTC).date()
    HolePaperRequest(None, "", "", "", "", books).to_pdf(answer)
    assert before <= made[1][2].day <= datetime.now(UTC).date()


@pytest.mark.parametrize(("clear", "status"), [(True, 0), (False, 3)])
def test_a_hole_that_is_too_near_ends_with_status_three(
    monkeypatch: pytest.MonkeyPatch, clear: bool, status: int
) -> None:
    asked = instead(monkeypatch, "borechain.api.answer_clearance", {"clear": clear})
    shown = instead(monkeypatch, "borechain.cli.survey.clearance_command.show_clearance", None)
    done = run_command(clearance, "a/one.csv", "b/two.csv", "--k", "2.5", "--margin-m", "0.7")
    assert (done.exit_code, shown) == (status, [({"clear": clear}, "one.csv from two.csv")])
    request = asked[0][0]
    assert (request.reference, request.offset, request.k, request.margin_m) == (
        Path("a/one.csv"), Path("b/two.csv"), 2.5, 0.7,
    )  # fmt: skip
    said = run_command(clearance, "a/one.csv", "b/two.csv", "--json")
    assert (said.exit_code, json.loads(said.output)) == (status, {"clear": clear})


# keys


def test_keys_that_are_retired_leave_the_newest_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    secret = SimpleNamespace(generations=[SimpleNamespace(number=4), SimpleNamespace(number=5)])
    retired = instead(monkeypatch, "borechain.pki.rig_keys.retire_keys", secret)
    done = run_command(pki_room.pki, "retire", "--folder", "stick")
    assert done.output == "generation 5 alone is in every file of stick\n"
    assert retired == [(Path("stick"),)]
    retires = datetime(2026, 5, 4, 13, 7, tzinfo=UTC)
    for before, until in ((retires, "2026-05-04 13:07 UTC"), (None, "it is retired")):
        secret.generations = [SimpleNamespace(number=4, retires_at=before), SimpleNamespace(number=5)]
        instead(monkeypatch, "borechain.pki.rig_keys.rotate_keys", secret)
        done = run_command(pki_room.pki, "rotate", "--folder", "stick")
        assert done.output == (
            f"generation 5 is in every file of stick; generation 4 is valid until {until}\n"
        )  # fmt: skip


def test_a_password_is_set_of_a_person_alone_and_taken_from_him_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from groundstation.gateway.page.passwords import read_passwords

    file = tmp_path / "passwords"
    monkeypatch.setattr(pki_room, "stdin_is_terminal", lambda: False)
    monkeypatch.setattr(pki_room, "read_line", lambda: "a long enough password")
    for words, holder in ((("driller",), "driller"), (("driller", "--name", "anna"), "driller/anna")):
        done = run_command(pki_room.pki, "password", *words, "--file", str(file))
        assert done.output.startswith(f"{file}: password of {holder}; "), done.output
    known = read_passwords(file)
    assert set(known) == {"driller", "driller/anna"}
    assert file.stat().st_mode & 0o77 == 0
    for name in ("a b", "a/b", "ä"):
        done = run_command(pki_room.pki, "password", "driller", "--name", name, "--file", str(file))
        assert (done.exit_code, f"got {name!r}" in done.output) == (2, True)
    done = run_command(pki_room.pki, "password", "operator", "--remove", "--file", str(file))
    assert (done.exit_code, done.output) == (2, f"Error: {file}: expected one of driller, driller/anna, got operator\n")
    of_anna = run_command(pki_room.pki, "password", "driller", "--name", "anna", "--remove", "--file", str(file))
    assert of_anna.output.startswith(f"{file}: driller/anna has no password any more; ")
    assert read_passwords(file) == {"driller": known["driller"]}
    run_command(pki_room.pki, "password", "driller", "--name", "anna", "--file", str(file))
    known = read_passwords(file)
    done = run_command(pki_room.pki, "password", "driller", "--remove", "--file", str(file))
    assert done.output == f"{file}: driller has no password any more; its sessions end within seconds\n"
    assert read_passwords(file) == {"driller/anna": known["driller/anna"]}
    done = run_command(pki_room.pki, "password", "driller", "--remove", "--file", str(tmp_path / "none"))
    assert done.output == f"Error: {tmp_path}/none: expected one of none, got driller\n"
