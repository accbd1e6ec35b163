"""Write ``asyncapi.json``, the keys of an operator for other programs' generators: ``python docs/make_asyncapi.py``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent)]

from borechain import __version__  # noqa: E402
from groundstation.service.answers.answer_fields import object_schema  # noqa: E402
from groundstation.service.answers.paths import FIXED, MEMBERS  # noqa: E402
from telemetry import keys  # noqa: E402

PUBLISHED = {
    key.template: key for key in keys.TABLE if "/ground/" in key.template and key.kind in ("publish", "query, publish")
}


def document() -> dict[str, Any]:
    """The whole document; names are those of the paths below ``ground/``."""
    found = {pattern: path.fields for pattern, path in (FIXED | MEMBERS).items()}
    names = {pattern: pattern.replace("/", "_").replace("{", "").replace("}", "") for pattern in found}
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "borechain ground station",
            "version": __version__,
            "description": "Keys of one rig on zenoh; each can be asked for, those with an operation are published.",
        },
        "defaultContentType": "application/json",
        "channels": {
            names[pattern]: {
                "address": keys.GROUND.format(rig="{rig}", path=pattern),
                "parameters": {name: {} for name in parameters(pattern)},
                "messages": {"answer": {"$ref": f"#/components/messages/{names[pattern]}"}},
            }
            for pattern in found
        },
        "operations": {
            f"hear_{names[pattern]}": {"action": "receive", "channel": {"$ref": f"#/channels/{names[pattern]}"}}
            for pattern in found
            if keys.GROUND.format(rig="{rig}", path=pattern) in PUBLISHED
        },
        "components": {
            "messages": {names[pattern]: {"payload": object_schema(fields)} for pattern, fields in found.items()}
        },
    }


def parameters(pattern: str) -> list[str]:
    """Names in a pattern's braces, and the rig."""
    return ["rig", *(part.strip("{}") for part in pattern.split("/") if part.startswith("{"))]


def text() -> str:
    """The document as it is in the file."""
    return json.dumps(document(), indent=1) + "\n"


if __name__ == "__main__":
    (DOCS / "asyncapi.json").write_text(text())
