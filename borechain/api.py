"""The program for notebooks and scripts: what the commands do, as functions with values instead of text.

Load a scenario and drill it in this process, compute surveys and walls, calibrate, ask a running ground station. SI and
radians inside the values; names with a unit (``md_m``, ``inclination_deg``) mean that unit. Errors are of
``BorechainError`` and say in one line what was expected and what came. Examples: docs/api.md.
"""

from __future__ import annotations

import datetime
import json
import math
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from telemetry.errors import BorechainError, InputError, MediumError

if TYPE_CHECKING:
    from borechain.drilling.rig_job import DrilledRig, RigJob, RigWatcher
    from groundstation.calibration.attitudes import AttitudeFit
    from groundstation.recording.recording_file import Recording
    from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
    from groundstation.report.calibrations.calibration_request import CalibrationRequest
    from groundstation.survey.requests.clearance_request import ClearanceRequest
    from groundstation.survey.requests.survey_answer import SurveyAnswer
    from groundstation.survey.requests.survey_request import SurveyRequest
    from groundstation.survey.wall.wall_file import Wall
    from groundstation.survey.wall.wall_joints import Joints
    from groundstation.survey.wall.wall_verdict import Judgement
    from groundstation.survey.well.analysis import Analysis
    from groundstation.survey.well.error_sources import Site
    from sim.world.scenario import Scenario

__all__ = [
    "BorechainError",
    "InputError",
    "JudgedWall",
    "answer_clearance",
    "answer_survey",
    "calibrate",
    "calibrate_attitudes",
    "calibrate_turntable",
    "drill",
    "drill_rig",
    "load",
    "query",
    "replay",
    "scenarios",
    "survey",
    "wall",
]


@dataclass(frozen=True, slots=True)
class JudgedWall:
    """A wall, its joints and the verdict; ``worst`` is the index of the most doubtful joint and of its depth."""

    wall: Wall
    joints: Joints
    worst: tuple[int, int]
    judgement: Judgement

    @property
    def is_tight(self) -> bool:
        """Whether the wall is proven to be tight."""
        from groundstation.survey.wall.wall_verdict import WallVerdict

        return self.judgement.verdict is WallVerdict.TIGHT

    def to_result(self) -> dict[str, Any]:
        """The object that ``borechain wall --json`` prints."""
        from groundstation.survey.requests.wall_result import wall_result

        return wall_result(self.wall, self.judgement)


def scenarios() -> list[str]:
    """Names of the scenarios that come with the program."""
    from sim.world.shipped import shipped_names

    return shipped_names()


def load(scenario: str | Path, faults: tuple[str, ...] = ()) -> Scenario:
    """Read and check a scenario: a name of ``scenarios``, or a file.

    Raises
    ------
    ScenarioError
        The file, the key, what was expected and what came.
    """
    from sim.world.scenario import load_scenario

    return load_scenario(Path(scenario), faults)


def drill(scenario: Scenario, seed: int = 1, folder: Path | None = None) -> dict[str, Any]:
    """Drill a scenario in this process, without a bus; the same bits as the rig of processes.

    Parameters
    ----------
    scenario : of ``load``
    seed : one seed, one result
    folder : new or empty, keeps database and saved states; without one nothing is kept

    Returns
    -------
    The object that ``borechain rig --json`` prints: ``stations``, ``figures``, ``station_digest`` and more.

    Raises
    ------
    RigError
        When the folder is in use, or the schedule cannot be drilled.
    """
    if folder is not None:
        return _drill(scenario, seed, folder)
    with tempfile.TemporaryDirectory(prefix="borechain-") as place:
        return _drill(scenario, seed, Path(place))


def _drill(scenario: Scenario, seed: int, folder: Path) -> dict[str, Any]:
    from borechain.drilling.drill_hole import drill_inline
    from borechain.drilling.rig_job import RigJob, show_nothing
    from sim.rig.launcher import prepare_folder
    from sim.rig.rig_result import rig_result
    from sim.world.world import World

    world = World(scenario, seed)
    prepare_folder(folder)
    run = drill_inline(world, RigJob(Path("scenario"), seed, math.inf, inline=True), folder, show_nothing)
    return rig_result(run.answers, world)


def drill_rig(job: RigJob, watcher: RigWatcher | None = None) -> DrilledRig:
    """Drill as ``borechain rig`` does: a real process a tube, or inline; a scenario with a site hole by hole.

    Raises
    ------
    ScenarioError
        When the scenario cannot be drilled; nothing was written.
    RigError, MediumError
        When the folder or the endpoint cannot be used, a process fails, or on Ctrl-C.
    """
    from borechain.drilling import drill_rig as rigs
    from borechain.drilling.rig_job import RigWatcher

    return rigs.drill_rig(job, watcher or RigWatcher())


