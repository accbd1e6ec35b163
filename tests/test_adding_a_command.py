"""A command is added by its line in the table and one method: node, ground station and documentation take it up."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LINE = """
    CommandSpec(
        "blink",
        ObeyedBy.TUBE,
        "lights its lamp",
        (_argument("times", INTEGER, "flashes", unit="1", low=1, high=9, default=3),),
        (_result("times", INTEGER, "flashes", "1"),),
    ),
"""
METHOD = '''
    def blink(self, arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Light the lamp."""
        return CommandOutcome(True, "blinking", {"times": arguments["times"]})
'''
PROGRAM = """
import json, sys
from pathlib import Path
from groundstation.config import GroundConfig
from groundstation.errors import SelectorError
from groundstation.service.process.ground_process import GroundProcess
from node.firmware.tube_settings import TubeSettings
from node.process.tube_process import TubeProcess
folder = Path(sys.argv[1])
ground = GroundProcess(GroundConfig(folder=folder / "ground"))
ground.model.string.tally.restore([1])
order = ground.operator.order("blink", {"tube": "1", "times": "5"})
try:
    ground.operator.order("blink", {"tube": "1", "times": "10"})
except SelectorError as error:
    refused = str(error)
(command,) = ground.operator.take_pending()
ground.model.orders.on_reply(TubeProcess(TubeSettings(1), folder / "tube")._commands.obey(command))
print(json.dumps([refused, ground.operator.ask(f"orders/{order.number}")]))
ground.close()
sys.path.insert(0, "docs")
import make_tables
print(make_tables.tube_commands())
"""


@pytest.mark.slow
def test_a_line_and_a_method_make_a_command(tmp_path: Path) -> None:
    for package in ("telemetry", "node", "groundstation", "docs"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__", "results"))
    table = tmp_path / "telemetry" / "application" / "commands.py"
    begin = "COMMANDS: tuple[CommandSpec, ...] = ("
    table.write_text(table.read_text().replace(begin, begin + LINE))
    handlers = tmp_path / "node" / "process" / "command_handlers.py"
    handlers.write_text(handlers.read_text() + METHOD)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "state")],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    first, _, documented = done.stdout.partition("\n")
    refused, order = json.loads(first)
    assert refused == "parameter times: expected an integer of 1..9, got '10'"
    assert (order["state"], order["arguments"], order["values"]) == ("done", {"times": 5}, {"times": 5})
    assert "| `blink` | tube | lights its lamp |" in documented
