"""The OWSG set of survey tools by name: MWD and EMS with their corrections (AX, SAG, MS, IFR), gyros, inclination only.

``owsg.toml`` holds each weight once and the magnitudes of every tool; names as published, ``_Fl`` on a floating rig.
Source: tool codes of the Operator's Wellbore Survey Group, sets A and B for revision 5 (ISCWSA).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from typing import Any

from groundstation.survey.tools.instruments import SurveyTool
from groundstation.survey.tools.iscwsa_json import tool_of

FORMULAS = ("depth_formula", "inclination_formula", "azimuth_formula")


@lru_cache(maxsize=1)
def _set() -> dict[str, Any]:
    return tomllib.loads((resources.files("groundstation.survey.tools") / "owsg.toml").read_text("utf-8"))


def owsg_names() -> dict[str, str]:
    """Titles of the tools by their name."""
    return {name: str(tool["title"]) for name, tool in _set()["tools"].items()}


def owsg_tool(name: str, parameters: Mapping[str, float] | None = None) -> SurveyTool | None:
    """Tool of the set, or None where there is no such name, which is read without regard to case.

    Raises
    ------
    ToolError
        When the tool needs a parameter that it leaves out.
    """
    tools, weights = _set()["tools"], _set()["weights"]
    known = next((key for key in tools if key.lower() == name.lower()), None)
    if known is None:
        return None
    tool = tools[known]
    content = {
        "metadata": {
            "short_name": known,
            "long_name": tool["title"],
            "source": f"OWSG {tool['id']}",
            "revision_number": tool["revision"],
            "tool_type": tool["kind"],
            "framework": "ISCWSA Rev5",
        },
        "parameters": tool["parameters"],
        "terms": [
            {"name": term, "value": value, **dict.fromkeys(FORMULAS, "0"), **weights[term]}
            for term, value in tool["terms"]
        ],
    }
    return tool_of(content, known, parameters)
