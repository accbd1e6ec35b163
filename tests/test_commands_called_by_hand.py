"""What commands of records and campaigns ask for, print, write and end with, by a stub of what computes."""

from __future__ import annotations

import json
from datetime import UTC, date, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from called_instead import Given, instead
from printed_output import cells, run_command

from borechain import __version__
from borechain.cli.calibrate import calibration_output
from borechain.cli.calibrate.accuracy_command import accuracy
from borechain.cli.calibrate.apply_command import apply
from borechain.cli.calibrate.calibration_output import WantedFiles, deliver_calibration
from borechain.cli.calibrate.record_reader import node_array, record_reader
from borechain.cli.campaign import campaign as campaign_room
from borechain.cli.campaign.campaign import campaign
from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.whole_files import write_whole
from groundstation.calibration.applied_series import AppliedSeries
from groundstation.report.sheet import Sheet, SheetTable
from sim.campaign.summary import ACCURACY, HONESTY

# files


def test_a_file_whose_folder_is_a_file_is_refused_by_its_own_name(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("kept")
    with pytest.raises(EnvironmentFault) as ended:
        write_whole(tmp_path / "plain" / "a.csv", "1")
    assert ended.value.message == f"{tmp_path}/plain/a.csv: File exists; choose a writable place"
    assert (tmp_path / "plain").read_text() == "kept"


# calibrate


def wanted(tmp_path: Path, **change: Any) -> WantedFiles:
    plain: dict[str, Any] = {"out": None, "plot": None, "certificate": None, "date": None, "subject": None}
    return WantedFiles(**{"file": tmp_path / "record.csv", **plain, "as_json": False} | change)


def outcome_of(**change: Any) -> Any:
    sheet = Sheet("Calibration", (("record", "a"),), [SheetTable("bias", ("axis", "mg"), (("x", "1"),))], ())
    plain = {
        "document": "the document", "gyroscope_document": None, "sheet": sheet, "record_sha256": "ab",
        "block_sha256": "cd", "result": {"why_no_gyroscope": "it has one sensor"}, "panels": lambda: ["panel"],
    }  # fmt: skip
    return SimpleNamespace(**plain | change)


def test_what_the_books_say_of_a_certificate_is_what_is_told(tmp_path: Path) -> None:
    some = wanted(tmp_path, number="7", serial="S-1", due=datetime(2027, 1, 2, 23, 0), date=datetime(2026, 1, 2))
    assert some.papers == (("Certificate", "7"), ("Serial number", "S-1"), ("Next due", "2027-01-02"))
    assert wanted(tmp_path, serial="S-1").papers == (("Serial number", "S-1"),)
    assert some.day == date(2026, 1, 2)
    before = datetime.now(UTC).date()
    assert before <= wanted(tmp_path).day <= datetime.now(UTC).date()


def test_a_due_day_is_after_the_day_itself_and_files_are_different(tmp_path: Path) -> None:
    day = datetime(2026, 5, 1)
    wanted(tmp_path, date=day, due=datetime(2026, 5, 2)).check()
    for due in (day, datetime(2026, 4, 30)):
        with pytest.raises(InputFault, match=rf"--due: .* calibration, 2026-05-01, got {due.date()}$"):
            wanted(tmp_path, date=day, due=due).check()
    same = tmp_path / "a.json"
    for change, more in (
        ({"out": tmp_path / "record.csv"}, ()), ({"out": same}, (same,)), ({"plot": same, "certificate": same}, ()),
        ({"out": tmp_path / "none" / ".." / "record.csv"}, ()),
    ):  # fmt: skip
        with pytest.raises(InputFault, match="expected different files"):
            wanted(tmp_path, **change).check(*more)
    for change, more, option in (
        ({"plot": tmp_path / "a.txt"}, (), "--plot"), ({"certificate": tmp_path / "a.svg"}, (), "--certificate"),
        ({"out": tmp_path / "a.csv"}, (), "--out"), ({"out": same}, (tmp_path / "b.txt",), "--out"),
    ):  # fmt: skip
        with pytest.raises(InputFault, match=f"^{option} .*: expected a name that ends in"):
            wanted(tmp_path, **change).check(*more)


@pytest.mark.parametrize(("change", "asked"), [({}, []), ({"plot": "a.svg"}, 2), ({"certificate": "a.pdf"}, 2)])
def test_what_draws_is_looked_for_where_something_is_drawn(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, change: dict[str, str], asked: Any
) -> None:
    sought: Given = []
    monkeypatch.setattr(calibration_output, "check_installed", lambda *names: sought.extend(names))
    wanted(tmp_path, **{name: tmp_path / file for name, file in change.items()}).check()
    assert sought == (["matplotlib", "typst"] if asked else [])


def test_a_calibration_is_asked_of_its_day_and_every_file_has_its_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome = outcome_of(gyroscope_document="of the gyroscope")
    asked = instead(monkeypatch, "borechain.api.calibrate", outcome)
    drawn = instead(monkeypatch, "groundstation.report.figure_panels.render_panels", b"a picture")
    papers = instead(monkeypatch, "groundstation.report.certificate.certificate_pdf", b"a paper")
    request: Any = object()
    files = {name: tmp_path / f"a.{end}" for name, end in (("out", "json"), ("plot", "svg"), ("certificate", "pdf"))}
    deliver_calibration(request, wanted(tmp_path, date=datetime(2026, 5, 1), **files), tmp_path / "g.json")
    assert asked == [(request, date(2026, 5, 1))]
    assert drawn == [(["panel"], "svg")]
    sheet, panels, identity = papers[0]
    assert (sheet, panels) == (outcome.sheet, ["panel"])
    assert tuple(getattr(identity, name) for name in identity.__dataclass_fields__) == (
        "record", date(2026, 5, 1), "record.csv", "ab", "cd", __version__, (), "en",
    )  # fmt: skip
    written = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert written == {"a.json": "the document", "g.json": "of the gyroscope", "a.svg": "a picture", "a.pdf": "a paper"}
    lines = capsys.readouterr().out.splitlines()
    assert [Path(line[6:]).name for line in lines if line.startswith("wrote ")] == [
        "a.json", "g.json", "a.svg", "a.pdf",
    ]  # fmt: skip


def test_a_record_without_a_gyroscope_has_no_file_of_one_and_json_is_all_that_is_printed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    instead(monkeypatch, "borechain.api.calibrate", outcome_of())
    request: Any = object()
    with pytest.raises(InputFault, match=r"^--gyroscope-out: it has one sensor$"):
        deliver_calibration(request, wanted(tmp_path, out=tmp_path / "a.json"), tmp_path / "g.json")
    assert list(tmp_path.iterdir()) == []
    deliver_calibration(request, wanted(tmp_path, as_json=True))
    assert json.loads(capsys.readouterr().out) == {"why_no_gyroscope": "it has one sensor"}


def test_a_calibration_that_cannot_be_written_names_the_file_that_was_asked_for(tmp_path: Path) -> None:
    gone = tmp_path / "none" / "two.svg"
    with pytest.raises(EnvironmentFault) as ended:
        calibration_output.write_files_whole({tmp_path / "one.pdf": b"1", gone: b"2"})
    assert ended.value.message == f"{gone}: No such file or directory; nothing was written"
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "one").write_text("1")
    with pytest.raises(EnvironmentFault) as ended:
        calibration_output.write_files_whole({tmp_path / "kept": b"1"})
    assert ended.value.message == f"{tmp_path}/kept: Is a directory; nothing was written"
    with pytest.raises(EnvironmentFault) as ended:
        calibration_output.write_files_whole({tmp_path / "one.pdf": b"1", tmp_path / "kept": b"2"})
    assert ended.value.message == f"{tmp_path}/kept: Is a directory; already written: {tmp_path}/one.pdf"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["kept", "one.pdf"]


