"""A command, a medium, a study, an instrument, an answer and a field are added by what they are and a line in a table.

The additions are written into a copy of the packages, into the files that docs/architecture.md names and no others.
"""

import json
import os
import shutil
import subprocess
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
PACKAGES = ("borechain", "groundstation", "node", "sim", "telemetry")


@dataclass(frozen=True)
class Addition:
    """One kind of thing: a line after the head of its table, and text at the end of files, new or old."""

    row: str  # of the table in docs/architecture.md
    table: str
    head: str
    line: str
    files: dict[str, str]
    named: str  # how the row names the file or folder of what is added
    imports: str = ""  # that the line needs


COMMAND = Addition(
    row="a command",
    table="telemetry/application/commands.py",
    head="COMMANDS: tuple[CommandSpec, ...] = (\n",
    line="""
    CommandSpec(
        "blink",
        ObeyedBy.TUBE,
        "lights its lamp",
        (_argument("times", INTEGER, "flashes", unit="1", low=1, high=9, needed=True),),
        (_result("times", INTEGER, "flashes to come", "1"),),
    ),
""",
    files={
        "node/process/command_handlers.py": """
    def blink(self, arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        \"\"\"Light the lamp.\"\"\"
        return CommandOutcome(True, "blinking", {"times": arguments["times"]})
"""
    },
    named="node/process/command_handlers.py",
)
MEDIUM = Addition(
    row="a medium",
    table="telemetry/media/media_table.py",
    head="MEDIA: dict[str, str] = {\n",
    line='    "tin-can": "telemetry.media.tin_can",\n',
    files={"telemetry/media/tin_can.py": "from telemetry.media.memory import open_medium\n"},
    named="open_medium(where)",
)
STUDY = Addition(
    row="a study",
    table="sim/studies/study_table.py",
    head="STUDIES = by_name(\n",
    line="""
        Study(
            "coin",
            "Whether a coin is fair.",
            f"{MODULES}.coin",
            (ResultTable("{throws} throws", (("case",) * 2, ("ours",) * 2), (("case",) * 2, ("ours",) * 2)),),
            (Option("throws", 4, 1, 10),),
            drawn=False,
        ),
""",
    files={
        "sim/studies/coin/__init__.py": "",
        "sim/studies/coin/run.py": """
def count_steps(throws):
    return throws


def run_study(throws, step):
    for _ in range(throws):
        step()
    return {"experiment": "coin", "throws": throws, "cases": [{"case": "heads", "ours": 0.25}]}
""",
    },
    named="run.py",
)
INSTRUMENT = Addition(
    row="an instrument that writes records",
    table="sim/instruments/instrument_table.py",
    head="INSTRUMENTS = by_name(\n",
    line='        Instrument("plumb", "a plumb line", f"{MODULES}.plumb_line"),\n',
    files={
        "sim/instruments/plumb_line.py": """
from sim.instruments.instrument import Records


def simulate_records(seed):
    return Records({"plumb.csv": b"angle_deg\\n0\\n"}, {"plumb": {"seed": seed}})
"""
    },
    named="simulate_records(seed)",
)
DISTURBANCE = Addition(
    row="a disturbance",
    table="sim/world/disturbance/disturbance_table.py",
    head="TABLE: Final[tuple[Disturbance, ...]] = (\n",
    line="    HUM,\n    CREAK,\n",
    imports="from sim.world.disturbance.hum import CREAK, HUM\n",
    files={
        "sim/world/disturbance/hum.py": """
import math

import numpy as np

from sim.kernel import shared_body
from sim.world.disturbance.lanes import Lane
from sim.world.disturbance.row import ActsOn, Compiled, Disturbance
from sim.world.section import NotNegative, ScenarioSection
from sim.world.random_streams import random_stream

PURPOSE = 99


class HumSection(ScenarioSection):
    size_rps: NotNegative = 0.0
    noise_rps: NotNegative = 0.0


def draw(imu):
    section = imu.section_of(HUM)
    return section.size_rps * float(random_stream(imu.seed, PURPOSE, imu.tube).random()), section.noise_rps


def hum(samples, imu, drawn):
    size, noise = drawn
    white = noise / math.sqrt(1.9 * samples.period)
    white = white * random_stream(imu.seed, PURPOSE, imu.tube, 1).standard_normal(len(samples.t))
    samples.rate = samples.rate + np.outer(size * np.sin(0.01 * samples.t) + white, [0.0, 0.0, 1.0])


def set_tube(tube, drawn):
    tube["hum"], tube["hum_noise"] = drawn


@shared_body
def read_hum(_shared, tube, now, drawn, at, row):
    row[2] += tube.hum * math.sin(0.01 * now.end) + tube.hum_noise * drawn[at]


FORM = Compiled(tube=(("hum", "f8"), ("hum_noise", "f8")), set_tube=set_tube, lane=Lane.NEXT, read=read_hum)
HUM = Disturbance("hum", (), ActsOn.SAMPLES, hum, draw, FORM, section=HumSection)


def creak(samples, imu, _):
    samples.force = samples.force + imu.section_of(CREAK).size_rps


CREAK = Disturbance("creak", (), ActsOn.SAMPLES, creak, section=HumSection)
"""
    },
    named="sim/world/disturbance/wander.py",
)
ANSWER = Addition(
    row="an answer of the ground station",
    table="groundstation/service/answers/answer_table.py",
    head="    for answer in (\n",
    line='        AnswerKey("mud", MudAnswer, "the mud that comes back; ?tube=3", ("tube",), on_page=True),\n',
    files={
        "groundstation/service/answers/shapes/mud_shapes.py": """
from typing import Annotated

from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class


@answer_class
class MudAnswer:
    \"\"\"The mud that comes back.\"\"\"

    colour: Annotated[str | None, "as it is seen", OneOf("grey", "brown")]
    weights: Annotated[list[float], "of the samples"]
""",
        "groundstation/service/answers/string_views.py": """

from groundstation.service.answers.shapes.mud_shapes import MudAnswer


@view_of(MudAnswer)
def answer_mud(k: RigModel, p: Parameters) -> MudAnswer:
    \"\"\"The mud that comes back.\"\"\"
    return MudAnswer("grey", [1.0, float(p.get("tube", 2))])
""",
    },
    named="groundstation/service/answers/shapes",
    imports="from groundstation.service.answers.shapes.mud_shapes import MudAnswer\n",
)
FIELD = Addition(
    row="a field of an answer",
    table="groundstation/service/answers/shapes/column_shapes.py",
    head="    steer: Steer | None\n",
    line='    mud_c: Annotated[float, "temperature of the mud"] = 12.5\n',
    files={},
    named="groundstation/service/answers/verdict_views.py",
)
ADDITIONS = (COMMAND, MEDIUM, STUDY, INSTRUMENT, DISTURBANCE, ANSWER, FIELD)


