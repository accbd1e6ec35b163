"""``borechain rig`` into a file: a line for whatever happens, and who may join from the beginning on."""

import re
from pathlib import Path

from rigs import free_endpoint, run

LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ +\d+\.\d s (\w+) +(.+)")


def test_a_run_into_a_file_is_a_line_a_phase_survey_verdict_and_restart(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    done = run("rig", "rig-3", "--endpoint", endpoint, "--out", str(tmp_path / "run"), "--fault", "kill-node:1@70+20")
    assert done.returncode == 0, done.stderr
    lines = [match.groups() for match in map(LINE.fullmatch, done.stdout.splitlines()) if match]
    kinds = [kind for kind, _ in lines]
    assert lines[0] == ("open", f"{endpoint}: borechain crew --endpoint {endpoint} --rig rig-1")
    phases = [text.partition(",")[0] for kind, text in lines if kind == "phase"]
    assert phases == [
        "starting",
        *(f"{what} tube {n}" for n in (1, 2, 3) for what in ("add", "drill", "stop")),
        "finish tube 3",
    ]
    assert kinds.count("survey") == 6
    verdicts = [text for kind, text in lines if kind == "verdict"]
    assert verdicts[0] == "DON'T KNOW: no station has been surveyed yet"
    assert verdicts[-1].startswith("ON TARGET: ends ")
    assert "alarm" in kinds
    assert "digest " in done.stdout