def test_accuracy_is_told_by_preset_by_sensor_and_of_all(tmp_path: Path) -> None:
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    one.write_text("preset_dps,mean_dps,std_dps\n10,10.25,0.125\n-20,-21,0.25\n")
    lines = run_command(accuracy, str(one)).output.splitlines()
    rows = [cells(line) for line in lines]
    assert ["10", "10.25", "0.125", "2.5"] in rows
    assert ["-20", "-21", "0.25", "5"] in rows
    assert ["preset dps", "mean dps", "std dps", "error %"] in rows
    two.write_text("preset_dps,mean_dps,std_dps\n10,11,0.5\n")
    both = run_command(accuracy, str(one), str(two))
    assert [line.split()[0] for line in both.output.splitlines() if "precision" in line] == [
        "accuracy",
        "accuracy",
        "all",
    ]
    assert len([line for line in lines if "precision" in line]) == 1
    said = json.loads(run_command(accuracy, str(one), str(two), "--json").output)
    sensors = said["sensors"]
    assert [Path(row["file"]).name for row in sensors] == ["one.csv", "two.csv"]
    whole = f"all as one: accuracy {said['error_percent']:.4g} %, precision {said['std']:.4g} dps"
    assert both.output.splitlines()[-1] == whole
    assert f"accuracy {sensors[1]['error_percent']:.4g} %, precision {sensors[1]['std']:.4g} dps" in both.output
    assert said["error_percent"] != sensors[0]["error_percent"] != sensors[1]["error_percent"]


