"""All that is written for the program of a chip with one IMU: step, codec, events and loader."""

from __future__ import annotations

from pathlib import Path

from node.firmware.event_words import EVENTS_HEADER, write_event_table
from node.firmware.node_image import LOADER, LOADER_TEXT
from node.translation.firmware_build import FirmwareRequest, build_firmware
from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec


def write_chip_sources(folder: Path) -> None:
    """Write them into a folder."""
    build_firmware(FirmwareRequest("c", 1, folder))
    codec = write_native_codec()
    for name, text in (
        (NATIVE_HEADER, codec.header),
        (NATIVE_CODE, codec.code),
        (EVENTS_HEADER, write_event_table()),
        (LOADER, LOADER_TEXT),
    ):
        (folder / name).write_text(text, encoding="utf-8")
