"""Add the present layout of the saved state to those that a node takes over: ``python docs/make_layouts.py``."""

from __future__ import annotations

import json

from node.firmware.saved_layouts import TABLE, dtype_description
from node.firmware.saved_state import layout_name
from node.kernels.record.node_record import KEPT, KEPT_SIZE, NODE


def present_layout() -> str:
    """Description of what the present version keeps."""
    places = ((name, NODE.fields[name]) for name in KEPT) if NODE.fields else ()
    fields = ",".join(f"{name}@{place[1]}:{dtype_description(place[0])}" for name, place in places)
    return f"{{{fields}}}{KEPT_SIZE}"


if __name__ == "__main__":
    known = json.loads(TABLE.read_text()) | {layout_name(): present_layout()}
    TABLE.write_text(json.dumps(known, indent=0) + "\n")