def add(folder: Path, addition: Addition) -> None:
    path = folder / addition.table
    before, head, after = path.read_text().partition(addition.head)
    assert head, f"{addition.table}: no {addition.head!r}"
    if head.endswith("by_name(\n"):  # the list opens on one of the next lines
        opening, bracket, after = after.partition("[\n")
        head += opening + bracket
    future = "from __future__ import annotations\n"
    path.write_text(before.replace(future, future + addition.imports, 1) + head + addition.line + after)
    for name, text in addition.files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        with (folder / name).open("a") as file:
            file.write(text)


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The packages with all additions."""
    folder = tmp_path_factory.mktemp("copy")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "docs", folder / "docs", ignore=shutil.ignore_patterns("decisions", "results", "*.png"))
    for addition in ADDITIONS:
        add(folder, addition)
    return folder


def run(copy: Path, *words: str) -> str:
    """Output of Python in the copy."""
    environment = os.environ | {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(copy / "cache")}
    done = subprocess.run(
        [sys.executable, *words], cwd=copy, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def program(text: str) -> str:
    return textwrap.dedent(text)


@pytest.mark.parametrize("addition", ADDITIONS, ids=lambda a: a.row)
def test_the_guide_names_the_files(addition: Addition) -> None:
    text = (ROOT / "docs" / "architecture.md").read_text()
    (row,) = [line for line in text.splitlines() if line.startswith(f"| {addition.row} |")]
    assert f"`{addition.table}`" in row
    assert addition.named in row


def test_a_tube_obeys_an_added_command_and_its_ranges_hold(copy: Path) -> None:
    out = run(copy, "-c", program("""
        import pathlib, sys, tempfile
        from node.firmware.tube_settings import TubeSettings
        from node.process.command_handlers import CommandHandlers
        from node.process.tube_process import TubeProcess
        from telemetry.application.arguments import parse_parameters
        from telemetry.application.commands import find_command
        from telemetry.messages import Command

        given = parse_parameters(find_command("blink"), {"tube": "3", "times": "2"})
        with tempfile.TemporaryDirectory() as folder:
            process = TubeProcess(TubeSettings(3), pathlib.Path(folder))
            handlers = CommandHandlers(process.tube, None, lambda first, last: (0, 0), process._board)
            for sequence, arguments in enumerate((given, {"times": 10}, {})):
                reply = handlers.obey(Command(3, sequence, "blink", arguments))
                print(reply.done, reply.detail, reply.values, sep="|")
    """))  # fmt: skip
    obeyed, beyond, missing = out.splitlines()
    assert obeyed == "True|blinking|{'times': 2}"
    assert beyond.startswith("False|")
    assert "[1, 9], got 10" in beyond
    assert missing.startswith("False|")
    assert "times" in missing


def test_frames_cross_an_added_medium(copy: Path) -> None:
    out = run(copy, "-c", program("""
        from telemetry.media.port import PortFrame, TubeEnd
        from telemetry.media.media_table import open_medium
        from telemetry.messages import Side

        with open_medium("tin-can:garden") as medium:
            lower_end = TubeEnd("rig", 2, Side.LOWER, 1)
            upper, lower = medium.open_port(lower_end), medium.open_port(lower_end.facing)
            lower.listen(print)
            upper.send(PortFrame(b"hello"))
            upper.close()
            lower.close()
    """))  # fmt: skip
    assert out == "b'hello'\n"


def test_an_added_study_runs_as_every_other(copy: Path) -> None:
    assert "Whether a coin is fair" in run(copy, "-m", "borechain", "experiment", "list")
    out = run(copy, "-m", "borechain", "experiment", "coin", "--throws", "2", "--json", "--out", str(copy / "out"))
    assert json.loads(out)["throws"] == 2
    assert (copy / "out" / "coin.csv").read_text() == "case,ours\nheads,0.25\n"


def test_an_added_instrument_writes_its_records(copy: Path) -> None:
    out = run(copy, "-c", program("""
        from sim.instruments.instrument_table import INSTRUMENTS

        records = INSTRUMENTS["plumb"].records(3)
        print(records.files["plumb.csv"], records.truth)
    """))  # fmt: skip
    assert out == "b'angle_deg\\n0\\n' {'plumb': {'seed': 3}}\n"


def run_with_firmware(copy: Path, home: Path, *words: str) -> str:
    """Output of Python in the copy, which has the compiled firmware of this checkout and compiles its own world."""
    from node.kernels.arithmetic.jit import cache_folder, folder_in_use

    kept = home / "borechain" / cache_folder().name
    if not kept.exists():
        rooms = [room for room in folder_in_use().iterdir() if room.name.startswith("node.kernels.")]
        for room in rooms:
            shutil.copytree(room, kept / room.name)
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(copy), "XDG_CACHE_HOME": str(home)}
    done = subprocess.run(
        [sys.executable, *words], cwd=copy, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_an_added_disturbance_acts_in_a_plain_rig_a_rough_rig_and_a_campaign_or_is_refused_there(
    copy: Path, tmp_path: Path
) -> None:
    """The mean of what it adds is the same in all of them, and so is the spread, within 5 sigma of 150 cycles."""
    out = run_with_firmware(copy, tmp_path, "-c", program("""
        import json
        import numpy as np
        from sim.campaign.chunk import Campaign
        from sim.errors import ScenarioError
        from sim.string.hops import draw_hops
        from sim.string.reading_suppliers import draw_readings
        from sim.world.scenario import scenario_of
        from sim.world.world import World

        PLAIN = {
            "rig": {"tubes": 1, "tubes_at_start": 1, "tube_length_m": 2.0},
            "path": {"straight": {}},
            "schedule": {"add_s": 90.0, "stop_s": 24.0, "finish_s": 5.0},
            "rotation": {"turns": 2.0},
            "medium": {"link": "off"},
        }
        ROUGH = PLAIN | {"rough": {"samples_hz": 250.0, "sensor": {"frames_hz": 50.0, "low_pass_hz": 20.0}}}

        def with_hum(tables, name="hum", **keys):
            return scenario_of(tables | {"disturbance": {name: keys}})

        def of_rig(scenario):
            return World(scenario, 3).sensors.samples(1)[:150, 2]

        def of_campaign(scenario):
            string, world = Campaign(scenario).string, World(scenario, 3)
            drawn, hops = string.new_readings(world), draw_hops(world)
            field = None if string.rough is None else string.rough.run(world).field
            rows = np.zeros(150)
            for cycle in range(150):
                draw_readings(drawn, field, string.schedule, hops, cycle)
                rows[cycle] = drawn.readings[0, 0, 2]
            return rows

        found = {}
        for name, tables in (("plain", PLAIN), ("rough", ROUGH)):
            for where, read in (("rig", of_rig), ("campaign", of_campaign)):
                off = read(scenario_of(tables))
                hum = read(with_hum(tables, size_rps=0.1)) - off
                noise = read(with_hum(tables, noise_rps=0.1)) - off
                found[f"{name} {where}"] = [hum.mean(), hum.std(), noise.mean(), noise.std()]
        for tables in (PLAIN, ROUGH):
            creaking = with_hum(tables, "creak", size_rps=1.0)
            quiet = World(scenario_of(tables), 3).sensors.samples(1)
            assert np.abs(World(creaking, 3).sensors.samples(1) - quiet).max() > 0.9
            try:
                Campaign(creaking)
            except ScenarioError as error:
                found["refused"] = str(error)
        try:
            with_hum(PLAIN, "hum", size=1.0)
        except ScenarioError as error:
            found["misspelt"] = str(error)
        surveys = [Campaign(with_hum(PLAIN, size_rps=size)).chunk(1, 1).epochs["yaw_error"] for size in (0.0, 0.01)]
        found["changes what nodes know"] = bool((surveys[0] != surveys[1]).any())
        print(json.dumps(found))
    """))  # fmt: skip
    found = json.loads(out)
    wanted = found["plain rig"]
    for where in ("plain campaign", "rough rig", "rough campaign"):
        assert found[where][:2] == pytest.approx(wanted[:2], abs=1e-3), where
        assert abs(found[where][2]) < 5.0 * 0.1 / 150**0.5
        assert found[where][3] == pytest.approx(0.1, rel=0.3), where
    assert wanted[1] > 5e-3
    assert found["refused"].startswith("disturbance.creak: a campaign cannot express it; borechain rig runs")
    assert "disturbance.hum: size: unknown key" in found["misspelt"]
    assert found["changes what nodes know"]


DESCRIBED = """
    import json, pathlib, sys, tempfile
    sys.path.insert(0, "docs")
    import make_asyncapi, make_page_types, make_tables
    from borechain.client import AnsweredVerdict, shape_answer
    from groundstation.config import GroundConfig
    from groundstation.gateway.page.openapi import openapi_document
    from groundstation.service.answers.model import RigModel
    from groundstation.service.answers.paths import find_path

    model = RigModel.begin(GroundConfig(folder=pathlib.Path(tempfile.mkdtemp())))
    def answered(path, **parameters):
        return json.loads(find_path(model, path).json(model, parameters))