def test_an_applied_calibration_reads_writes_and_says_both(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    times = np.array([0.0, 0.5])
    before, after = np.array([[3.0, 0.0, 4.0]] * 2), np.array([[0.0, 0.0, 10.0]] * 2)
    series = AppliedSeries("accelerometer", times, before, after)
    blocks = [SimpleNamespace(sensor="accelerometer"), SimpleNamespace(sensor="gyroscope")]
    monkeypatch.setattr("groundstation.calibration.block.read_calibration", lambda path: blocks[int(path.stem)])
    record: Any = object()
    read = instead(monkeypatch, "telemetry.records.imu_record.read_imu_record", record)
    applied = instead(monkeypatch, "groundstation.calibration.applied_series.apply_calibration", series)
    panels = instead(monkeypatch, "groundstation.report.calibration_plots.series_panels", ["panel"])
    drawn = instead(monkeypatch, "groundstation.report.figure_panels.render_panels", b"a picture")
    files = ("--out", str(tmp_path / "o.csv"), "--plot", str(tmp_path / "p.png"))
    words = ("r.csv", "--calibration", "0.json", "--calibration", "1.json", "--gravity", "9.75")
    done = run_command(apply, *words, *files)
    assert done.exit_code == 0, done.output
    assert applied == [(record, blocks[0]), (record, blocks[1])]
    assert read[0][0] == Path("r.csv")
    assert panels == [([series, series],)]
    assert drawn == [(["panel"], "png")]
    assert (tmp_path / "p.png").read_bytes() == b"a picture"
    assert (tmp_path / "o.csv").read_text().splitlines()[1] == "0,0,0,10,0,0,10"
    assert [line for line in done.output.splitlines() if line.startswith("wrote ")] == [
        f"wrote {tmp_path}/o.csv", f"wrote {tmp_path}/p.png",
    ]  # fmt: skip
    said = json.loads(run_command(apply, *words, "--json").output)
    assert said["readings"] == 2
    assert [(row["when"], row["off"]) for row in said["sensors"][:2]] == [("before", 4.75), ("after", 0.25)]
    again = run_command(apply, "r.csv", "--calibration", "0.json", "--calibration", "00.json")
    assert again.exit_code == 2
    assert "expected one a sensor, got two of the same" in again.output


def test_a_record_is_kept_for_a_node_in_the_order_of_its_columns(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    triads = {"gyroscope": np.array([[1.0, 2.0, 3.0]]), "accelerometer": np.array([[4.0, 5.0, 6.0]])}
    record: Any = SimpleNamespace(
        times=lambda: np.array([0.5]), triad=lambda name: triads[name], temperature=np.array([7.0])
    )
    (tmp_path / "a.npy").write_bytes(node_array(record))
    assert np.load(tmp_path / "a.npy").tolist() == [[0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]]
    record.temperature = None
    (tmp_path / "a.npy").write_bytes(node_array(record))
    assert np.load(tmp_path / "a.npy").shape == (1, 7)
    read = instead(monkeypatch, "telemetry.records.imu_record.read_imu_record", record)
    monkeypatch.setattr("telemetry.records.understood_record.understood_line", lambda one: "a line")
    monkeypatch.setattr("telemetry.records.understood_record.understood_object", lambda one: {"an": "object"})
    same = tmp_path / "same.npy"
    for out in (str(same), str(tmp_path / "o.csv")):
        refused = run_command(record_reader, str(same), "--out", out)
        assert (refused.exit_code, refused.output.splitlines()[-1][:15]) == (2, "Error: --out: e")
    done = run_command(record_reader, str(same), "--out", str(tmp_path / "o.npy"), "--rate", "50")
    assert (done.exit_code, done.output) == (0, "a line\n")
    assert (tmp_path / "o.npy").read_bytes() == node_array(record)
    assert read[-1][1].rate == 50.0
    assert json.loads(run_command(record_reader, str(same), "--json").output) == {"an": "object"}


# campaign


def campaign_result(**change: Any) -> dict[str, Any]:
    honesty = [{key: k + 0.5 for k, (key, _) in enumerate(HONESTY)}]
    accuracy = [{key: k + 100.5 for k, (key, _) in enumerate(ACCURACY)}]
    plain = {"scenario": "rig-3", "runs": 70, "computed": 50, "node_cycles": 2000}
    return plain | {"honesty": honesty, "accuracy": accuracy} | change


def test_a_campaign_runs_what_is_asked_and_tells_its_speed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    ran = instead(monkeypatch, "sim.campaign.campaign_run.run_campaign", campaign_result())
    written = instead(monkeypatch, "borechain.cli.campaign.campaign.write_campaign", None)
    moments = iter((100.0, 104.0))
    monkeypatch.setattr(campaign_room, "time", SimpleNamespace(monotonic=lambda: next(moments)))
    done = run_command(campaign, "rig-3", "--runs", "70", "--first", "11", "--out", "kept")
    assert done.exit_code == 0, done.output
    loaded, *asked, step = ran[0]
    assert loaded.tubes == 3
    assert asked == ["rig-3", Path("kept"), 11, 70, "local", None]
    assert callable(step)
    assert written == [(Path("kept"), campaign_result())]
    lines = done.output.splitlines()
    assert lines[-2:] == [
        "50 runs of 2000 node-cycles in 4.0 s: 2.5e+04 a second",
        "kept: surveys-*.parquet, epochs-*.parquet, honesty and accuracy as tables and pictures",
    ]
    rows = [cells(line) for line in lines]
    assert [f"{k + 0.5:g}" for k in range(len(HONESTY))] in rows
    assert [f"{k + 100.5:g}" for k in range(len(ACCURACY))] in rows
    assert "Honesty of the nodes, 70 runs" in done.output


def test_a_campaign_of_runs_that_are_there_says_no_speed_and_its_folder_is_named_by_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    found = campaign_result(computed=0)
    ran = instead(monkeypatch, "sim.campaign.campaign_run.run_campaign", found)
    instead(monkeypatch, "borechain.cli.campaign.campaign.write_campaign", None)
    done = run_command(campaign, "rig-3", "--runs", "1")
    assert "node-cycles" not in done.output
    assert ran[0][2:5] == (Path("out/campaign-rig-3"), 1, 1)
    words = ("--engine", "dask", "--scheduler", "tcp://a:1", "--first", "99999999", "--runs", "1")
    looked: Given = []
    monkeypatch.setattr(campaign_room, "check_installed", looked.append)
    said = json.loads(run_command(campaign, "rig-3", *words, "--json").output)
    assert said == found
    assert ran[1][3:7] == (99999999, 1, "dask", "tcp://a:1")
    assert looked == ["pyarrow", "matplotlib", "scipy", "distributed"]


@pytest.mark.parametrize("has_surveys", [True, False])
def test_a_campaign_keeps_its_tables_and_pictures(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, has_surveys: bool
) -> None:
    figures: Given = []
    monkeypatch.setattr("sim.campaign.campaign_figures.honesty_figure", lambda rows, title: ("honesty", rows, title))
    monkeypatch.setattr("sim.campaign.campaign_figures.accuracy_figure", lambda rows, title: ("accuracy", rows, title))
    monkeypatch.setattr("groundstation.report.style.save_figure", lambda figure, path: figures.append((figure, path)))
    found = campaign_result() if has_surveys else campaign_result(accuracy=[])
    campaign_room.write_campaign(tmp_path, found)
    kept = sorted(path.name for path in tmp_path.iterdir())
    assert kept == (["accuracy.csv", "honesty.csv"] if has_surveys else ["honesty.csv"])
    head, row = (tmp_path / "honesty.csv").read_text().splitlines()
    assert head == ",".join(key for key, _ in HONESTY)
    assert row.split(",")[:3] == ["0.5", "1.5", "2.5"]
    pictures = [(name, path.name, title) for (name, _, title), path in figures]
    assert (
        pictures
        == [
            ("honesty", "honesty.svg", "Honesty of the nodes: rig-3, 70 runs"),
            ("accuracy", "accuracy.svg", "Surveys: rig-3, 70 runs"),
        ][: 1 + has_surveys]
    )
