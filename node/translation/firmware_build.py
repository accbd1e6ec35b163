"""The firmware of a chip as files: header, code, object and how much of a chip they take."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

from node.kernels.record.sensor_record import MAX_IMUS
from node.translation.c_file import CODE, HEADER
from node.translation.imu_limit import write_for_imus
from node.translation.orders_file import ORDERS_CODE, ORDERS_HEADER, write_order_files
from node.translation.toolchains import CodeSize, compile_step, find_tool

SIZES: Final = "borechain_step.sizes.txt"
KEPT: Final = ("node", "settings", "parameters")  # records of one node


class FirmwareRequest(NamedTuple):
    """What is to be built.

    Attributes
    ----------
    target : one of ``TARGETS``
    imus : most IMUs of a node, 1 to ``MAX_IMUS``
    out : folder
    """

    target: str = "c"
    imus: int = MAX_IMUS
    out: Path = Path("firmware-build")


class BuiltFirmware(NamedTuple):
    """What was built.

    Attributes
    ----------
    digest : of the source, which is in the names that the linker sees
    files : that were written
    size : of the object; None where none was asked for
    memory : bytes of a node's record, its settings and its parameters
    """

    digest: str
    files: tuple[Path, ...]
    size: CodeSize | None
    memory: int


def build_firmware(request: FirmwareRequest) -> BuiltFirmware:
    """Write header and code, and compile them where the target is a chip.

    Raises
    ------
    ToolchainError
        When the target's compiler is missing, before anything is written.
    UntranslatableKernelError
        When a kernel says what is not translated.
    """
    if request.target != "c":
        find_tool(request.target, "gcc")
    written = write_for_imus(request.imus)
    request.out.mkdir(parents=True, exist_ok=True)
    orders = write_order_files(written.digest)
    files = [request.out / name for name in (HEADER, CODE, ORDERS_HEADER, ORDERS_CODE)]
    for path, text in zip(files, (written.header, written.code, *orders), strict=True):
        path.write_text(text, encoding="utf-8")
    size, memory = None, record_memory(written.header)
    if request.target != "c":
        made, size = compile_step(request.target, request.out)
        files.append(made)
    sizes = request.out / SIZES
    sizes.write_text(sizes_text(request, written.digest, size, memory), encoding="utf-8")
    return BuiltFirmware(written.digest, (*files, sizes), size, memory)


def record_memory(header: str) -> int:
    """Bytes of the records of one node, as the header checks them; parameters are one for the block and one an IMU."""
    found = {name: int(count) for name, count in re.findall(r"IS_LONG\(borechain_(\w+), (\d+)\)", header)}
    imus = int(re.findall(r"#define BORECHAIN_IMUS (\d+)", header)[0])
    node, settings, parameters = (found[name] for name in KEPT)
    return node + settings + parameters * (1 + imus)


def sizes_text(request: FirmwareRequest, digest: str, size: CodeSize | None, memory: int) -> str:
    """How much of a chip the step takes, a line each."""
    lines = [f"source {digest}", f"target {request.target}", f"imus {request.imus}"]
    if size is not None:
        lines += [f"flash_bytes {size.flash}", f"data_bytes {size.data}", f"zeroed_bytes {size.zeroed}"]
    return "\n".join([*lines, f"records_bytes {memory}", ""])