"""


def test_an_added_field_is_wherever_its_answer_is_described(copy: Path) -> None:
    """JSON, schema, OpenAPI, AsyncAPI, docs/keys.md, client and page's type, from one line in the class."""
    out = run(copy, "-c", program(DESCRIBED) + program("""
        verdict, schemas = answered("verdict"), answered("schema")["schemas"]
        asked = openapi_document("1")["paths"]["/api/verdict"]["get"]["responses"]["200"]["content"]["application/json"]
        told = make_asyncapi.document()["components"]["messages"]["verdict"]["payload"]
        print(json.dumps({
            "json": verdict["mud_c"],
            "schemas": [schemas["verdict"], asked["schema"], told],
            "page": make_tables.answers(),
            "client": shape_answer(AnsweredVerdict, verdict).mud_c,
            "types": make_page_types.types_text(),
        }))
    """))  # fmt: skip
    found = json.loads(out)
    assert (found["json"], found["client"]) == (12.5, 12.5)
    for schema in found["schemas"]:
        assert schema["properties"]["mud_c"] == {"type": "number", "description": "temperature of the mud"}
        assert "mud_c" in schema["required"]
    assert "| `mud_c` | number | temperature of the mud |" in found["page"]
    assert "  /** temperature of the mud */\n  mud_c: number;\n" in found["types"]


