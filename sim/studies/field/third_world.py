"""What a third world found: disturbances that no row had, and constants that both worlds shared, drawn from ranges.

A node's rules were made in worlds that had one run-on of 0.3 s, one time constant, one threshold each. Here each seed
has others.
"""

from __future__ import annotations

from sim.studies.field.cases import BASE, FINE_HZ, MPU, DisturbanceCase
from sim.studies.field.drawn_constants import Between, merge_tables
from sim.studies.scenarios import Tables

TURNING = Between(78.0, 95.0)  # s after the start, in the first turning
RAMP = Between(55.4, 56.9)  # s after the start, while the head speeds up


def _world(hertz: float = 250.0, **tables: object) -> Tables:
    return merge_tables(BASE, {"rough": {"samples_hz": hertz}, **tables})


def _rough(hertz: float = 250.0, **tables: object) -> Tables:
    return _world(rough={"samples_hz": hertz, **tables})


def _befallen(name: str, **keys: object) -> Tables:
    return _world(disturbance={name: keys})


def _means_alone(setup: Tables) -> Tables:
    return merge_tables(setup, {"gyroscope": {"increments": False}})


def _play(run_on_s: object) -> Tables:
    return _rough(string={"backlash_deg": 0.1, "run_on_s": run_on_s})


def _leaning(setup: Tables) -> Tables:
    return {**setup, "path": {"straight": {"inclination_deg": 30.0}}}


def _late(off_ms: float) -> Tables:
    return _rough(FINE_HZ, sensor={**MPU, "crystal": Between(-0.02, 0.02), "delay_off_ms": off_ms})


SLIPPING = merge_tables(
    _rough(drive={"turns_back_deg": Between(2.0, 10.0)}),
    {"disturbance": {"joint-slips": {"slip_deg": Between(0.1, 1.0), "after_s": Between(2.0, 5.0)}}},
)
WITHOUT_AIDING = merge_tables(
    _rough(string={"twist_deg": Between(1.5, 3.0)}), {"aiding": {"on_s": Between(40.0, 80.0), "off_s": 30.0}}
)
CREEP = {"creep_dps": Between(0.005, 0.02)}
LET_GO = {
    "twist_deg": Between(0.1, 1.0),
    "wind_s": Between(15.0, 50.0),
    "hold_s": Between(2.0, 10.0),
    "unwind_s": Between(5.0, 30.0),
}
WHIRLING = {"lean_deg": Between(0.05, 0.3), "force_g": Between(0.05, 0.5), "hertz": Between(2.0, 8.0)}
LOST = (
    "edges missed at the rate of drilling are missed of every turn there: a gyroscope that shows too much does so too"
)
SLOW = "a bias that wanders by as much as its Allan floor allows shows the same, and so does gravity at 2 deg of lean"
WOUND = "a string that winds evenly below a head that turns evenly is a gyroscope whose scale is off"
UNWINDING = _leaning(_befallen("slow-twist", **LET_GO))
SEEN: tuple[Tables, ...] = (
    {"rough": {"drive": {"ripple": Between(0.05, 0.3), "ripple_s": Between(1.0, 8.0)}}},
    {"rough": {"encoder": {"eccentricity_deg": Between(0.01, 0.05)}}},
    {"rough": {"string": {"backlash_deg": Between(0.02, 0.2), "run_on_s": Between(0.1, 2.0)}}},
    {"rough": {"encoder": {"outliers": Between(0.005, 0.05)}}},
    {"rough": {"sensor": {"jitter_ms": Between(0.2, 2.0)}}},
    {"rough": {"sensor": {"g_sensitivity_dps_per_g": Between(0.01, 0.1)}}},
    {"rough": {"sensor": {"warm_up_dps": Between(0.05, 0.3), "warm_up_c": Between(2.0, 10.0)}}},
    {"rough": {"vibration": {"turning_g": Between(0.2, 2.0)}}},
    {"rough": {"vibration": {"torsional_dps": Between(1.0, 10.0)}}},
    {"rough": {"drive": {"turns_back_deg": Between(1.0, 10.0)}}},
    {"gyroscope": {"misalignment_std_deg": Between(0.01, 0.05)}},
    {"medium": {"loss": Between(0.02, 0.2)}},
)
UNSEEN: tuple[Tables, ...] = (
    {"disturbance": {"slow-twist": {"twist_deg": Between(0.05, 0.3), "wind_s": Between(10.0, 50.0)}}},
    {"disturbance": {"slow-twist": {"creep_dps": Between(0.001, 0.005)}}},
)
MILD: tuple[Tables, ...] = (*SEEN[:-1], *UNSEEN, *SEEN[-1:])

