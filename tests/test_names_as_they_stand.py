"""Names of walls, columns, attitudes and files stand in tables and figures as they are, whatever signs they have."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text
from printed_output import printed, wall_result

from borechain.cli.calibrate.calibration_output import show_sheet
from borechain.cli.console_tables import show_table
from borechain.cli.survey.wall_command import show_wall
from groundstation.calibration.attitudes import AttitudeFit
from groundstation.report.calibration_plots import linear_panels
from groundstation.report.calibration_sheets import AttitudeErrors, linear_sheet
from groundstation.report.figure_panels import render_panels
from groundstation.report.style import new_figure, tick_text

BRACKETS = ("Pit [red]", "[/]", "[bold]A[/bold]", "[link=x]", ":pile:", "a\\[b]")
DOLLARS = ("a$b$", "$\\frac$", "5 $", "$$", "\\$x$")


def linear(name: str) -> tuple[AttitudeFit, AttitudeErrors]:
    fit = AttitudeFit(np.eye(3), np.zeros(3), np.eye(12), np.ones((2, 3)), 1.0, 4, np.array([99.0, 1.0]))
    return fit, AttitudeErrors((name, "b"), "g", np.ones(2), np.ones(2))


@pytest.mark.parametrize("name", BRACKETS)
def test_brackets_are_no_style_at_the_terminal(name: str) -> None:
    rows = wall_result(wall=name)
    rows["joints"][0]["joint"] = f"{name}-B"
    told = printed(show_wall, rows)
    assert told[0].startswith(f"{name}: not tight (grid north")
    assert any(f"{name}-B" in line for line in told)
    fit, at = linear(name)
    told = printed(show_sheet, linear_sheet(f"Calibration of {name}", fit, at, "", [("Record", name)]), [])
    assert told[0] == f"Calibration of {name}"
    assert told[1] == f"{'Record':24} {name}"
    assert any(line.startswith("warning: ") and f"attitude {name} moves" in line for line in told)
    assert any(line.startswith(f"│ {name} ") for line in told)
    told = printed(show_table, name, [{"what": name}], [("what", name)])
    assert sum(name in line for line in told) == 3  # title, heading and cell


@pytest.mark.parametrize("name", DOLLARS)
def test_dollars_are_no_formula_in_a_figure(name: str) -> None:
    fit, at = linear(name)
    svg = render_panels(linear_panels(fit, at), "svg")
    figure, told = new_figure(2.0, f"Wall {name}"), io.BytesIO()
    figure.savefig(told, format="svg")
    for made in (svg, told.getvalue()):
        assert b"<svg" in made
    titles = [text for text in figure.findobj(Text) if text.get_text()]
    shown = [shown_text(text) for text in titles]
    assert shown == [f"Wall {name}"]


def shown_text(text: Any) -> str:
    """What matplotlib draws of a text; a formula would be told as such."""
    drawn, is_formula = text._preprocess_math(text.get_text())
    assert not is_formula
    return str(drawn)


def test_a_power_of_ten_is_a_formula_still() -> None:
    figure = new_figure(2.0, "")
    tick = figure.text(0.0, 0.0, tick_text(1e7))
    assert tick._preprocess_math(tick.get_text())[1]  # type: ignore[attr-defined]
