"""Every file that is read, by kind: what reads it, its ending, and good files that are the begin of every change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from groundstation.calibration.calibration_records import read_attitudes, read_turn_table
from groundstation.calibration.matrix_files import read_matrix
from groundstation.calibration.mwd_files import read_mwd
from groundstation.plan_settings import read_plan
from groundstation.recording.recording_file import Recording
from groundstation.survey.files.field_files import read_any
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.wall.wall_file import read_wall
from sim.world.scenario import load_scenario
from telemetry.errors import CalibrationError
from telemetry.records.logged_cells import read_logged_cells

REPOSITORY = Path(__file__).parents[2]
STATIONS = b"md_m,inclination_deg,azimuth_deg\n0,0,0\n3,1.5,20\n6,2,25\n9,2.5,30\n"
DISPLACEMENTS = b"md_m,a_cm,b_cm\n0,0,0\n2,-0.25,0.1\n4,-1,0.5\n6,-2,0.75\n"
MWD = b"tilt_deg,tool_face_deg,temperature_c,a_v,b_v,c_v\n" + b"".join(
    b"%d,%d,25,0.1,0.2,1.5\n" % (k, 30 * k) for k in range(12)
)
LOGGED = b"t_s,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g\n0,1,2,3,0,0,1\n0.1,1,2,3,0,0,1\n0.2,1,2,3,0,0,1\n"
MATRIX = b"matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n"
PLAN = b"[[leg]]\nlength_m = 4.0\nbuild_deg_per_m = 0.1\n[[leg]]\nlength_m = 3.0\n"
LAS = b"""~Version
 VERS. 2.0 : CWLS LOG ASCII STANDARD
 WRAP. NO :
~Well
 STRT.M 0 :
 STOP.M 6 :
 STEP.M 3 :
 NULL. -999.25 :
~Curve
 DEPT.M : depth
 INCL.DEG : inclination
 AZIM.DEG : azimuth
~ASCII
0 0 0
3 1 20
6 2 25
"""
XML = (
    b'<?xml version="1.0"?><trajectorys xmlns="http://www.witsml.org/schemas/1series" version="1.4.1.1"><trajectory>'
    b'<trajectoryStation uid="1"><md uom="m">0</md><incl uom="dega">0</incl><azi uom="dega">0</azi></trajectoryStation>'
    b'<trajectoryStation uid="2"><md uom="m">3</md><incl uom="dega">1</incl><azi uom="dega">9</azi></trajectoryStation>'
    b"</trajectory></trajectorys>"
)


@dataclass(frozen=True, slots=True)
class FileKind:
    """One kind of file: how it ends, what reads it, and what good ones hold."""

    name: str
    ending: str
    read: Callable[[Path], object]
    seeds: tuple[bytes, ...]


def _files(*patterns: str, largest: int = 300_000) -> tuple[bytes, ...]:
    found = [path for pattern in patterns for path in sorted(REPOSITORY.glob(pattern))]
    return tuple(path.read_bytes() for path in found if path.stat().st_size <= largest)


def _turn_table(path: Path) -> object:
    """At the rates of the two that are kept."""
    try:
        return read_turn_table(path, 720.0)
    except CalibrationError:
        return read_turn_table(path, 200.0)


def _recording(path: Path) -> object:
    recording = Recording(path)
    return sum(len(sample.payload) for sample in recording.samples())


SURVEYS = _files("tests/data/survey/iscwsa_mwd*well_1.csv")
COMPANIONS = {
    path.name: path.read_bytes()
    for folder in ("scenarios", "scenarios/walls")
    for path in (REPOSITORY / folder).glob("*.csv")
}  # that the files name beside them
GROUPS: dict[str, tuple[FileKind, ...]] = {
    "recordings": (
        FileKind("recording", ".mcap", _recording, _files("tests/data/releases/*/run.mcap", largest=1 << 20)),
    ),
    "tools": (
        FileKind(
            "tool",
            ".toml",
            lambda path: load_tool(str(path)),
            _files("groundstation/survey/tools/models/*.toml", "tests/data/survey/*.toml"),
        ),
    ),
    "scenarios": (FileKind("scenario", ".toml", load_scenario, _files("scenarios/*.toml")),),
    "tables": (
        FileKind("survey table", ".csv", read_any, (STATIONS, DISPLACEMENTS, *SURVEYS)),
        FileKind("LAS", ".las", read_any, (LAS,)),
        FileKind("WITSML", ".xml", read_any, (XML,)),
        FileKind("plan of legs", ".toml", read_plan, (PLAN,)),
        FileKind("plan of stations", ".csv", read_plan, (STATIONS,)),
        FileKind("wall", ".toml", read_wall, _files("scenarios/walls/*.toml")),
        FileKind("attitudes", ".csv", read_attitudes, _files("tests/data/calibration/*accel.csv")),
        FileKind("turn table", ".csv", _turn_table, _files("tests/data/calibration/*gyro*.csv")),
        FileKind("matrix", ".toml", read_matrix, (MATRIX,)),
        FileKind("MWD record", ".csv", read_mwd, (MWD,)),
        FileKind("logger", ".csv", read_logged_cells, (LOGGED,)),
    ),
}