THIRD = (
    DisturbanceCase("stands-1", "encoder stands for 1.2 s", _befallen("counter-stands", after_s=TURNING, stands_s=1.2)),
    DisturbanceCase("stands-3", "encoder stands for 3 s", _befallen("counter-stands", after_s=TURNING, stands_s=3.0)),
    DisturbanceCase(
        "stands-20", "encoder stands for 20 s", _befallen("counter-stands", after_s=TURNING, stands_s=20.0)
    ),
    DisturbanceCase(
        "exchanged", "axes x and y exchanged", _befallen("axes-exchanged", after_s=TURNING), by_ground=True
    ),
    DisturbanceCase("creeps", "string creeps at rest, 0.005 to 0.02 deg/s", _befallen("slow-twist", **CREEP), SLOW),
    DisturbanceCase("creeps-30", "the same at 30 deg of lean", _leaning(_befallen("slow-twist", **CREEP))),
    DisturbanceCase(
        "let-go", "wound up slowly, 0.1 to 1 deg, let go at rest", _befallen("slow-twist", **LET_GO), WOUND
    ),
    DisturbanceCase("unwinds-slowly", "wound up slowly, let go at rest, at 30 deg of lean", UNWINDING, WOUND),
    DisturbanceCase("run-on", "backlash 0.1 deg, run-on within 0.1 to 3 s", _play(Between(0.1, 3.0))),
    DisturbanceCase("run-on-1", "backlash 0.1 deg, run-on within 1 s", _play(1.0)),
    DisturbanceCase("run-on-3", "backlash 0.1 deg, run-on within 3 s", _play(3.0)),
    DisturbanceCase(
        "lost-cycle", "a cycle lost on a ramp", _befallen("lost-cycles", after_s=RAMP, cycles=1), judges_ramps=True
    ),
    DisturbanceCase("late-0.5", "low-pass 0.5 ms off its data sheet", _late(0.5), has_state=True),
    DisturbanceCase("late-1", "low-pass 1 ms off its data sheet", _late(1.0), has_state=True),
    DisturbanceCase(
        "counts-lost",
        "counts lost above 40 to 65 deg/s, 2e-4 to 5e-3 of them",
        _befallen("counts-lost", above_dps=Between(40.0, 65.0), share=Between(2e-4, 5e-3)),
        LOST,
    ),
    DisturbanceCase("slips", "joint slips 0.1 to 1 deg at each turn back", SLIPPING),
    DisturbanceCase(
        "stick-slip-cycle",
        "stick-slip of 0.45 to 0.62 s, means alone",
        _means_alone(_rough(FINE_HZ, drive={"stick_slip": 1.0, "stick_slip_s": Between(0.45, 0.62)})),
    ),
    DisturbanceCase(
        "ripple-cycle",
        "ripple of 30 %, 0.48 to 0.58 s, means alone",
        _means_alone(_rough(FINE_HZ, drive={"ripple": 0.3, "ripple_s": Between(0.48, 0.58)})),
    ),
    DisturbanceCase("whirl", "forward whirl of 2 to 8 Hz", _world(FINE_HZ, disturbance={"whirl": WHIRLING})),
    DisturbanceCase("stuck-bit", "one bit of the counter stuck", _rough(encoder={"stuck_bit": Between(2, 6)})),
    DisturbanceCase(
        "stamp-step",
        "time stamps step by 20 ms",
        _means_alone(_rough(sensor={"stamp_step_ms": 20.0, "stamp_step_s": TURNING})),
    ),
    DisturbanceCase("twist-unaided", "untold twist of 1.5 to 3 deg, 30 s without aiding", WITHOUT_AIDING),
    DisturbanceCase("bad-day", "a bad day: five to eight mild ones", _world(FINE_HZ), f"{WOUND}; {SLOW}", mild=MILD),
    DisturbanceCase("bad-day-rigid", "a bad day of a string that neither winds nor creeps", _world(FINE_HZ), mild=SEEN),
)
