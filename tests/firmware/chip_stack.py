"""How much of its stack an emulated chip has used: what is written of the memory below the stack's top.

Memory is zero when the emulator starts, and a program never clears its stack: what is not zero was used.
"""

from __future__ import annotations

import json
import re
import socket
import subprocess
from pathlib import Path
from typing import Any


def stack_region(program: Path) -> tuple[int, int]:
    """First address and size of the memory that a program leaves to its stack."""
    shown = subprocess.run(["arm-none-eabi-nm", str(program)], capture_output=True, text=True, check=True).stdout
    at = {name: int(address, 16) for address, name in re.findall(r"^(\w+) \w (__bss_end__|__StackTop)$", shown, re.M)}
    return at["__bss_end__"], at["__StackTop"] - at["__bss_end__"]


def stack_used(monitor: Path, program: Path) -> int:
    """Bytes of the stack that were written since the start, from its top to the deepest.

    Parameters
    ----------
    monitor : socket of the emulator's monitor (QMP)
    """
    begin, size = stack_region(program)
    image = monitor.with_name("stack.bin")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as line:
        line.settimeout(30.0)
        line.connect(str(monitor))
        with line.makefile("r") as answers:
            answers.readline()  # who it is
            for order in (
                {"execute": "qmp_capabilities"},
                {"execute": "pmemsave", "arguments": {"val": begin, "size": size, "filename": str(image)}},
            ):
                line.sendall(json.dumps(order).encode() + b"\n")
                answer: dict[str, Any] = {}
                while "return" not in answer:
                    answer = json.loads(answers.readline())
                    assert "error" not in answer, answer
    kept = image.read_bytes()
    assert len(kept) == size
    return size - next((at for at, byte in enumerate(kept) if byte), size)
