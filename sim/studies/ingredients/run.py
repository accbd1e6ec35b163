"""What each ingredient of the node buys: the laboratory string with one of them switched off at a time.

Everything else stays as shipped, and the published form ends the list. Without delay compensation the aiding is 10 ms
old and dated by its arrival, and no time-stamp state makes up for it. Without the zero-rate update a node does not
know that it stands: it integrates its gyroscope and does not level. At rest the firmware's encoder gives one
measurement, so such a node has nothing but that; the variant beside it gets a new one every cycle. The values beside
ours are the ranges that a study of the published scheme found at rest over the update modes.
"""

from __future__ import annotations

from typing import Any

from sim.string.plain_encoder import LINES
from sim.studies.lab import LAB, REST, ROTATING
from sim.studies.pool import Step
from sim.studies.published_form.published_forms import DELAY_MS, FORMS, run_published, setup_of
from sim.studies.scenarios import Tables, change_sections, on_off
from sim.studies.trials import interval_row, over_seeds, rms_deg

MODES = {"continuous": on_off(20.0, 0.0), "20 s on / 30 s off": on_off(20.0, 30.0)}
LATE = change_sections(LAB, medium={"delay_ms": DELAY_MS, "dated_by": "arrival"}, node={"tuning": {"stamp_std": 0.0}})
INSTANTANEOUS = {"instantaneous": True}
UNSTILL = change_sections(LAB, node={"tuning": {"still_rate": 0.0}})
INGREDIENTS: dict[str, Tables] = {
    "as shipped": LAB,
    "no scale-factor state": change_sections(LAB, node={"tuning": {"scale_std": 0.0}}),
    "no delay compensation, instantaneous rate": change_sections(LATE, gyroscope=INSTANTANEOUS),
    "no delay compensation": LATE,
    "instantaneous rate": change_sections(LAB, gyroscope=INSTANTANEOUS),
    "no edge times": change_sections(LAB, encoder={"counts_per_turn": 4 * LINES, "edge_times": False}),
    "no edge times, no quadrature": change_sections(LAB, encoder={"counts_per_turn": LINES, "edge_times": False}),
    "no zero-rate update": UNSTILL,
    "no zero-rate update, new measurements at rest": change_sections(UNSTILL, aiding={"renumbered": True}),
    **{form: setup_of(LAB, form) for form in FORMS},
}
STUDIED_DEG: dict[str, tuple[float, float]] = {
    "no scale-factor state": (0.3, 4.0),
    "no delay compensation, instantaneous rate": (0.6, 6.0),
    "published scheme": (0.24, 1.8),
}
WINDOWS = {"yaw, rotating": ROTATING, "yaw, at rest": REST}


def count_steps(seeds: int) -> int:
    """Runs of one seed."""
    return seeds * len(MODES) * len(INGREDIENTS)


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """Rows of every ingredient, mode of aiding and window."""
    cases = []
    with over_seeds(seeds, step, run_published) as run_all:
        for name, setup in INGREDIENTS.items():
            studied = "-".join(f"{end:g}" for end in STUDIED_DEG.get(name, ())) or None
            for mode, link in MODES.items():
                runs = run_all(change_sections(setup, aiding=link))
                for quantity, window in WINDOWS.items():
                    figure = rms_deg([r.error[window, 0] for r in runs])
                    beside = studied if window is REST else None
                    cases.append({"mode": mode, **interval_row(name, quantity, figure, published=beside)})
    return {"experiment": "ingredients", "seeds": seeds, "cases": cases}
