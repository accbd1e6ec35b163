"""The tables of studies and instruments: what a line buys, and every study with few seeds."""

import csv
import json
import os
import shlex
import textwrap
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from study_figures import FIGURES, apart, figures_of

from borechain.cli.calibrate.calibrate import calibrate
from borechain.cli.experiment.experiment import experiment
from borechain.studies.rig_study_table import RIG_STUDIES
from borechain.studies.set_up import run as set_up
from sim.errors import RigError, TableError
from sim.instruments.instrument import Instrument
from sim.instruments.instrument_table import INSTRUMENTS
from sim.named import by_name
from sim.studies.pool import CORES, one_pool, over_cores, seed_jobs, usable_cores
from sim.studies.study import Option, ResultTable, Study
from sim.studies.study_table import STUDIES

UNKEPT = ("bad-days", "blunders", "set-up")  # whole rigs for minutes, whose parts are in tests/studies
FIGURES_KEPT = json.loads(FIGURES.read_text("utf-8"))
RESULTS = Path(__file__).parents[2] / "docs" / "results"
KEPT = [*STUDIES.values(), *RIG_STUDIES.values()]  # whose tables stand there
# the longest with two seeds; the modes share the code of two-nodes, the others have tests of their own
LONG = {
    *("ingredients", "update-modes", "single-updates", "fifty-nodes", "delay", "consistency", "outage", "bent-holes"),
    *("worlds", "blunders", "bad-days"),
}
STUDY = """
    from groundstation.report.style import new_figure

    def count_steps(throws):
        return throws

    def run_study(throws, step):
        for _ in range(throws):
            step()
        return {"experiment": "coin", "throws": throws, "cases": [{"case": "heads", "published": 0.5, "ours": 0.25}]}

    def verdict_lines(result):
        return [f"{result['throws']} throws are few"]

    def draw_figures(result):
        return {"coin": new_figure(2.0, "A coin")}
"""
INSTRUMENT = """
    from sim.instruments.instrument import Records

    def simulate_records(seed):
        return Records({"plumb.csv": b"angle_deg\\n0\\n"}, {"plumb": {"seed": seed}})
"""


