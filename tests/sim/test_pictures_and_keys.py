"""Pictures of a campaign point by point, keys of disturbances, and the bare recorder at the surface."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from messages_of_schema import messages

from sim.campaign.campaign_figures import accuracy_figure, honesty_figure
from sim.rig.plain_base import PlainBase
from sim.world.disturbance.disturbance_table import TABLE
from sim.world.disturbance.row import ActsOn, Disturbance
from sim.world.disturbance.whirl import WhirlSection
from telemetry.application.endpoint import Received
from telemetry.frozen import replace
from telemetry.messages import NodeState, Side, SurveyMeasurement


def honest(state: str, hop: int, k: float) -> dict[str, Any]:
    return {
        "state": state, "hop": hop, "nees": k, "nees_low": k - 0.1, "nees_high": k + 0.2, "nees_total": k + 1.0,
        "nees_total_low": k + 0.7, "nees_total_high": k + 1.4, "inside_95_percent": 90.0 + k, "inside_low": 89.5 + k,
        "inside_high": 90.6 + k,
    }  # fmt: skip


def bars_of(container: Any) -> tuple[list[float], list[float], list[tuple[float, float]]]:
    """Places, values and both ends of the bars."""
    data, _, (bars,) = container
    ends = [(float(segment[0][1]), float(segment[1][1])) for segment in bars.get_segments()]
    return list(map(float, data.get_xdata())), list(map(float, data.get_ydata())), ends


def test_honesty_is_drawn_with_its_intervals_over_the_hops() -> None:
    figure = honesty_figure([honest("at rest", 1, 1.0), honest("at rest", 2, 2.0), honest("turning", 1, 3.0)], "t")
    wanted = (("nees", 0.0, 0.1, 0.2, 1.0), ("total", 1.0, 0.3, 0.4, 1.0), ("inside", 90.0, 0.5, 0.6, 95.0))
    for axes, (_, more, low, high, honest_at) in zip(figure.axes, wanted, strict=True):
        resting, turning = axes.containers
        x, y, ends = bars_of(resting)
        assert (x, y) == ([1.0, 2.0], [1.0 + more, 2.0 + more])
        assert ends == [pytest.approx((v - low, v + high)) for v in y]
        x, y, ends = bars_of(turning)
        assert x == pytest.approx([1.15])
        assert ends == [pytest.approx((3.0 + more - low, 3.0 + more + high))]
        assert axes.lines[0].get_ydata()[0] == honest_at
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "NEES, filter alone",
        "NEES with joints and mount",
        "Inside 95 % (%)",
    ]


def test_accuracy_is_drawn_with_azimuth_and_inclination_over_the_depth() -> None:
    rows = [
        {
            "md_m": md,
            "azimuth_rms_deg": azi,
            "azimuth_low_deg": low,
            "azimuth_high_deg": high,
            "inclination_rms_deg": inc,
        }
        for md, azi, low, high, inc in ((2.0, 0.5, 0.4, 0.7, 0.05), (4.0, 0.6, 0.45, 0.9, 0.06))
    ]
    (axes,) = accuracy_figure(rows, "t").axes
    (azimuth,) = axes.containers
    assert bars_of(azimuth) == (
        [2.0, 4.0], [0.5, 0.6], [pytest.approx((0.4, 0.7)), pytest.approx((0.45, 0.9))],
    )  # fmt: skip
    inclination = next(line for line in axes.lines if line.get_label() == "inclination")
    assert (list(inclination.get_xdata()), list(inclination.get_ydata())) == ([2.0, 4.0], [0.05, 0.06])
    assert {text.get_text() for text in axes.get_legend().get_texts()} == {"azimuth", "inclination"}


def test_a_disturbance_owns_its_keys_and_its_table() -> None:
    row = Disturbance("whirl", ("rough.a", "node.b"), ActsOn.GRID, section=WhirlSection)
    assert all(
        row.owns(key) for key in ("rough.a", "rough.a.deep", "node.b", "disturbance.whirl", "disturbance.whirl.x")
    )
    assert not any(row.owns(key) for key in ("rough", "rough.ab", "node.bc", "disturbance.whirlwind", "disturbance"))
    bare = Disturbance("drift", ("drift",), ActsOn.GRID)
    assert bare.owns("drift.bias")
    assert not bare.owns("disturbance.drift")
    only = Disturbance("alone", (), ActsOn.GRID, section=WhirlSection)
    assert only.owns("disturbance.alone.lean_deg")
    for one in TABLE:
        if one.section is not None:
            assert one.owns(f"disturbance.{one.name}")


@settings(max_examples=5)
@given(survey=messages(SurveyMeasurement), state=messages(NodeState))
def test_what_must_arrive_is_kept_as_it_came_first_and_receipted(survey: SurveyMeasurement, state: NodeState) -> None:
    base, receipted = PlainBase(), list[Any]()
    base.endpoint.mail.acknowledge = receipted.append  # type: ignore[method-assign]
    again = replace(survey, station_at=0.0)
    coming = [survey, state, again]
    base.endpoint.receive = lambda *words: [Received(coming.pop(0), Side.LOWER)]  # type: ignore[method-assign]
    for k in range(3):
        base.on_frame(Side.LOWER, b"", 10.0 + k)
    assert base.arrived == {(survey.tube, survey.sequence): (survey, 10.0)}
    assert receipted == [survey, again]
