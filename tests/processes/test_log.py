"""``borechain rig`` into a file: a line for whatever happens; recorded meanwhile, a replay gives the same digest."""

import re
import signal
from pathlib import Path

from rigs import free_endpoint, run, started

from borechain.crew.log import RunLog

LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ +\d+\.\d s (\w+) +(.+)")


def test_a_run_is_logged_a_line_for_whatever_happens_and_its_recording_gives_the_same_stations(tmp_path: Path) -> None:
    endpoint, recording = free_endpoint(), tmp_path / "run.mcap"
    recorder = started("record", str(recording), "--endpoint", endpoint)
    done = run("rig", "rig-3", "--endpoint", endpoint, "--out", str(tmp_path / "run"), "--fault", "kill-node:1@70+20")
    recorder.send_signal(signal.SIGINT)
    try:
        _, said = recorder.communicate(timeout=60.0)
    finally:
        recorder.kill()
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
    assert recorder.returncode == 0, said
    assert "not whole" not in said
    again = run("replay", str(recording))
    assert again.returncode == 0, again.stderr
    digest = next(line for line in done.stdout.splitlines() if line.startswith("digest "))
    assert again.stdout.splitlines()[-1] == digest


def test_a_survey_whose_news_was_lost_on_the_way_is_told_in_the_end_and_every_one_once() -> None:
    alike = {"tube": 1, "inclination_deg": 1.0, "azimuth_deg": 40.0, "trust": "full"}
    rows = [alike | {"seq": n, "md_m": 2.0 * n, "replaces": 7 if n == 3 else None} for n in (1, 2, 3)]
    answers = {
        "measurements": {"measurements": rows},
        "alarms": {"open": [], "closed": []},
        "verdict": {"verdict": "on target", "line": "ON TARGET"},
        "wall": {"wall": None},
    }
    lines: list[str] = []
    log = RunLog(lines.append)
    for row in rows[::2]:  # the second does not come
        log.on_answer("measurements", {"measurements": [row]})
    for _ in range(2):
        log.poll(lambda path, _parameters: answers[path], since=0)
    told = [match[2] for match in map(LINE.fullmatch, lines) if match]
    assert [text.split(" deg")[0] for text in told] == [
        *(f"tube 1 at {md:.2f} m: 1.00" for md in (2.0, 6.0, 4.0)),
        "ON TARGET",
    ]
    assert [text.endswith(", again") for text in told] == [False, True, False, False]
