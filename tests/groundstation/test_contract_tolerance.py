"""The contract's tolerance of a live hole: any sum that a plan takes, and refused by name where it is none."""

from pathlib import Path

import pytest

from groundstation.config import checked_config
from groundstation.errors import ConfigurationError


@pytest.mark.parametrize(
    ("text", "along", "limit"),
    [("50 mm + 1:200", 20.0, 0.15), ("75 mm at 20 m", 10.0, 0.0375), ("en-12716", 20.0, 0.45), ("5-cm", 20.0, 0.05)],
)
def test_a_live_hole_has_the_limit_of_its_contract(tmp_path: Path, text: str, along: float, limit: float) -> None:
    design = checked_config(rig="r", folder=tmp_path, tolerance=text).design
    assert design.tolerance.at(along) == pytest.approx(limit)
    assert design.tolerance.name == text


def test_a_limit_that_is_none_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"^tolerance: .*'50 mm \+ 1:200'.*got '5 bananas'"):
        checked_config(rig="r", folder=tmp_path, tolerance="5 bananas")
