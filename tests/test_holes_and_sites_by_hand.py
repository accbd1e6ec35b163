"""A job as it is drilled: one hole with its result and its page, the holes of a site in turn, and the small parts."""

from __future__ import annotations

import contextlib
import gc
import json
import re
import runpy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from borechain.drilling import compile_ahead, compile_early, drill_hole, drill_site, kernel_parts, rig_host, router_host
from borechain.drilling.rare_collection import rare_collection
from borechain.drilling.rig_job import DrilledRig, RigJob, RigRun, RigWatcher
from groundstation.gateway.page.page_settings import PageSettings
from sim.errors import RigError, ScenarioError

# a rig of one hole, and of several


def test_tubes_on_chips_are_numbers_of_the_string_or_all(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[None] = []
    monkeypatch.setattr("node.translation.chip_program.chip_program", lambda: made.append(None))
    assert drill_hole.tubes_on_chips("", 3) == frozenset()
    assert made == []
    assert drill_hole.tubes_on_chips("all", 3) == {1, 2, 3}
    assert drill_hole.tubes_on_chips("3", 3) == {3}
    assert drill_hole.tubes_on_chips("1, 3", 3) == {1, 3}
    assert len(made) == 3
    for said in ("4", "0", "x", "1,x", "1,1", "1,", "-1"):
        told = f"--chip {said}: expected all, or numbers of tubes from 1 to 3 with commas"
        with pytest.raises(RigError, match=f"^{told}$"):
            drill_hole.tubes_on_chips(said, 3)


def test_a_page_has_its_passwords_or_one_by_lot_that_is_told() -> None:
    said: list[str] = []
    own = PageSettings("127.0.0.1", 81, passwords={"driller": "x"})
    assert drill_hole.page_with_password(own, said.append) is own
    assert said == []
    bare = PageSettings("127.0.0.1", 81)
    served = drill_hole.page_with_password(bare, said.append)
    (line,) = said
    found = re.fullmatch(r"page (\S+); sign in as driller with the password (\S+)", line)
    assert found
    assert found[1] == bare.url
    from groundstation.gateway.page.passwords import is_right

    assert list(served.passwords) == ["driller"]
    assert is_right(found[2], served.passwords["driller"])
    assert (served.host, served.port) == ("127.0.0.1", 81)


def test_a_world_without_a_link_is_only_for_studies(tmp_path: Path) -> None:
    file = tmp_path / "s.toml"
    string = "[rig]\ntubes = 2\ntube_length_m = 2.0\n[path.straight]\ninclination_deg = 3.0\n"
    file.write_text(f'{string}[medium]\nlink = "off"\n')
    with pytest.raises(ScenarioError, match=r'medium\.link: expected "on" for a rig; only studies run without a link$'):
        drill_hole.read_world(RigJob(file, 4, 1.0))
    file.write_text(file.read_text().replace('"off"', '"on"'))
    world = drill_hole.read_world(RigJob(file, 4, 1.0))
    assert (world.seed, world.scenario.tubes, world.on_chips) == (4, 2, frozenset())


@pytest.mark.parametrize("is_inline", [True, False])
def test_a_hole_is_drilled_and_its_result_has_what_ran(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_inline: bool
) -> None:
    asked: list[Any] = []
    run = RigRun({"status": 1}, 7, 2)
    monkeypatch.setattr(drill_hole, "read_world", lambda job, _say: f"world of {job.hole}")
    monkeypatch.setattr(drill_hole, "drill_inline", lambda *given: asked.append(given) or run)
    monkeypatch.setattr(drill_hole, "drill_in_processes", lambda *given: asked.append(given) or run)
    monkeypatch.setattr(
        drill_hole, "rig_result", lambda answers, world: {"answers": answers, "world": world, "stations": []}
    )
    monkeypatch.setattr(drill_hole, "Ground", lambda *given: given)
    joined: list[Any] = []
    log: Any = SimpleNamespace(join=lambda *given: joined.append(given))
    job = RigJob(tmp_path / "s.toml", 1, 2.0, out=tmp_path / "run", hole="H", rig_name="r", endpoint="e")
    bus: Any = None if is_inline else "bus"
    drilled = drill_hole.drill_hole(job, bus, RigWatcher(log=log))
    assert drilled.folder == tmp_path / "run"
    assert {**drilled.result, "wall_s": 0.0, "kernels": ""} == {
        "answers": {"status": 1}, "world": "world of H", "stations": [], "processes": 7, "restarts": 2, "wall_s": 0.0,
        "kernels": "",
    }  # fmt: skip
    assert drilled.result["kernels"]
    assert json.loads((tmp_path / "run" / "result.json").read_text())["processes"] == 7
    (given,) = asked
    assert given[:2] == ("world of H", job)
    assert given[2] == (tmp_path / "run" if is_inline else "bus")
    assert given[4] is log
    assert joined == ([] if is_inline else [("e", "r", ("bus", "r"))])
    if not is_inline:
        assert given[5].args == ("world of H", job, tmp_path / "run", None)

    def interrupted(*_given: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(drill_hole, "drill_inline", interrupted)
    monkeypatch.setattr(drill_hole, "drill_in_processes", interrupted)
    again = RigJob(tmp_path / "s.toml", 1, 2.0, out=tmp_path / "more")
    told = f"interrupted; every process was ended, what was stored is in {tmp_path / 'more'}"
    with pytest.raises(RigError, match=f"^{re.escape(told)}$"):
        drill_hole.drill_hole(again, bus, RigWatcher())


def test_holes_of_a_site_are_drilled_in_turn_and_each_knows_those_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written, drilled, holes = list[Any](), list[Any](), list[str]()

    def drill(job: RigJob, bus: Any, watcher: RigWatcher) -> DrilledRig:
        drilled.append((job.hole, job.seed, job.out, job.wall, job.served, bus, watcher.log is not None))
        return DrilledRig({"digest": f"d{job.hole}", "wall": f"w{job.hole}", "own": job.hole}, tmp_path)

    monkeypatch.setattr(drill_site, "drill_hole", drill)
    monkeypatch.setattr(drill_site, "write_wall", lambda folder, _scenario: folder / "wall.toml")
    monkeypatch.setattr(drill_site, "write_stations", lambda folder, rows: written.append((folder, list(rows))))
    monkeypatch.setattr(drill_site, "hole_rows", lambda hole, result: [(hole, result["own"])])
    site = SimpleNamespace(holes=[SimpleNamespace(name=name) for name in "AB"])
    scenario: Any = SimpleNamespace(file=SimpleNamespace(site=site))
    monkeypatch.setattr(drill_site, "read_scenario", lambda _job: scenario)
    log: Any = SimpleNamespace(on_hole=holes.append)
    job = RigJob(Path("s.toml"), 5, 1.0, out=tmp_path / "run")
    found = drill_site.drill_scenario(job, None, RigWatcher(log=log))
    folder = tmp_path / "run"
    assert drilled == [(n, 5 + k, folder / n, folder / "wall.toml", None, None, True) for k, n in enumerate("AB")]
    assert written == [(folder, []), (folder, [("A", "A")]), (folder, [("A", "A"), ("B", "B")])]
    assert holes == ["A", "B"]
    rows = [{"hole": n, "digest": f"d{n}", "wall": f"w{n}"} for n in "AB"]
    assert (found.result, found.folder) == ({"digest": "dB", "wall": "wB", "own": "B", "holes": rows}, folder)
    scenario.file.site = None
    assert drill_site.drill_scenario(job, None, RigWatcher()).result["own"] == ""
    assert drilled[-1] == ("", 5, folder, None, None, None, False)


# small parts


def test_garbage_is_looked_for_rarely_and_as_before_afterwards() -> None:
    before = gc.get_threshold()
    with contextlib.suppress(KeyError), rare_collection():
        assert gc.get_threshold() == (50_000, *before[1:])
        raise KeyError
    assert gc.get_threshold() == before


@pytest.mark.parametrize(("lacking", "said"), [(["step", "adjustment"], "365\n"), ([], "")])
def test_an_early_compilation_says_of_how_many_and_compiles_what_is_lacking(
    lacking: list[str], said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    compiled: list[object] = []
    monkeypatch.setattr(compile_ahead, "lacking_parts", {"float64": lacking}.__getitem__)
    monkeypatch.setattr(kernel_parts, "compile_beside", compiled.append)
    monkeypatch.setattr(kernel_parts, "end_when_told", lambda: None)  # of this process
    runpy.run_path(compile_early.__file__, run_name="__main__")
    assert capsys.readouterr().out == said
    assert compiled == [lacking] * bool(lacking)


@pytest.mark.parametrize(("waited", "said"), [(0.0, False), (9.5, False), (10.0, True), (10.5, False), (20.0, True)])
def test_who_has_not_joined_is_named_every_ten_seconds(
    waited: float, said: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    rig_host.say_absent("encoder", waited)
    told = f"borechain medium: encoder has not joined for {waited:.0f} s, it is waited for\n"
    assert capsys.readouterr().err == (told if said else "")
    assert rig_host.depth_sealer(None)(b"x") == b"x"


def test_a_router_waits_for_files_that_have_changed_or_for_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    looks, stops = [False, False, True], [False] * 3
    monkeypatch.setattr(router_host, "is_stopped", lambda _queue: stops.pop(0))
    files: Any = SimpleNamespace(have_changed=lambda: looks.pop(0))
    assert router_host.wait_for_change(files, None) is False  # type: ignore[arg-type]
    assert (looks, stops) == ([], [])
    looks, stops = [False], [False, True]
    assert router_host.wait_for_change(files, None) is True  # type: ignore[arg-type]
