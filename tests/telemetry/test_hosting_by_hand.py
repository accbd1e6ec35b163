"""A process and its place, before anything is connected: media of its ends, folders, warnings, errors in a line."""

from __future__ import annotations

import json
import multiprocessing
import signal
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from telemetry.errors import MediumError
from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.command_line import EnvironmentFault, InputFault
from telemetry.runtime.hosting import (
    Place,
    chosen_media,
    make_folder,
    on_termination,
    reporting_errors,
    warn_of_keys,
    write_timing,
    write_warning,
)


@pytest.fixture
def forked(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if a launcher had started this process."""
    monkeypatch.setattr(multiprocessing, "parent_process", object)


@pytest.mark.parametrize(("address", "name"), [(ENCODER, "encoder"), (BASE, "base"), (1, "tube-1"), (250, "tube-250")])
def test_an_end_is_on_the_medium_chosen_or_at_the_endpoint_with_the_certificate_of_its_name(
    address: int, name: str, tmp_path: Path
) -> None:
    chosen = {Side.UPPER: "can:can0"}
    open_place = Place("r", "tcp/127.0.0.1:7", tmp_path, media=chosen)
    assert open_place.medium_of(Side.UPPER, address) == "can:can0"
    assert open_place.medium_of(Side.LOWER, address) == "zenoh:tcp/127.0.0.1:7"
    (tmp_path / "own.key").write_text("")
    for keys in (tmp_path, tmp_path / "own.key"):
        sealed = Place("r", "tls/h:7", tmp_path, media=chosen, keys=keys)
        assert sealed.medium_of(Side.UPPER, address) == "can:can0"
        assert sealed.medium_of(Side.LOWER, address) == f"zenoh:tls/h:7,keys={tmp_path / name}"
    with pytest.raises(MediumError, match="zenoh:tls/h:7: expected --keys with it"):
        Place("r", "tls/h:7", tmp_path).medium_of(Side.LOWER, address)


def test_two_kinds_of_keys_are_refused_and_what_was_not_chosen_is_left_out(tmp_path: Path) -> None:
    with pytest.raises(InputFault, match="--key-file and --keys: expected one of them"):
        Place("r", "e", tmp_path, key_file=tmp_path / "k", keys=tmp_path)
    assert chosen_media({Side.UPPER: None, Side.LOWER: "can:x"}) == {Side.LOWER: "can:x"}
    assert chosen_media({Side.UPPER: "zenoh:a", Side.LOWER: None}) == {Side.UPPER: "zenoh:a"}
    with Place("r", "e", tmp_path).step_stream("node-1") as stream:
        assert stream is None
    with (
        pytest.raises(MediumError, match="no stepper at"),
        Place("r", "e", tmp_path, steps=tmp_path / "s").step_stream("n"),
    ):
        pass


def test_a_folder_is_made_with_all_above_it_or_named(tmp_path: Path) -> None:
    place = Place("r", "e", tmp_path / "a" / "b")
    for _ in range(2):
        make_folder(place)
        assert place.folder.is_dir()
    (tmp_path / "file").write_text("")
    with pytest.raises(EnvironmentFault, match=r"--folder .*file/b: Not a directory; choose a writable place"):
        make_folder(Place("r", "e", tmp_path / "file" / "b"))


def test_timing_is_whole_or_that_of_before(tmp_path: Path) -> None:
    write_timing(tmp_path, {"cycles": 1})
    write_timing(tmp_path, {"cycles": 2})
    assert json.loads((tmp_path / "timing.json").read_text()) == {"cycles": 2}
    assert [file.name for file in tmp_path.iterdir()] == ["timing.json"]
    write_timing(tmp_path / "none", {"cycles": 3})  # a disk that refuses ends no process


def test_warnings_stand_beside_the_output_with_the_name(capsys: pytest.CaptureFixture[str]) -> None:
    write_warning("node 3", "late")
    warn_of_keys("base", None)
    seals: Any = SimpleNamespace(ring=SimpleNamespace(warnings=["one", "two"]))
    warn_of_keys("base", seals)
    assert capsys.readouterr() == ("", "borechain node 3: late\nborechain base: one\nborechain base: two\n")


@pytest.mark.usefixtures("forked")
def test_an_expected_error_of_a_forked_process_is_a_line_and_another_is_raised(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as ended, reporting_errors("node 3"):
        raise MediumError("no router")
    assert ended.value.code == 1
    assert capsys.readouterr().err == "borechain node 3: no router\n"
    with pytest.raises(ZeroDivisionError), reporting_errors("node 3"):
        raise ZeroDivisionError
    with reporting_errors("node 3"):
        pass
    assert capsys.readouterr().err == ""


def test_a_command_reports_by_itself(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(MediumError), reporting_errors("node 3"):
        raise MediumError("no router")
    assert capsys.readouterr().err == ""


@pytest.fixture
def handlers() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize(("is_forked", "stops"), [(False, 2), (True, 1)])
def test_a_launcher_alone_hears_the_keyboard(is_forked: bool, stops: int, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[int] = []
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: object() if is_forked else None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    on_termination(lambda: stopped.append(1))
    signal.raise_signal(signal.SIGTERM)
    signal.raise_signal(signal.SIGINT)
    assert len(stopped) == stops
