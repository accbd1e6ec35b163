"""A whole rig in real processes."""

import contextlib
import csv
import json
import math
import os
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from forked_commands import run as run_forked
from rigs import REPOSITORY, ends, free_endpoint, run, running_rig, started, titles_of_group

from groundstation.service.disk.ground_store import Store
from telemetry.media.zenoh_bus import open_client
from telemetry.messages import Event, SurveyMeasurement

GROUND = "borechain/*/ground"
LONG = 900.0  # s, for ten tubes on a machine that others use


def drill(folder: Path, *arguments: str) -> dict[str, Any]:
    with running_rig(folder, *arguments) as rig:
        return rig.result()


def drill_inline(folder: Path, *arguments: str, scenario: Path | str = "rig-3") -> dict[str, Any]:
    """A rig in one process, which connects to nothing and starts nothing."""
    done = run_forked("rig", scenario, "--inline", "--json", "--out", folder / "run", *arguments, timeout=240.0)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))


@pytest.fixture(scope="module")
def inline(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """Result of the rig in one process with seed 5, and the folder of its run."""
    folder = tmp_path_factory.mktemp("inline")
    return drill_inline(folder, "--seed", "5"), folder / "run"


def test_three_tubes_give_three_stations_near_the_truth_and_leave_nothing_running(
    tmp_path: Path, inline: tuple[dict[str, Any], Path]
) -> None:
    with running_rig(tmp_path, "--seed", "5", by=()) as rig:
        result = rig.result()
        assert ends(rig.process.pid)
    assert [s["measurements"] for s in result["stations"]] == [3, 2, 1]
    assert [s["md_m"] for s in result["stations"]] == [2.0, 4.0, 6.0]
    assert result["figures"]["inclination_rms_deg"] < 0.03
    assert result["figures"]["toe_error_m"] < 0.005
    assert max(result["figures"]["yaw_rms_deg_by_hop"]) < 0.05
    assert result["processes"] == 6
    with (rig.out / "stations.csv").open() as file:
        assert [float(row["md_m"]) for row in csv.DictReader(file)] == [2.0, 4.0, 6.0]
    assert json.loads((rig.out / "result.json").read_text())["digest"] == result["digest"]
    assert (inline[0]["processes"], inline[0]["stations"]) == (1, result["stations"])
    assert inline[0]["digest"] == result["digest"]


def test_two_imus_in_every_tube_make_surveys_of_less_noise(tmp_path: Path) -> None:
    for file in (REPOSITORY / "scenarios").glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    scenario = tmp_path / "cluster.toml"
    scenario.write_text((REPOSITORY / "scenarios" / "rig-3.toml").read_text() + "\n[node]\nimus = 2\n")
    stations = drill_inline(tmp_path, "--seed", "3", scenario=scenario)["stations"]
    assert [s["measurements"] for s in stations] == [3, 2, 1]
    one = math.radians(0.02) * 9.81 / math.sqrt(32.0)  # of a mean, with one IMU
    for station in stations:
        assert station["sigma_force_mps2"] == pytest.approx(one / math.sqrt(2.0), rel=0.15)


def test_a_string_that_twists_is_surveyed_released_and_goes_on_at_every_joint(tmp_path: Path) -> None:
    for file in (REPOSITORY / "scenarios").glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    text = (REPOSITORY / "scenarios" / "torsion-10.toml").read_text()
    scenario = tmp_path / "torsion-3.toml"
    scenario.write_text(text.replace("tubes = 10", "tubes = 3"))
    result = drill_inline(tmp_path, "--seed", "1", scenario=scenario)
    assert [s["measurements"] for s in result["stations"]] == [3, 2, 1]
    assert max(result["figures"]["yaw_rms_deg_by_hop"]) < 0.1  # 1.1 deg a tube under torque
    with contextlib.closing(Store(f"sqlite:///{tmp_path / 'run' / 'state' / 'ground' / 'ground.sqlite'}")) as store:
        codes = [stored.message.code for stored in store.messages() if isinstance(stored.message, Event)]
    assert codes.count("joint_solved") == 2
    assert "string_released" in codes
    assert not {"gyro_step", "gyro_scale", "joint_contradicts_marks"} & set(codes)


def test_another_seed_gives_another_result(tmp_path: Path, inline: tuple[dict[str, Any], Path]) -> None:
    assert drill_inline(tmp_path, "--seed", "6")["digest"] != inline[0]["digest"]


@pytest.mark.statistical
def test_the_seed_alone_decides_the_result_whatever_the_load(
    tmp_path: Path, inline: tuple[dict[str, Any], Path]
) -> None:
    with contextlib.ExitStack() as stack:
        for _ in range(os.cpu_count() or 1):
            rival = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            stack.callback(rival.wait)
            stack.callback(rival.kill)
        pressed = drill(tmp_path / "pressed", "--seed", "5")
    assert pressed["processes"] == 6
    assert pressed["stations"] == inline[0]["stations"]
    assert pressed["digest"] == inline[0]["digest"]


@pytest.mark.statistical
@pytest.mark.parametrize("transport", ["can", "mixed"])
def test_the_transport_of_the_joints_decides_nothing(
    tmp_path: Path, transport: str, inline: tuple[dict[str, Any], Path]
) -> None:
    assert drill(tmp_path / transport, "--seed", "5", "--transport", transport)["digest"] == inline[0]["digest"]


def test_a_scenario_names_the_media_of_its_joints(tmp_path: Path) -> None:
    for file in (REPOSITORY / "scenarios").glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    scenario = tmp_path / "mixed.toml"
    text = (REPOSITORY / "scenarios" / "rig-3.toml").read_text()
    turn = '\n[medium]\ntransports = ["zenoh", "can", "can-classic"]\n'
    scenario.write_text(text.replace("tubes = 3", "tubes = 2") + turn)
    with running_rig(tmp_path / "can", "--seed", "5", scenario=str(scenario)) as rig:
        carried = rig.result()
    assert drill_inline(tmp_path / "inline", "--seed", "5", scenario=scenario)["digest"] == carried["digest"]


def test_the_native_profile_moves_the_result_by_next_to_nothing(
    tmp_path: Path, inline: tuple[dict[str, Any], Path]
) -> None:
    native = drill_inline(tmp_path, "--seed", "5", "--transport", "can-native")
    assert native["digest"] != inline[0]["digest"]
    yaw, azimuth = moved((native, tmp_path / "run"), inline)
    assert yaw < 0.002
    assert azimuth < 0.02


def moved(one: tuple[dict[str, Any], Path], other: tuple[dict[str, Any], Path]) -> tuple[float, float]:
    """By how much two runs differ, deg: rms of the surveys' yaws, most of the stations' azimuths."""
    yaws = [yaws_of(folder) for _, folder in (one, other)]
    assert yaws[0].keys() == yaws[1].keys()
    apart = [math.degrees(math.remainder(yaws[0][key] - yaws[1][key], math.tau)) for key in yaws[0]]
    turns = [
        math.remainder(ours["azimuth_deg"] - theirs["azimuth_deg"], 360.0)
        for ours, theirs in zip(one[0]["stations"], other[0]["stations"], strict=True)
    ]
    return math.sqrt(sum(a * a for a in apart) / len(apart)), max(map(abs, turns))


def yaws_of(folder: Path) -> dict[tuple[int, int], float]:
    """Yaws (rad) of the surveys in the store of a run, by tube and place: an event more takes a number too."""
    with contextlib.closing(Store(f"sqlite:///{folder / 'state' / 'ground' / 'ground.sqlite'}")) as store:
        surveys = [stored.message for stored in store.messages() if isinstance(stored.message, SurveyMeasurement)]
    found: dict[tuple[int, int], float] = {}
    places: Counter[int] = Counter()
    for survey in sorted(surveys, key=lambda survey: (survey.tube, survey.sequence)):
        places[survey.tube] += 1
        found[survey.tube, places[survey.tube]] = survey.yaw
    return found


@pytest.fixture(scope="module")
def wellbore(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """Result of wellbore 1, ten tubes, in one process with seed 1, and the folder of its run."""
    folder = tmp_path_factory.mktemp("wellbore")
    return drill_inline(folder, "--seed", "1", scenario="wellbore-1"), folder / "run"


@pytest.mark.statistical
@pytest.mark.timeout(LONG)
@pytest.mark.parametrize("transport", ["zenoh", "can", "can-classic", "mixed"])
def test_wellbore_1_is_the_same_over_every_medium(
    tmp_path: Path, transport: str, wellbore: tuple[dict[str, Any], Path]
) -> None:
    words = ("--speed", "max", "--seed", "1", "--transport", transport)
    with running_rig(tmp_path, *words, scenario="scenarios/wellbore-1.toml") as rig:
        result = rig.result(LONG)
    print(f"wellbore 1 over {transport}: digest {result['digest']}")
    assert result["digest"] == wellbore[0]["digest"]


@pytest.mark.statistical
def test_the_native_profile_moves_wellbore_1_by_next_to_nothing(
    tmp_path: Path, wellbore: tuple[dict[str, Any], Path]
) -> None:
    native = drill_inline(tmp_path, "--seed", "1", "--transport", "can-native", scenario="wellbore-1")
    yaw, azimuth = moved((native, tmp_path / "run"), wellbore)
    print(f"wellbore 1 on the native profile: yaw {yaw:.6f} deg rms, azimuth at most {azimuth:.6f} deg from the exact")
    assert native["digest"] != wellbore[0]["digest"]
    assert yaw <= 0.002
    assert azimuth <= 0.02


@pytest.mark.parametrize("words", [("--inline", "--transport", "can"), ("--transport", "can-native")])
def test_a_transport_that_this_way_of_running_has_not_is_refused(tmp_path: Path, words: tuple[str, ...]) -> None:
    done = run_forked("rig", "rig-3", "--out", str(tmp_path / "run"), *words)
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)
    assert f"--transport {words[-1]}: expected" in done.stderr
    assert not (tmp_path / "run").exists()


def test_one_process_a_tube_and_none_after_an_interrupt(tmp_path: Path) -> None:
    expected = {"borechain medium", "borechain encoder", "borechain ground", "borechain node 1"}
    with running_rig(tmp_path, "--speed", "1") as rig:
        rig.until(lambda: expected <= set(titles_of_group(rig.process.pid).values()))
        os.killpg(rig.process.pid, signal.SIGINT)
        _, errors = rig.process.communicate(timeout=60.0)
        assert rig.process.returncode == 1
        assert "interrupted" in errors
        assert "Traceback" not in errors
        assert ends(rig.process.pid)


def test_operators_get_stations_while_the_rig_drills(tmp_path: Path, ask: Any) -> None:
    with running_rig(tmp_path, "--speed", "8") as rig:

        def two_stations() -> Any:
            view = ask(rig, f"{GROUND}/trajectory")
            return view if view and len(view["points"]) >= 3 else None

        so_far = rig.until(two_stations)
        assert [p["md_m"] for p in so_far["points"]][:3] == [0.0, 2.0, 4.0]
        in_range = ask(rig, f"{GROUND}/trajectory?md=1..3")
        assert [p["md_m"] for p in in_range["points"]] == [2.0]
        between = ask(rig, f"{GROUND}/trajectory?md=1.5")
        assert [p["md_m"] for p in between["points"]] == [1.5]
        assert {m["station"] for m in ask(rig, f"{GROUND}/measurements?station=2")["measurements"]} == {2}
        region = ask(rig, f"{GROUND}/uncertainty?confidence=0.9")
        assert [s["md_m"] for s in region["stations"]][:3] == [0.0, 2.0, 4.0]
        assert (
            0.0
            < region["stations"][2]["plan_ellipse"]["minor_m"]
            < region["stations"][2]["plan_ellipse"]["major_m"]
            < 0.01
        )
        assert set(region["stations"][2]["sources"]) == {
            "random",
            "joints",
            "collar",
            "north",
            "mounts",
            "accelerometer_bias",
            "depth",
            "path",
        }
        column = ask(rig, f"{GROUND}/column")
        assert column["design"]["tolerance"] == "en-12716"
        assert column["worst"]["deviation_cm"] > 0.0
        assert column["projection"]["along_m"] == 6.0
        assert ask(rig, f"{GROUND}/alarms")["levels_percent"] == [50, 80, 100]
        shown = run_forked("query", f"{GROUND}/stations", "--endpoint", rig.endpoint, "--json")
        assert shown.returncode == 0
        assert len(json.loads(shown.stdout)["stations"]) >= 2
        wrong = run_forked("query", f"{GROUND}/trajektory", "--endpoint", rig.endpoint)
        assert wrong.returncode == 2
        for name in ("trajectory", "stations", "nodes/{tube}"):
            assert name in wrong.stderr
        refused = run_forked("query", f"{GROUND}/trajectory?depth=3", "--endpoint", rig.endpoint)
        assert refused.returncode == 2
        assert "md" in refused.stderr
        taken = run("query", "borechain/rig-1/cmd/take_survey?tube=1", "--endpoint", rig.endpoint, "--timeout", "40")
        assert taken.returncode == 0, taken.stderr
        assert json.loads(taken.stdout)["done"] is True


def test_a_column_that_leaves_its_tolerance_raises_alarms(scenario: Path, tmp_path: Path) -> None:
    scenario.write_text(
        scenario.read_text() + '\n[design]\ninclination_deg = 10.0\nazimuth_deg = 90.0\ntolerance = "5-cm"\n'
    )
    result = drill_inline(tmp_path, scenario=scenario)
    assert {(a["kind"], a["level_percent"]) for a in result["alarms"]} == {
        (kind, level) for kind in ("deviation", "projection") for level in (50, 80, 100)
    }
    assert result["column"]["worst"]["used_percent"] > 100.0


def test_an_operator_who_does_not_read_stops_nobody(tmp_path: Path) -> None:
    with running_rig(tmp_path, "--speed", "60") as rig:
        rig.pid_of("borechain node 1")
        with started("watch", f"{GROUND}/**", "--endpoint", rig.endpoint) as watcher:
            try:
                assert watcher.stdout.readline().startswith("{")
                os.kill(watcher.pid, signal.SIGSTOP)
                result = rig.result()
            finally:
                watcher.kill()
    assert result["measurements"] == 6
    assert result["restarts"] == 0


def test_power_cut_of_a_node_makes_all_below_stale_and_loses_no_survey(tmp_path: Path) -> None:
    """Tube 2 of 3 loses power at 302 s, while the string turns, for 15 s."""
    began, cut, down = 1000.0, 302.0, 15.0
    seen: list[dict[str, Any]] = []
    fault = f"kill-node:2@{cut:g}+{down:g}"
    with (
        running_rig(tmp_path, "--speed", "40", "--fault", fault) as rig,
        open_client(rig.endpoint, timeout=60.0) as bus,
    ):
        bus.subscribe("borechain/*/ground/string", lambda _key, payload: seen.append(json.loads(payload)))
        bus.subscribe("borechain/*/ground/nodes/2", lambda _key, payload: seen.append(json.loads(payload)))
        result = rig.result()
    strings = [view for view in seen if "tubes" in view]
    five_seconds_on = [v for v in strings if began + cut + 5.0 <= v["rig_time_s"] < began + cut + down]
    assert five_seconds_on
    for view in five_seconds_on:
        assert {row["tube"]: row["stale"] for row in view["tubes"]} == {3: False, 2: True, 1: True}
    after = [v for v in strings if v["rig_time_s"] > began + cut + down + 10.0]
    assert after
    assert not any(row["stale"] for row in after[-1]["tubes"])
    back = [v for v in seen if v.get("tube") == 2 and v["at_s"] > began + cut + down]
    assert "restored" in back[0]["flags"]
    assert back[-1]["sigma_yaw_deg"] < 0.1
    assert result["measurements"] == 6
    assert max(result["figures"]["yaw_rms_deg_by_hop"]) < 0.05


def test_a_node_killed_from_outside_is_restarted_and_loses_no_survey(tmp_path: Path, ask: Any) -> None:
    with running_rig(tmp_path, "--speed", "20") as rig:
        rig.until(lambda: (ask(rig, f"{GROUND}/status") or {}).get("measurements"))
        os.kill(rig.pid_of("borechain node 1"), signal.SIGKILL)
        rig.until(lambda: "restored" in {e["code"] for e in ask(rig, f"{GROUND}/events?tube=1")["events"]})
        result = rig.result()
    assert result["restarts"] == 1
    assert result["measurements"] == 6


def test_a_ground_station_killed_from_outside_keeps_every_survey(tmp_path: Path, ask: Any) -> None:
    with running_rig(tmp_path, "--speed", "20") as rig:
        rig.until(lambda: (ask(rig, f"{GROUND}/status") or {}).get("measurements"))
        os.kill(rig.pid_of("borechain ground"), signal.SIGKILL)
        result = rig.result()
    assert result["restarts"] == 1
    assert [s["measurements"] for s in result["stations"]] == [3, 2, 1]


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    text = (Path(__file__).parents[2] / "scenarios" / "rig-3.toml").read_text()
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    (tmp_path / "wellbore-1-path.csv").write_text("md_m,a_cm,b_cm\n0,0,0\n2,-0.25,0.1\n4,-1,0.5\n6,-2,0.75\n")
    return path


def refused(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    endpoint = () if "--endpoint" in arguments else ("--endpoint", free_endpoint())
    done = run_forked("rig", str(path), *endpoint, *arguments, cwd=path.parent)
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    return done


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (("tubes = 3", "tubes = 3\ncolour = 1"), "rig.colour"),
        (("tube_length_m = 2.0", "tube_length_m = -2.0"), "rig.tube_length_m"),
        (("turns = 5", "turns = 5\nrate_dps = 343"), "57 rev/min"),
        (("tubes = 3", "tubes = 4"), "drill fewer tubes"),
        (("[rig]", "[rig"), "not TOML"),
        (("wellbore-1-path.csv", "missing.csv"), "missing.csv"),
    ],
)
def test_a_scenario_that_cannot_be_is_refused_in_one_line(scenario: Path, change: tuple[str, str], named: str) -> None:
    scenario.write_text(scenario.read_text().replace(*change))
    before = sorted(scenario.parent.rglob("*"))
    done = refused(scenario)
    assert done.returncode == 2
    assert named in done.stderr
    assert sorted(scenario.parent.rglob("*")) == before


