"""Write ``docs/borechain.dbc`` from the schema: ``python docs/make_dbc.py``."""

from __future__ import annotations

import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))

from telemetry.presentation.can_dbc import dbc_text  # noqa: E402

if __name__ == "__main__":
    (DOCS / "borechain.dbc").write_text(dbc_text())
