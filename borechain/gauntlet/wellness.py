"""Whether all is well again some time after the last fault: everything live, nothing on its way, no cause left."""

from __future__ import annotations

from collections.abc import Iterator

from borechain.gauntlet.gauntlet_rig import GauntletRig
from telemetry.application.endpoint_state import parse_state
from telemetry.presentation.msgpack_codec import decode_message

UNWELL = frozenset(
    {
        *("tube_silent", "depth_silent", "depth_refused", "disk", "tube_disk", "clock", "lease", "same_number"),
        "numbers_missing",
    }
)  # alarms that end with their causes; a survey of a time without a depth is never placed
NOT_LIVE = frozenset({"stale", "clock", "depth"})  # doubts of a verdict that what is live does not have


def still_unwell(rig: GauntletRig) -> Iterator[str]:
    """What of a rig is not well although nothing has failed for long."""
    if rig.off:
        yield f"without power: {sorted(rig.off)}"
    for address, process in rig.stepper.processes.items():
        parcels = parse_state(process.endpoint.export_state()).parcels
        # of another tube's memory, which was put into this one, it gets no receipts
        own = [one for _, one, _ in parcels if getattr(decode_message(one), "tube", address) == address]
        if own:
            yield f"process {address}: {len(own)} messages still wait for their receipts"
    standing = sorted(
        {(row["code"], row["subject"]) for row in rig.inline.ask("alarms")["rig"] if row["code"] in UNWELL}
    )
    if standing:
        yield f"still stand: {', '.join(f'{code} of {subject}' for code, subject in standing)}"
    if doubts := sorted(NOT_LIVE.intersection(rig.inline.ask("verdict")["doubts"])):
        yield f"the verdict is not live: {', '.join(doubts)}"
