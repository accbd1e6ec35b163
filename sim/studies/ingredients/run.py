"""What each ingredient of the node buys: the laboratory string with one of them switched off at a time.

Everything else stays as shipped, and the published form ends the list. Without delay compensation the aiding is 10 ms
old and dated by its arrival, and no time-stamp state makes up for it. Without the zero-rate update a node does not
know that it stands: it integrates its gyroscope and does not level. At rest the firmware's encoder gives one
measurement, so such a node has nothing but that; the variant beside it gets a new one every cycle. The values beside
ours are the ranges that a study of the published scheme found at rest over the update modes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sim.rig.plain_encoder import LINES
from sim.studies.links import OnOff
from sim.studies.node_lab import REST, ROTATING, LabSetup
from sim.studies.pool import Step
from sim.studies.published_form import DELAY, FORMS, setup_of
from sim.studies.trials import rms_deg, row, trials

OURS = LabSetup()
MODES = {"continuous": OnOff(), "20 s on / 30 s off": OnOff(20.0, 30.0)}
LATE = replace(OURS, delay=DELAY, dated_by_arrival=True, config=(("stamp_std", 0.0),))
UNSTILL = replace(OURS, config=(("still_rate", 0.0),))
INGREDIENTS: dict[str, LabSetup] = {
    "as shipped": OURS,
    "no scale-factor state": replace(OURS, config=(("scale_std", 0.0),)),
    "no delay compensation, instantaneous rate": replace(LATE, instantaneous=True),
    "no delay compensation": LATE,
    "instantaneous rate": replace(OURS, instantaneous=True),
    "no edge times": replace(OURS, counts_per_turn=4 * LINES),
    "no edge times, no quadrature": replace(OURS, counts_per_turn=LINES),
    "no zero-rate update": UNSTILL,
    "no zero-rate update, new measurements at rest": replace(UNSTILL, renumbered=True),
    **{form: setup_of(OURS, form) for form in FORMS},
}
STUDIED_DEG: dict[str, tuple[float, float]] = {
    "no scale-factor state": (0.3, 4.0),
    "no delay compensation, instantaneous rate": (0.6, 6.0),
    "published scheme": (0.24, 1.8),
}
WINDOWS = {"yaw, rotating": ROTATING, "yaw, at rest": REST}


def steps(seeds: int) -> int:
    """Runs of one seed."""
    return seeds * len(MODES) * len(INGREDIENTS)


def run(seeds: int, step: Step) -> dict[str, Any]:
    """Rows of every ingredient, mode of aiding and window."""
    cases = []
    with trials(seeds, step) as run_all:
        for name, setup in INGREDIENTS.items():
            studied = "-".join(f"{end:g}" for end in STUDIED_DEG.get(name, ())) or None
            for mode, link in MODES.items():
                runs = run_all(replace(setup, link=link))
                for quantity, window in WINDOWS.items():
                    figure = rms_deg([r.error[window, 0] for r in runs])
                    beside = studied if window is REST else None
                    cases.append({"mode": mode, **row(name, quantity, figure, published=beside)})
    return {"experiment": "ingredients", "seeds": seeds, "cases": cases}
