"""Write ``asyncapi.json``, the keys of an operator for other programs' generators: ``python docs/make_asyncapi.py``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent)]

from borechain import __version__  # noqa: E402
from groundstation.service.answers.answer_table import ANSWERS  # noqa: E402
from groundstation.service.answers.shapes.answer_fields import object_schema  # noqa: E402


def document() -> dict[str, Any]:
    """The whole document; names are those of the paths below ``ground/``."""
    names = {path: path.replace("/", "_").replace("{", "").replace("}", "") for path in ANSWERS}
    return {
        "asyncapi": "3.0.0",
        "info": {
            "title": "borechain ground station",
            "version": __version__,
            "description": "Keys of one rig on zenoh; each can be asked for, those with an operation are published.",
        },
        "defaultContentType": "application/json",
        "channels": {
            names[path]: {
                "address": answer.key.template,
                "parameters": {name: {} for name in ("rig", *answer.numbers)},
                "messages": {"answer": {"$ref": f"#/components/messages/{names[path]}"}},
            }
            for path, answer in ANSWERS.items()
        },
        "operations": {
            f"hear_{names[path]}": {"action": "receive", "channel": {"$ref": f"#/channels/{names[path]}"}}
            for path, answer in ANSWERS.items()
            if answer.published
        },
        "components": {
            "messages": {names[path]: {"payload": object_schema(answer.fields)} for path, answer in ANSWERS.items()}
        },
    }


def text() -> str:
    """The document as it is in the file."""
    return json.dumps(document(), indent=1) + "\n"


if __name__ == "__main__":
    (DOCS / "asyncapi.json").write_text(text())
