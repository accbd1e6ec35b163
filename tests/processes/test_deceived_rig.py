"""A rig whose world is not as its crew believes: the same over processes as in one."""

import json
from pathlib import Path

from forked_commands import run as run_forked
from rigs import running_rig

DECEIVED = """
[rig]
tubes = 2
tube_length_m = 2.0
[path.drawn]
kind = "soft"
seed = 4
inclination_deg = 3.0
[path.moved]
after_s = 200.0
from_m = 1.0
to_m = 2.5
east_deg = 0.4
[schedule]
add_s = 55.0
[rotation]
turns = 2.3
[joints]
mount_tilt_std_deg = 0.3
[told]
joint_tube = 2
joint_deg = 4.0
north_deg = 1.5
lengths_off_m = [0.05]
depth_scale = 0.01
depth_offset_m = 0.02
depth_std_m = 0.003
depth_stuck_after_s = 100.0
depth_stuck_s = 5.0
[disturbance.play]
sigma_deg = 0.05
bow_deg = 0.05
[disturbance.mount-slip]
tube = 2
after_s = 180.0
pitch_deg = 0.3
turn_deg = 2.0
[disturbance.force-step]
tube = 1
after_s = 150.0
step_mg = [1.0, -2.0, 0.5]
creep_mg_per_s = [0.01, 0.0, 0.0]
[disturbance.calibration-exchanged]
raw_mg = 3.0
[disturbance.axes-exchanged]
tube = 1
after_s = 220.0
"""


def test_a_world_unlike_what_is_told_is_one_result_over_processes_and_inline(tmp_path: Path) -> None:
    scenario = tmp_path / "deceived.toml"
    scenario.write_text(DECEIVED)
    done = run_forked("rig", scenario, "--inline", "--json", "--out", tmp_path / "inline", "--seed", "6", timeout=240.0)
    inline = json.loads(done.stdout.splitlines()[-1])
    with running_rig(tmp_path, "--seed", "6", scenario=str(scenario)) as rig:
        assert rig.result()["digest"] == inline["digest"]
    scenario.write_text(DECEIVED.partition("[path.moved]")[0] + "[schedule]\nadd_s = 55.0\n[rotation]\nturns = 2.3\n")
    done = run_forked("rig", scenario, "--inline", "--json", "--out", tmp_path / "honest", "--seed", "6", timeout=240.0)
    honest = json.loads(done.stdout.splitlines()[-1])
    assert honest["figures"]["inclination_rms_deg"] < 0.05
    assert inline["figures"]["inclination_rms_deg"] > 2.0 * honest["figures"]["inclination_rms_deg"]
