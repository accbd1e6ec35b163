"""A string that speaks by radio, in real processes: margins travel with the frames, a dead tube is a killed process."""

import json
from pathlib import Path

from rigs import PATIENCE, running_rig

SCENARIO = "scenarios/pipe-5.toml"


def test_a_string_by_radio_is_the_same_in_processes_and_in_one(tmp_path: Path) -> None:
    results = []
    for name, words in (("many", ()), ("one", ("--inline",))):
        with running_rig(tmp_path / name, "--seed", "1", *words, scenario=SCENARIO) as rig:
            output, errors = rig.process.communicate(timeout=PATIENCE)
        # a stop at which tube 3 is dead lacks its survey, which is said and does not end as success
        assert rig.process.returncode == 1
        assert "expected 10 surveys, 1 are missing: tube 3" in errors
        results.append(json.loads(output.splitlines()[-1]))
    many, one = results
    assert many["digest"] == one["digest"]
    assert many["measurements"] == one["measurements"] == 9
    assert (many["processes"], one["processes"]) == (8, 1)
