"""Hours of one rig under faults: nothing grows but what its disks hold, and nothing is wrong."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from borechain.cli.gauntlet import gauntlet
from borechain.gauntlet.soak import SoakSample, run_soak


def test_what_a_soak_needed_is_a_table_and_a_picture(tmp_path: Path) -> None:
    first, second = (SoakSample(h, 100.0 + h, 200_000, 3.0, 12, 60.0 * h, int(6 * h), (), 20.0 * h) for h in (1.0, 2.0))
    gauntlet._keep([first, second], tmp_path / "new")
    header, *rows = (tmp_path / "new" / "soak.csv").read_text().splitlines()
    assert header.startswith("hours,memory_mib")
    assert [row.split(",")[0] for row in rows] == ["1", "2"]
    assert (tmp_path / "new" / "soak.svg").read_text().rstrip().endswith("</svg>")


def test_a_folder_for_nothing_is_refused(tmp_path: Path) -> None:
    refused = CliRunner().invoke(gauntlet.gauntlet, ["--seeds", "1", "--out", str(tmp_path)])
    assert refused.exit_code == 2
    assert "--soak" in refused.output


@pytest.mark.statistical
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("hours", [3.0])
def test_a_rig_under_faults_for_hours_does_not_grow(hours: float) -> None:
    samples = list(run_soak(hours, 1))
    first, last = samples[len(samples) // 3], samples[-1]
    assert last.violations == ()
    assert last.objects < 1.05 * first.objects
    assert last.handles <= first.handles
    assert last.surveys > 0
