"""Saved state on disk: two slots written in turn, each with its checksum, so that a cut at any instant spares one."""

from __future__ import annotations

import os
from pathlib import Path

from node.errors import SavedStateError
from node.firmware.saved_state import pack, unpack
from node.kernels.layout import Array


class Journal:
    """Two-slot journal in ``folder``; the newest slot with a good checksum wins."""

    def __init__(self, folder: Path) -> None:
        self._slots = (folder / "slot-0", folder / "slot-1")
        self._generation = 0
        folder.mkdir(parents=True, exist_ok=True)

    def load(self) -> tuple[Array, bytes] | None:
        """State and telemetry blob of the newest good slot, or None on a first start.

        Raises
        ------
        SavedStateError
            When slots exist and none is good.
        """
        best: tuple[Array, bytes, int] | None = None
        faults: list[str] = []
        for slot in self._slots:
            if not slot.exists():
                continue
            try:
                found = unpack(slot.read_bytes())
            except SavedStateError as error:
                faults.append(f"{slot}: {error}")
                continue
            if best is None or found[2] > best[2]:
                best = found
        if best is None and faults:
            raise SavedStateError("; ".join(faults))
        if best is None:
            return None
        self._generation = best[2]
        return best[0], best[1]

    def save(self, state: Array, blob: bytes) -> None:
        """Write the older slot and force it to the disk before returning."""
        self._generation += 1
        slot = self._slots[self._generation % 2]
        is_new = not slot.exists()
        rest = memoryview(pack(state, blob, self._generation))
        descriptor = os.open(slot, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        try:
            while rest:
                rest = rest[os.write(descriptor, rest) :]
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        if is_new:
            sync_folder(slot.parent)


def sync_folder(folder: Path) -> None:
    """Force the names in ``folder`` to the disk: a new file is not kept by forcing its bytes alone."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
