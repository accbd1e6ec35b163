"""Kinds drawn against kinds named, and false blame of honest holes that grow: a table for the terminal.

    .venv/bin/python tests/groundstation/blame_table.py --seeds 50 --honest 1000

Strings are those of ``drawn_strings``; the suite runs a few seeds of the same.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import fields, replace

import numpy as np
from drawn_strings import SIZES, DrawnString, draw_string

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunders import Blunder, Examination, chance_of_one, examine_hole
from groundstation.survey.adjustment.hypotheses import Hypothesis
from groundstation.survey.adjustment.looks import Looks
from groundstation.survey.adjustment.reliability import measure_reliability
from groundstation.survey.adjustment.toe_weights import toe_weights

K = BlunderKind
OF_STRING = (K.DEPTH_WRONG_ONCE, K.DEPTH_WRONG_FROM, K.ENCODER_SLIPPED, K.ENCODER_DRIFTS, K.HOLE_MOVED)


def examined(drawn: DrawnString) -> Examination:
    """The hole with what is found wrong with it."""
    return examine_hole(drawn.looks, drawn.string, drawn.path, drawn.run)


def is_right(one: Hypothesis, kind: str, drawn: DrawnString) -> bool:
    """Whether a hypothesis is what was drawn; its stop may be another."""
    if one.kind != kind:
        return False
    if kind == K.TUBES_EXCHANGED:
        return set(one.subject) == {drawn.tube, drawn.other}
    return one.kind in OF_STRING or one.subject == (drawn.tube,)


def verdict(found: Examination, kind: str, drawn: DrawnString) -> str:
    """How the first blunder that was found stands to what was drawn: named, doubt, wrong or missed."""
    if not found.blunders:
        return "missed"
    first = found.blunders[0]
    if is_right(first.best.hypothesis, kind, drawn):
        return "doubt" if first.is_doubt else "named"
    is_second = first.is_doubt and first.second is not None and is_right(first.second.hypothesis, kind, drawn)
    return "doubt" if is_second else "wrong"


def toe_departure(found: Examination, drawn: DrawnString) -> float:
    """Square of the toe's error by its covariance, of two degrees of freedom."""
    adjusted = found.adjusted
    errors = np.einsum("kai,ki->ka", adjusted.linear.bases, drawn.tangents - adjusted.now.tangents)[1:]
    shared = np.column_stack([adjusted.columns[1:, :2].sum(axis=0), found.suspected[1:].sum(axis=0)])
    off, cov = errors.sum(axis=0), shared @ shared.T + adjusted.own_covs[1:, :2, :2].sum(axis=0)
    return float(off @ np.linalg.solve(cov, off))


def until_stop(drawn: DrawnString, last: int) -> DrawnString:
    """The string as it was known at a stop."""
    seen = drawn.looks.stop <= last
    looks = Looks(**{one.name: getattr(drawn.looks, one.name)[seen] for one in fields(Looks)})
    path = replace(drawn.path, md=drawn.path.md[: last + 2])
    return replace(drawn, looks=looks, path=path, run=replace(drawn.run, station_md=path.md))


def examined_as_it_grows(drawn: DrawnString) -> tuple[Blunder, ...]:
    """Blunders that were found at any stop, each stop with those known before."""
    known: tuple[Blunder, ...] = ()
    for last in range(int(drawn.looks.stop.max()) + 1):
        now = until_stop(drawn, last)
        known = examine_hole(now.looks, now.string, now.path, now.run, known).blunders
    return known


def power_at(kind: str, times: float, seeds: int) -> float:
    """Part of the strings in which a step of so many times its stated least size is found, not necessarily named."""
    found = 0
    for seed in range(seeds):
        plain = draw_string(5000 + seed, kind, 0.0)
        adjusted = adjust_hole(plain.looks, plain.string, plain.path)
        one = Hypothesis(BlunderKind(kind), (plain.tube,), plain.onset)
        level = chance_of_one(plain.looks, plain.run)
        (told,) = measure_reliability(adjusted, plain.run, [one], toe_weights(adjusted), {}, level)
        unit = np.pi / 180.0 if kind == K.JOINT_SLIPPED else 9.80665e-3
        found += bool(examined(draw_string(5000 + seed, kind, times * told.smallest / unit)).blunders)
    return found / seeds


def main() -> None:
    """Print the table."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--seeds", type=int, default=50)
    asked.add_argument("--honest", type=int, default=1000)
    asked.add_argument("--power", type=int, default=100)
    options = asked.parse_args()
    print(f"{'drawn':18s} {'size':>6s} {'named':>6s} {'doubt':>6s} {'wrong':>6s} {'missed':>6s} {'toe':>6s}  named as")
    for kind, sizes in SIZES.items():
        for size in sizes:
            counts: Counter[str] = Counter()
            others: Counter[str] = Counter()
            toes = []
            for seed in range(options.seeds):
                drawn = draw_string(seed, kind, size)
                found = examined(drawn)
                counts[said := verdict(found, kind, drawn)] += 1
                if said == "wrong":
                    first = found.blunders[0]
                    others[first.best.hypothesis.kind.value + (" or another" if first.is_doubt else "")] += 1
                toes.append(toe_departure(found, drawn) / 2.0)
            row = " ".join(f"{counts[one]:6d}" for one in ("named", "doubt", "wrong", "missed"))
            print(f"{kind:18s} {size:6.2f} {row} {np.mean(toes):6.2f}  {dict(others)}", flush=True)
    for kind in ("bias_stepped", "joint_slipped") if options.power else ():
        shown = [f"{times} times: {power_at(kind, times, options.power):.2f}" for times in (0.5, 1.0, 1.5)]
        print(f"{kind} found from its least size by 80 %, {', '.join(shown)}", flush=True)
    blamed = [seed for seed in range(options.honest) if examined_as_it_grows(draw_string(10_000 + seed))]
    print(f"honest holes blamed: {len(blamed)} of {options.honest} {blamed}")


if __name__ == "__main__":
    main()
