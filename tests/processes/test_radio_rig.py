"""A string that speaks by radio, in real processes: margins travel with the frames, a dead tube is a killed process."""

from pathlib import Path

from rigs import running_rig

SCENARIO = "scenarios/pipe-5.toml"


def test_a_string_by_radio_is_the_same_in_processes_and_in_one(tmp_path: Path) -> None:
    results = []
    for name, words in (("many", ()), ("one", ("--inline",))):
        with running_rig(tmp_path / name, "--seed", "1", *words, scenario=SCENARIO) as rig:
            results.append(rig.result())
    many, one = results
    assert many["digest"] == one["digest"]
    assert many["measurements"] == one["measurements"] == 9
    assert (many["processes"], one["processes"]) == (8, 1)
