from pathlib import Path

import pytest

from sim.errors import ScenarioError
from sim.node_kills import KillNode, parse_fault
from sim.world.scenario import load_scenario
from telemetry.messages import BASE, ENCODER

SCENARIOS = Path(__file__).parents[2] / "scenarios"


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.toml")), ids=lambda p: p.stem)
def test_every_shipped_scenario_is_valid(path: Path) -> None:
    assert load_scenario(path).tubes >= 2


def test_every_key_is_documented_or_says_it_all() -> None:
    from sim.world.scenario_file import ScenarioFile

    for section in ScenarioFile.model_fields.values():
        annotation = section.annotation
        if isinstance(annotation, type) and hasattr(annotation, "model_fields"):
            assert annotation.__doc__


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("kill-node:3@600", KillNode(3, 600.0, 10.0)),
        ("kill-node:12@0.5+20.25", KillNode(12, 0.5, 20.25)),
        ("kill-node:encoder@600", KillNode(ENCODER, 600.0, 10.0)),
        ("kill-node:base@600+40", KillNode(BASE, 600.0, 40.0)),
    ],
)
def test_faults_are_read(text: str, expected: KillNode) -> None:
    fault = parse_fault(text, 20)
    assert fault == expected == parse_fault(str(fault), 20)


@pytest.mark.parametrize("text", ["", "kill-node:0@5", "kill-node:21@5", "kill-node:3", "kill-node:3@-5", "burn:3@5"])
def test_what_is_no_fault_is_refused(text: str) -> None:
    with pytest.raises(ScenarioError, match="expected"):
        parse_fault(text, 20)
