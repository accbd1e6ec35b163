"""One ground station a rig: a token on the bus that lives as long as its holder.

Two that come at the same moment both see the other, and the one that was started first stays.
"""

from __future__ import annotations

import os
import secrets
import socket
import time

from groundstation.errors import LeaseError
from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus

PATIENCE = 5.0  # wall s for which the token of a dead ground station may be left over
ASK_EVERY = 0.5  # wall s
ASK_TIMEOUT = 2.0  # wall s


def take_lease(bus: ZenohBus, rig: str) -> None:
    """Become the one ground station of ``rig`` until the session ends.

    Raises
    ------
    LeaseError
        When there is another; it is named.
    """
    deadline = time.monotonic() + PATIENCE
    while others := bus.tokens(keys.LEASE.format(rig=rig, holder="*"), ASK_TIMEOUT):
        if time.monotonic() >= deadline:
            raise LeaseError(lease_refusal(rig, others[0]))
        time.sleep(ASK_EVERY)
    own = keys.LEASE.format(rig=rig, holder=holder_name())
    bus.liveliness_token(own)
    first = min([own, *bus.tokens(keys.LEASE.format(rig=rig, holder="*"), ASK_TIMEOUT)])
    if first != own:
        raise LeaseError(lease_refusal(rig, first))


def holder_name() -> str:
    """Name of this ground station, the older the smaller: its start, its machine and its process."""
    machine = "".join(c if c.isalnum() else "-" for c in socket.gethostname())[:40] or "unnamed"
    return f"{time.time_ns():020d}_{machine}_{os.getpid()}_{secrets.token_hex(4)}"


def lease_refusal(rig: str, token: str) -> str:
    """Why a second ground station is refused, by the token of the first."""
    _, machine, process, _ = token.rsplit("/", 1)[1].split("_")
    return f"rig {rig}: process {process} on {machine} is its ground station; end that one, or choose another --rig"
