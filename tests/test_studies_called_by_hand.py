"""What commands of studies, chips and faults ask for, print, write and end with, by a stub of what computes."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from called_instead import Given, instead
from printed_output import cells, printed, run_command

from borechain.cli.experiment import experiment as experiment_room
from borechain.cli.experiment.experiment import command_of, experiment
from borechain.cli.experiment.study_output import interval_cell, progress_bar, show_study, write_study
from borechain.cli.faults import InputFault
from borechain.cli.firmware.firmware import firmware
from borechain.cli.gauntlet.gauntlet import COLUMNS, GauntletRequest, gauntlet
from borechain.gauntlet.gauntlet_run import ALL, SeedOutcome
from borechain.gauntlet.soak import SoakSample
from node.translation.firmware_build import FirmwareRequest
from sim.gauntlet.fault_kinds import KINDS
from sim.studies.study import Option, ResultTable, Study

# studies


def study(**change: Any) -> Study:
    tables = (
        ResultTable("kept alone", kept=(("case", "c"),), rows="cases"),
        ResultTable("of {hops} hops, {found}", shown=(("case", "c"), ("interval", "i")), rows="rows", suffix="-rows"),
    )
    takes = (Option("hops", 3, least=1, most=9, help="Of them."), Option("way", "a", choices=("a", "b")))
    plain = {"name": "some", "help": "What it is. And more.", "module": "no.module", "tables": tables, "takes": takes}
    return Study(**plain | {"counts": "seeds", "full": ("--hops 4", "--hops 5"), "short": "--hops 1"} | change)


RESULT = {
    "experiment": "some-of-it", "cases": [{"case": 1.25}], "found": 8, "traces": np.zeros(3),
    "rows": [{"case": 2.5, "low": 0.12345, "high": 6.5}, {"case": 3.5, "interval": "none"}],
}  # fmt: skip


@pytest.fixture
def one_study(monkeypatch: pytest.MonkeyPatch) -> Given:
    """Have a study of its own run; returns what it is asked."""
    asked: Given = []

    def run_study(_study: Study, given: dict[str, Any], step: Any) -> dict[str, Any]:
        asked.append(dict(given))
        for _ in range(given["hops"]):
            step()
        return dict(RESULT)

    monkeypatch.setattr(Study, "run", run_study)
    monkeypatch.setattr(Study, "steps", lambda _study, given: given["hops"])
    monkeypatch.setattr(Study, "verdicts", lambda _study, result: [f"verdict of {result['found']}"])
    monkeypatch.setattr(Study, "figures", lambda _study, result: {"drawn": result["found"]})
    monkeypatch.setattr(experiment_room, "load_studies", lambda: {"some": study(drawn=False)})
    return asked


def test_a_study_takes_its_options_and_shows_its_tables_and_verdicts(one_study: Given, tmp_path: Path) -> None:
    done = run_command(experiment, "some", "--hops", "4", "--way", "b", "--out", str(tmp_path / "made"))
    assert done.exit_code == 0, done.output
    assert one_study == [{"hops": 4, "way": "b"}]
    rows = [cells(line) for line in done.stdout.splitlines()]
    assert ["2.5", "0.123-6.5"] in rows
    assert ["3.5", "none"] in rows
    assert "of 4 hops, 8" in done.stdout
    assert done.stdout.splitlines()[-1] == "verdict of 8"
    assert "kept alone" not in done.stdout
    assert {path.name: path.read_text() for path in (tmp_path / "made").iterdir()} == {"some-of-it.csv": "case\n1.25\n"}
    said = json.loads(run_command(experiment, "some", "--json").stdout)
    assert said == {key: value for key, value in RESULT.items() if key != "traces"}
    assert one_study[1] == {"hops": 3, "way": "a"}
    for wrong in (("--hops", "0"), ("--hops", "10"), ("--way", "c")):
        assert run_command(experiment, "some", *wrong).exit_code == 2


def test_every_experiment_is_listed_with_its_first_sentence(one_study: Given) -> None:
    lines = run_command(experiment, "list").output.splitlines()
    assert [line[:24].strip() for line in lines] == ["records", "some"]
    assert lines[1] == f"{'some':24} What it is"


@pytest.mark.parametrize(("words", "hops"), [((), [4, 5]), (("--short",), [1])])
def test_all_experiments_run_as_the_committed_results_have_them(
    one_study: Given, tmp_path: Path, words: tuple[str, ...], hops: list[int]
) -> None:
    done = run_command(experiment, "all", *words, "--out", str(tmp_path))
    assert done.exit_code == 0, done.output
    assert [asked["hops"] for asked in one_study] == hops
    told = [line for line in done.stderr.splitlines() if line.startswith("borechain")]
    assert told == [f"borechain experiment some --hops {count}" for count in hops]
    assert [path.name for path in tmp_path.iterdir()] == ["some-of-it.csv"]


def test_the_help_of_a_study_has_an_example_of_each_full_run() -> None:
    assert (command_of(study()).help or "").splitlines()[2:] == [
        "\b", "Examples:", "  borechain experiment some --hops 4 --out docs/results",
        "  borechain experiment some --hops 5 --out docs/results",
    ]  # fmt: skip
    assert (command_of(study(full=("",))).help or "").splitlines()[3:] == [
        "Example:", "  borechain experiment some --out docs/results",
    ]  # fmt: skip


def test_a_study_draws_into_its_folder_and_none_without_one(
    monkeypatch: pytest.MonkeyPatch, one_study: Given, tmp_path: Path
) -> None:
    drawn = instead(monkeypatch, "groundstation.report.style.save_figure", None)
    write_study(study(), RESULT, None)
    assert drawn == []
    write_study(study(), RESULT, tmp_path)
    assert drawn == [(8, tmp_path / "drawn.svg")]
    assert interval_cell({"case": 1}) == {}
    assert printed(show_study, study(tables=()), {"hops": 1}, RESULT) == ["verdict of 8"]
    wide = study(tables=(ResultTable("t", shown=(("case", "c"), ("interval", "i")), rows="rows", sideways=True),))
    assert ["c", "2.5", "3.5"] in [cells(line) for line in printed(show_study, wide, {}, RESULT)]


def test_a_bar_moves_by_one_and_is_silent_where_it_is_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    made: Given = []

    class Bar:
        def __init__(self, **named: Any) -> None:
            made.append((named["disable"], named["console"].stderr))

        def __enter__(self) -> Any:
            return self

        def __exit__(self, *_: object) -> None:
            made.append("ended")

        def add_task(self, words: str, total: int) -> int:
            made.append((words, total))
            return 17

        def advance(self, *given: Any) -> None:
            made.append(given)

    monkeypatch.setattr("rich.progress.Progress", Bar)
    with progress_bar(5, "seeds", quiet=True) as step:
        step()
        step()
    assert made == [(True, True), ("seeds", 5), (17,), (17,), "ended"]


# a chip


def test_a_build_names_its_files_and_its_size_on_the_chip(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made = SimpleNamespace(files=[Path("a.c"), Path("a.h")], digest="abc", memory=123, size=SimpleNamespace(flash=4567))
    asked = instead(monkeypatch, "node.translation.firmware_build.build_firmware", made)
    done = run_command(firmware, "build", "--target", "riscv32", "--imus", "3", "--out", str(tmp_path / "made"))
    events = tmp_path / "made" / "borechain_events.h"
    assert done.output.splitlines() == [
        "a.c", "a.h", str(events), "source abc, 123 bytes of records a node", "4567 bytes of flash on riscv32",
    ]  # fmt: skip
    assert asked == [(FirmwareRequest("riscv32", 3, tmp_path / "made"),)]
    made.size = None
    assert run_command(firmware, "build", "--out", str(tmp_path)).output.splitlines()[-1].startswith("source abc")


def test_a_chip_is_provisioned_with_its_room_and_its_keys(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made = SimpleNamespace(files=[Path("a.bin"), Path("a.h")], digest="abc", size=512)
    asked = instead(monkeypatch, "node.firmware.node_image.provision_node", made)
    keys = instead(monkeypatch, "node.process.key_page.write_key_page", Path("keys.bin"))
    done = run_command(firmware, "provision", "--tube", "3", "--out", str(tmp_path / "made"))
    assert done.output.splitlines() == ["a.bin", "a.h", "tube 3, source abc, 512 bytes"]
    settings, room, out = asked[0]
    assert (settings.tube, room, out) == (3, 8, tmp_path / "made")
    assert keys == []
    stick = ("--room", "2", "--keys", str(tmp_path), "--out", str(tmp_path / "made"))
    done = run_command(firmware, "provision", "--tube", "4", *stick)
    assert done.output.splitlines()[2:] == ["keys.bin", "tube 4, source abc, 512 bytes"]
    assert (asked[1][1], keys) == (2, [(tmp_path, 4, tmp_path / "made")])


def test_the_codec_of_can_is_written_as_it_is_told(tmp_path: Path) -> None:
    done = run_command(firmware, "codec", "--out", str(tmp_path / "made"))
    *names, table = done.output.splitlines()
    assert [Path(name) for name in names] == [
        tmp_path / "made" / f"borechain_native.{end}" for end in ("h", "c")
    ]  # fmt: skip
    assert table.startswith("table ")
    header, code = (Path(name).read_text() for name in names)
    assert table.removeprefix("table ") in header
    assert "#ifndef" in header
    assert "#ifndef" not in code
    assert '#include "borechain_native.h"' in code


# faults


def outcome_of_seed(seed: int, **change: Any) -> SeedOutcome:
    plain: dict[str, Any] = {"cpu_s": 2.0, "digest": f"d{seed}"}
    return SeedOutcome(seed, ("loss", "node-cut"), **plain | change)


def test_seeds_are_told_by_those_that_fail_and_how_to_repeat_them(monkeypatch: pytest.MonkeyPatch) -> None:
    outcomes = [
        outcome_of_seed(5), outcome_of_seed(6, violations=["one", "two"], schedule=["1.0 s loss", "2.0 s end"]),
        outcome_of_seed(7, violations=["three"], plan="calmed", seams={"a": 1.0}),
    ]  # fmt: skip
    asked = instead(monkeypatch, "borechain.gauntlet.gauntlet_run.judge_seeds", outcomes)
    done = run_command(gauntlet, "--seeds", "3", "--from", "5")
    assert done.exit_code == 1
    assert done.output.splitlines() == [
        "seed 6 failed: one; two", "  1.0 s loss", "  2.0 s end",
        "  borechain gauntlet --seed 6 --exactly loss,node-cut",
        "seed 7 failed: three", "  borechain gauntlet --seed 7 --exactly loss,node-cut --plan calmed --seams",
        "3 seeds, 2 failed, 30 a minute of one core",
        "Error: 2 of 3 seeds failed; each is named above with what repeats it",
    ]  # fmt: skip
    assert [job.seed for job in asked[0][0]] == [5, 6, 7]
    whole = run_command(gauntlet, "--seeds", "3", "--json").output.splitlines()
    assert json.loads(whole[1])["violations"] == ["one", "two"]
    assert [json.loads(line)["seed"] for line in whole[:3]] == [5, 6, 7]
    assert json.loads(whole[3]) == {"seeds": 3, "failed": 2, "cpu_s": 6.0, "runs_per_cpu_minute": 30.0}


def test_facts_of_all_seeds_are_counted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    both: Any = [outcome_of_seed(1, pairs={("a", "b"), ("a", "c")}), outcome_of_seed(2, pairs={("a", "b")})]
    asked = instead(monkeypatch, "borechain.gauntlet.gauntlet_run.judge_seeds", both)
    done = run_command(gauntlet, "--seeds", "2", "--coverage")
    assert (done.exit_code, done.output) == (0, "2 seeds, 0 failed, 30 a minute of one core, 2 pairs of facts\n")
    assert all(job.covers for job in asked[0][0])
    assert json.loads(run_command(gauntlet, "--coverage", "--json").output.splitlines()[-1])["pairs"] == 2
    assert "pairs" not in run_command(gauntlet, "--json").output.splitlines()[-1]


def request_of(**change: Any) -> GauntletRequest:
    plain: dict[str, Any] = dict.fromkeys(("seed", "faults", "exactly", "together"))
    some = {"seeds": 3, "first": 4, "plan": "minute", "has_seams": True, "covers": False}
    return GauntletRequest(**some | plain | change)


def test_a_seed_runs_with_the_faults_that_are_asked_for() -> None:
    assert [tuple(job) for job in request_of().to_jobs()] == [
        (seed, ALL, None, "minute", True, False) for seed in (4, 5, 6)
    ]  # fmt: skip
    (one,) = request_of(seed=9, faults=" loss , node-cut", plan="calmed", has_seams=False, covers=True).to_jobs()
    assert tuple(one) == (9, ("loss", "node-cut"), None, "calmed", False, True)
    assert request_of(seed=9, exactly="loss").to_jobs()[0].kinds == ("loss",)
    together = request_of(seed=0, faults="loss,node-cut", together=2).to_jobs()[0]
    assert sorted(together.kinds or ()) == ["loss", "node-cut"]
    for change in ({"together": 3, "faults": "loss,node-cut"}, {"together": 1, "exactly": "loss"}):
        with pytest.raises(InputFault, match=f"--together {change['together']}: expected as many"):
            request_of(**change).to_jobs()
    with pytest.raises(InputFault, match=r"--exactly: expected some of .*, got 'none'$"):
        request_of(exactly="loss,none").to_jobs()


def test_every_kind_of_fault_is_listed_and_a_folder_wants_a_soak(tmp_path: Path) -> None:
    lines = run_command(gauntlet, "--list").output.splitlines()
    assert [line.split()[0] for line in lines] == [kind.name for kind in KINDS]
    assert lines[0] == f"{KINDS[0].name:20} {KINDS[0].meaning}"
    refused = run_command(gauntlet, "--out", str(tmp_path))
    assert (refused.exit_code, refused.output) == (2, "Error: --out: expected --soak with it\n")


def sample(hours: float, **change: Any) -> SoakSample:
    plain: dict[str, Any] = {"memory_mib": 2.0, "objects": 3, "disks_mib": 4.0, "handles": 5, "database_kib": 6.0}
    return SoakSample(hours, **plain | {"surveys": 7, "violations": (), "cpu_s": 9.0} | change)


def test_a_soak_tells_each_sample_keeps_them_and_fails_by_what_is_wrong_at_its_end(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked = instead(monkeypatch, "borechain.gauntlet.soak.run_soak", [sample(1.0), sample(2.0, violations=("a", "b"))])
    drawn = instead(monkeypatch, "borechain.gauntlet.soak_figure.soak_figure", "figure")
    kept = instead(monkeypatch, "groundstation.report.style.save_figure", None)
    out = tmp_path / "made"
    done = run_command(gauntlet, "--soak", "2", "--from", "3", "--out", str(out))
    assert (done.exit_code, asked) == (1, [(2.0, 3)])
    first, second, error = done.output.splitlines()
    expected = "1.0 h 2.0 MiB, 4.0 of it disks 3 objects 5 handles 6.0 KiB 7 surveys 0 wrong"
    assert " ".join(first.split()) == expected
    assert second.endswith("2 wrong")
    assert error == "Error: after 2 h: a; b"
    assert [len(samples) for (samples,) in drawn] == [2]
    assert kept == [("figure", out / "soak.svg")]
    assert (out / "soak.csv").read_text().splitlines() == [
        ",".join(key for key, _ in COLUMNS), "1,2,4,3,5,6,7,0,9", "2,2,4,3,5,6,7,2,9",
    ]  # fmt: skip
    said = run_command(gauntlet, "--soak", "2", "--json").output.splitlines()
    assert json.loads(said[0]) == json.loads(json.dumps(asdict(sample(1.0))))
    asked = instead(monkeypatch, "borechain.gauntlet.soak.run_soak", [sample(1.0, violations=("a",)), sample(2.0)])
    assert run_command(gauntlet, "--soak", "2").exit_code == 0  # what was told and is over is no failure
