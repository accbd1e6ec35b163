"""A rig of real processes that is weighed while it drills."""

import csv
import json
import sqlite3
from pathlib import Path

import pytest
from rigs import free_endpoint, run

from borechain.load.hour import Scales
from sim.rig.processes import ProcessTable


def test_a_database_that_is_not_there_or_has_no_tables_yet_weighs_what_it_weighs(tmp_path: Path) -> None:
    database = tmp_path / "ground.sqlite"
    table = ProcessTable({}, [])
    assert Scales(table, database, 1.0).kept() == (0.0, 0)
    with sqlite3.connect(database) as connection:
        connection.execute("pragma user_version = 1")
    assert Scales(table, database, 1.0).kept() == (database.stat().st_size / 1e3, 0)


@pytest.mark.process
def test_every_process_is_weighed_while_it_drills_and_what_came_of_it_is_told(tmp_path: Path) -> None:
    words = ("--tubes", "2", "--seconds", "20", "--speed", "10", "--endpoint", free_endpoint())
    done = run("bench", "hour", *words, "--out", str(tmp_path / "new"), "--json")
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert (result["surveys"], result["missing"], result["restarts"]) == (4, 0, 0)
    rows = list(csv.DictReader((tmp_path / "new" / "hour.csv").read_text().splitlines()))
    assert {row["process"] for row in rows} == {"medium", "encoder", "base", "1", "2"}
    assert all(float(row["private_mb"]) > 0.0 and int(row["handles"]) > 0 for row in rows)
    surveys = [int(row["surveys"]) for row in rows if row["process"] == "base"]
    assert surveys == sorted(surveys)
    assert surveys[-1] == 4
    assert float(rows[-1]["hours"]) > 0.0
    assert (tmp_path / "new" / "hour.svg").read_text().rstrip().endswith("</svg>")