@pytest.mark.parametrize(
    ("rows", "named"),
    [("0,0,0\n4,1,0\n2,1,0\n", "turns back"), ("0,0,0\n2,nonsense,0\n", "line 3"), ("0,0,0\n2,900,0\n", "cannot be")],
)
def test_a_path_that_cannot_be_is_refused_in_one_line(scenario: Path, rows: str, named: str) -> None:
    (scenario.parent / "wellbore-1-path.csv").write_text("md_m,a_cm,b_cm\n" + rows)
    done = refused(scenario)
    assert done.returncode == 2
    assert named in done.stderr


@pytest.mark.parametrize("fault", ["kill-node:9@100", "kill-node:3@10", "melt:3@100"])
def test_a_fault_that_cannot_be_is_refused_in_one_line(scenario: Path, fault: str) -> None:
    done = refused(scenario, "--fault", fault)
    assert done.returncode == 2
    assert fault in done.stderr


def test_a_missing_scenario_names_the_file(tmp_path: Path) -> None:
    done = refused(tmp_path / "nowhere.toml")
    assert done.returncode == 2
    assert "nowhere.toml" in done.stderr


def test_a_busy_port_names_the_remedy(scenario: Path, tmp_path: Path) -> None:
    with running_rig(tmp_path / "other", "--speed", "1") as rig:
        rig.pid_of("borechain node 1")
        done = refused(scenario, "--endpoint", rig.endpoint, "--out", str(tmp_path / "second"))
    assert done.returncode == 1
    assert "--endpoint" in done.stderr
    assert not (tmp_path / "second").exists()


@pytest.mark.parametrize("folder", ["/proc/borechain", "stations.csv/run"])
def test_an_output_folder_that_cannot_be_written_names_the_remedy(scenario: Path, folder: str) -> None:
    (scenario.parent / "stations.csv").write_text("a file, not a folder")
    done = refused(scenario, "--out", folder)
    assert done.returncode == 1
    assert "--out" in done.stderr


def test_an_earlier_run_is_not_continued(scenario: Path, tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "result.json").write_text("{}")
    done = refused(scenario, "--out", str(tmp_path / "old"))
    assert done.returncode == 1
    assert (tmp_path / "old" / "result.json").read_text() == "{}"


def test_asking_where_nobody_is_says_so() -> None:
    done = run_forked("query", f"{GROUND}/status", "--endpoint", "tcp/127.0.0.1:1", "--timeout", "0.5")
    assert done.returncode == 1
    assert "is the rig running" in done.stderr