def test_an_added_answer_is_asked_for_followed_and_described(copy: Path) -> None:
    out = run(copy, "-c", program(DESCRIBED) + program("""
        print(json.dumps({
            "json": [answered("mud"), answered("mud", tube="3")],
            "schema": answered("schema")["schemas"]["mud"],
            "parameters": openapi_document("1")["paths"]["/api/mud"]["get"]["parameters"],
            "channel": make_asyncapi.document()["channels"]["mud"]["address"],
            "heard": "hear_mud" in make_asyncapi.document()["operations"],
            "keys": make_tables.key_table(),
            "types": make_page_types.types_text(),
        }))
    """))  # fmt: skip
    found = json.loads(out)
    assert [answer["weights"] for answer in found["json"]] == [[1.0, 2.0], [1.0, 3.0]]
    assert list(found["json"][0]) == ["revision", "utc", "rig_time_s", "colour", "weights"]
    colour = {"anyOf": [{"type": "string", "enum": ["grey", "brown"]}, {"type": "null"}]}
    assert found["schema"]["properties"]["colour"] == colour | {"description": "as it is seen"}
    assert [parameter["name"] for parameter in found["parameters"]] == ["tube"]
    assert (found["channel"], found["heard"]) == ("borechain/{rig}/ground/mud", True)
    assert "| `borechain/{rig}/ground/mud` | query, publish | the mud that comes back; ?tube=3 |" in found["keys"]
    assert '  colour: "grey" | "brown" | null;\n' in found["types"]
    assert "  mud: AnswerHeader & MudAnswer;\n" in found["types"]