def ask(*words: object) -> Result:
    return CliRunner().invoke(experiment, [str(word) for word in words])


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the import path, for packages that only a test has."""
    folder = tmp_path / "packages"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    return folder


def test_a_study_is_added_by_its_line(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "coin").mkdir()
    for module in ("run", "figure"):
        (place / "coin" / f"{module}.py").write_text(textwrap.dedent(STUDY))
    columns = (("case", "case"), ("published", "claimed"), ("ours", "ours"))
    line = Study(
        "coin",
        "Whether a coin is fair.",
        "coin",
        (ResultTable("{throws} throws", columns, columns),),
        (Option("throws", 4, 1, 10),),
        full=("--throws 9",),
    )
    monkeypatch.setitem(STUDIES, "coin", line)
    assert "\ncoin                     Whether a coin is fair\n" in ask("list").output
    assert "borechain experiment coin --throws 9 --out docs/results" in ask("coin", "--help").output
    shown = ask("coin", "--out", tmp_path)
    assert shown.exit_code == 0, shown.output
    assert "4 throws are few" in shown.output
    assert (tmp_path / "coin.csv").read_text() == "case,published,ours\nheads,0.5,0.25\n"
    assert (tmp_path / "coin.svg").read_text().startswith("<?xml")
    assert json.loads(ask("coin", "--throws", 2, "--json").stdout)["throws"] == 2
    assert "is not in the range 1<=x<=10" in ask("coin", "--throws", 11).output


def test_an_instrument_is_added_by_its_line(place: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "plumb_line.py").write_text(textwrap.dedent(INSTRUMENT))
    for name in [*INSTRUMENTS]:
        monkeypatch.delitem(INSTRUMENTS, name)
    monkeypatch.setitem(INSTRUMENTS, "plumb", Instrument("plumb", "a plumb line", "plumb_line"))
    done = ask("records", "--out", tmp_path, "--seed", 3, "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["files"] == [str(tmp_path / name) for name in ("plumb.csv", "truth.json")]
    assert (tmp_path / "plumb.csv").read_text() == "angle_deg\n0\n"
    assert json.loads((tmp_path / "truth.json").read_text()) == {"plumb": {"seed": 3}}


@pytest.mark.parametrize(
    ("name", "words", "matrix", "allowed"),
    [
        ("turntable", ["--reference", "720"], "matrix", 1e-3),  # the table's own axes lean by 1e-4 rad
        ("attitudes", [], "matrix_mps2_per_g", 5e-3),
    ],
)
def test_a_calibration_finds_the_truth_of_its_instrument(
    name: str, words: list[str], matrix: str, allowed: float, tmp_path: Path
) -> None:
    assert ask("records", "--out", tmp_path, "--seed", 2).exit_code == 0
    done = CliRunner().invoke(calibrate, [name, str(tmp_path / f"{name}.csv"), *words, "--json"])
    assert done.exit_code == 0, done.output
    truth = json.loads((tmp_path / "truth.json").read_text())[name]
    np.testing.assert_allclose(json.loads(done.stdout)["matrix"], truth[matrix], atol=allowed)


@pytest.mark.parametrize("table", [STUDIES, INSTRUMENTS], ids=["studies", "instruments"])
def test_two_lines_of_one_name_are_refused_in_one_line(table: dict) -> None:
    name, line = next(iter(table.items()))
    with pytest.raises(TableError) as refused:
        by_name("lines", [*table.values(), line])
    assert str(refused.value) == (
        f"table of lines: expected one line of each name, got {name!r} in {line.module} and {line.module}"
    )


def test_no_study_takes_the_name_of_a_command_of_the_group() -> None:
    assert not set(experiment.commands) & set(STUDIES)


def costs(study: Study) -> list[pytest.MarkDecorator]:
    return [pytest.mark.statistical] if study.name in LONG else [pytest.mark.slow]


@pytest.mark.parametrize("study", [pytest.param(s, id=s.name, marks=costs(s)) for s in KEPT])
def test_every_study_runs_with_few_seeds_and_keeps_what_its_line_says(
    study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(set_up, "sketch_cases", lambda cases=set_up.sketch_cases: cases()[:2])  # of sixteen, alike
    done = ask(study.name, *shlex.split(study.short), "--out", tmp_path, "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert "traces" not in result
    if study.name not in UNKEPT:
        assert apart(figures_of(result), FIGURES_KEPT[study.name]) == {}
    # of the study of the field one disturbance was asked, which is in one of its two worlds
    assert sum(not result[table.rows] for table in study.tables) <= (study.name == "field")
    for table in study.tables:
        if table.kept:
            name = f"{result['experiment']}{table.suffix}.csv"
            with (tmp_path / name).open(newline="") as file:
                head, *rows = csv.reader(file)
            assert head == [key for key, _ in table.kept]
            assert len(rows) == len(result[table.rows])
            assert head == (RESULTS / name).read_text().splitlines()[0].split(",")  # as the committed one
    drawn = {path.name for path in tmp_path.glob("*.svg")}
    assert bool(drawn) == study.drawn
    assert all((RESULTS / name).exists() for name in drawn)


def test_every_study_has_its_figures_and_a_figure_moves_with_every_number_word_and_order() -> None:
    assert sorted(FIGURES_KEPT) == sorted(study.name for study in KEPT if study.name not in UNKEPT)
    rows = [{"case": "a", "x": 1.5, "y": [0.25, None]}, {"case": "b", "x": -0.5, "z": 3}]
    base = figures_of({"cases": rows, "seeds": 2, "notes": ["n"]})
    assert list(base) == ["cases.case", "cases.x", "cases.y", "cases.z", "seeds", "notes"]
    assert apart(base, base) == {}
    for change in (
        {"case": "c"}, {"x": 1.5001}, {"x": -1.5}, {"y": [0.25, 0.5]}, {"y": [None, 0.25]}, {"w": 1.0},
    ):  # fmt: skip
        other = figures_of({"cases": [rows[0] | change, rows[1]], "seeds": 2, "notes": ["n"]})
        assert list(apart(other, base)) == [f"cases.{name}" for name in change]
    assert set(apart(figures_of({"cases": rows[::-1], "seeds": 2, "notes": ["n"]}), base)) >= {"cases.case", "cases.x"}
    assert list(apart(figures_of({"cases": rows, "seeds": 3, "notes": ["m"]}), base)) == ["seeds", "notes"]
    assert apart({}, {"x": [1.0, 1.0]}) == {"x": (None, [1.0, 1.0])}


def test_the_arguments_of_make_study_are_ones_that_the_studies_take() -> None:
    for study in KEPT:
        command = experiment.get_command(None, study.name)  # type: ignore[arg-type]
        for words in study.full:
            command.make_context(study.name, shlex.split(words))  # type: ignore[union-attr]


@pytest.mark.parametrize("words", [["fixed-point", "--cycles", "1999"], ["ingredients", "--seeds", "1"]])
def test_too_little_is_refused_in_one_line(words: list[str]) -> None:
    done = ask(*words)
    assert done.exit_code == 2
    assert "is not in the range" in done.output


def times_seed(job: tuple[int, int]) -> int:
    return job[0] * job[1]


@pytest.mark.parametrize(("seeds", "cores"), [(2, "2"), (3, "2"), (3, "1")])
@pytest.mark.slow
def test_the_pool_keeps_the_order_of_its_seeds_and_tells_of_each(
    seeds: int, cores: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(CORES, cores)
    stepped: list[None] = []
    with over_cores(seeds, lambda: stepped.append(None)) as run_all:
        assert run_all(times_seed, seed_jobs(10, seeds)) == [10 * seed for seed in range(1, seeds + 1)]
        assert len(stepped) == seeds
        assert run_all(times_seed, seed_jobs(7, 1)) == [7]


def process_of(_: tuple[None, int]) -> int:
    return os.getpid()


@pytest.mark.slow
def test_one_pool_is_kept_for_all_that_ask_inside_and_is_gone_after(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CORES, "2")
    with one_pool():
        processes: set[int] = set()
        for _ in range(2):
            with over_cores(3, lambda: None) as run_all:
                processes |= set(run_all(process_of, seed_jobs(None, 20)))
        assert len(processes) <= 2
        assert all(Path("/proc", str(process)).exists() for process in processes)
    assert not any(Path("/proc", str(process)).exists() for process in processes)
    with over_cores(3, lambda: None) as run_all:
        assert processes.isdisjoint(run_all(process_of, seed_jobs(None, 3)))


@pytest.mark.parametrize("given", ["0", "two", "-1", "1.5"])
def test_a_number_of_cores_that_is_none_is_one_line(given: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CORES, given)
    with pytest.raises(RigError, match=f"{CORES}: expected a number of processes from 1 on, got '{given}'"):
        usable_cores()
