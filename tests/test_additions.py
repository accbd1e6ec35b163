"""A command, a medium, a study and an instrument are added by what they are and one line in a table.

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
    def blink(self, arguments: Mapping[str, Any], _sequence: int) -> Outcome:
        \"\"\"Light the lamp.\"\"\"
        return Outcome(True, "blinking", {"times": arguments["times"]})
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
            (ResultTable("{throws} throws", (("case", "case"), ("ours", "ours")), (("case", "case"), ("ours",
            "ours"))),), (Option("throws", 4, 1, 10),), drawn=False,
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
ADDITIONS = (COMMAND, MEDIUM, STUDY, INSTRUMENT)


def add(folder: Path, addition: Addition) -> None:
    path = folder / addition.table
    before, head, after = path.read_text().partition(addition.head)
    assert head, f"{addition.table}: no {addition.head!r}"
    if head.endswith("by_name(\n"):  # the list opens on one of the next lines
        opening, bracket, after = after.partition("[\n")
        head += opening + bracket
    path.write_text(before + head + addition.line + after)
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
            tube = TubeProcess(TubeSettings(3), pathlib.Path(folder)).tube
            handlers = CommandHandlers(tube, None, lambda first, last: (0, 0))
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