def survey(
    file: str | Path,
    *,
    method: str | None = None,
    instrument: str = "relay",
    displacement_rule: str = "exact",
    site: Site | None = None,
    section_azimuth: float = 0.0,
    hole: str | None = None,
) -> Analysis:
    """Trajectory and region of uncertainty of a record of stations or of lateral displacements.

    Parameters
    ----------
    file : stations in any format that ``borechain survey`` reads, or displacements
    method, instrument, displacement_rule, hole : as the options of ``borechain survey``; the method is that of the
        record's form where it is None
    site : gravity, magnetic field and latitude; the default is that of the command, and a magnetic instrument has none
    section_azimuth : of the vertical section, rad

    Warns
    -----
    UserWarning
        Of every value that is missing or hardly can be; ``answer_survey`` has them as rows.

    Raises
    ------
    SurveyError, ToolError
        When the record or the instrument cannot be used.
    """
    from groundstation.survey.files.field_files import read_any
    from groundstation.survey.files.field_table import TableWish
    from groundstation.survey.files.survey_records import DisplacementRule
    from groundstation.survey.requests.site_place import known_site
    from groundstation.survey.requests.survey_answer import magnetic_needs, survey_warnings
    from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures
    from groundstation.survey.tools.instruments import load_tool
    from groundstation.survey.well.analysis import analyse_survey, default_method
    from groundstation.survey.well.methods import Method
    from groundstation.survey.well.reference_frames import ReferenceFrame

    tool = load_tool(instrument)
    place = site or known_site(SiteFigures(), FrameRequest(), magnetic_needs([tool])).figures.to_site()
    understood = read_any(Path(file), DisplacementRule(displacement_rule), TableWish(hole=hole))
    record, north = understood.record, understood.north or "site"
    for warning in survey_warnings(record):
        warnings.warn(f"{file}: {warning.text}", stacklevel=2)
    path = default_method(record) if method is None else Method(method)
    return analyse_survey(record, path, tool, place, section_azimuth, ReferenceFrame(north, north))


def answer_survey(request: SurveyRequest) -> SurveyAnswer:
    """A survey with everything that ``borechain survey`` may be asked for; ``result`` is the object of its ``--json``.

    Raises
    ------
    SurveyError, ToolError
        When the record, the instrument or a file cannot be used, or what is asked contradicts itself.
    """
    from groundstation.survey.requests import survey_answer

    return survey_answer.answer_survey(request)


def answer_clearance(request: ClearanceRequest) -> dict[str, Any]:
    """How far two holes keep from each other: the object of ``borechain clearance --json``.

    Raises
    ------
    SurveyError, ToolError
        When a record or an instrument cannot be used.
    """
    from groundstation.survey.requests import clearance_answer

    return clearance_answer.answer_clearance(request)


def wall(file: str | Path) -> JudgedWall:
    """Every joint of a wall or grid: distance, thickness, probability of less than is required; and the verdict.

    Raises
    ------
    SurveyError
        When the file or one that it names cannot be used.
    """
    from groundstation.survey.wall.judged_wall import judge_wall
    from groundstation.survey.wall.wall_file import read_wall
    from groundstation.survey.wall.wall_joints import worst_joint

    found = read_wall(Path(file))
    judgement = judge_wall(found)
    return JudgedWall(found, judgement.joints, worst_joint(judgement.joints), judgement)


def calibrate_turntable(file: str | Path, reference: float) -> AttitudeFit:
    """Matrix and bias of a triad from a turn table's record, with their standard errors.

    ``reference`` is the true rate or specific force of the first column of each pair, in the unit of the file, which
    is also the unit of the result.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    from groundstation.calibration.attitudes import fit_attitudes
    from groundstation.calibration.calibration_records import read_turn_table
    from groundstation.calibration.turntable import as_observations

    record = read_turn_table(Path(file), reference)
    return fit_attitudes(*as_observations(record.positive, record.negative, reference))


def calibrate_attitudes(file: str | Path) -> AttitudeFit:
    """Matrix (m/s^2 per g) and bias (m/s^2) of an accelerometer from mean readings at preset pitch and roll.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    from groundstation.calibration.attitudes import fit_attitudes, true_vectors
    from groundstation.calibration.calibration_records import read_attitudes

    record = read_attitudes(Path(file))
    return fit_attitudes(true_vectors(record.pitch, record.roll), record.readings)


def calibrate(request: CalibrationRequest, day: datetime.date | None = None) -> CalibrationOutcome:
    """What ``borechain calibrate`` and ``allan`` make of a record: ``result`` is the object of their ``--json``.

    ``day`` of the calibration is that of today in UTC by default.

    Raises
    ------
    CalibrationError
        The file and line, what was expected and what came.
    """
    from groundstation.report.calibrations.calibration_answer import answer_calibration

    return answer_calibration(request, (day or datetime.datetime.now(datetime.UTC).date()).isoformat())


def replay(recording: Recording, folder: Path) -> dict[str, Any]:
    """What a new ground station in ``folder`` knows after a recording: the object of ``borechain replay --json``.

    Raises
    ------
    RecordingError
        When the recording holds no intake that can be replayed.
    """
    from groundstation.recording.ground_replay import replay_summary
    from sim.rig.report import station_digest

    known = replay_summary(recording, folder)
    return known | {"digest": station_digest(known["stations"])}


def query(selector: str, endpoint: str | None = None, timeout: float = 5.0) -> dict[str, Any]:
    """What a running ground station answers to ``selector`` (docs/keys.md), by key; on this machine by default.

    Raises
    ------
    MediumError
        When no answer comes within ``timeout`` (s), or the ground station refuses.
    """
    from telemetry import keys  # walls and surveys do without its messages
    from telemetry.media.zenoh_bus import open_client

    endpoint = endpoint or keys.DEFAULT_ENDPOINT
    with open_client(endpoint, timeout) as bus:
        replies = bus.get(selector, timeout)
    answers = {reply.key: json.loads(reply.payload) for reply in replies if reply.error is None}
    if not answers:
        reason = replies[0].error if replies else f"no answer from {endpoint}"
        raise MediumError(f"{selector}: {reason}")
    return answers
