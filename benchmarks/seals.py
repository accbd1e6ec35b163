"""Seals: what the seal of each kind of message costs, made and judged, beside encoding and decoding it."""

from __future__ import annotations

import datetime
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from borechain.pki.rig_keys import add_tube, init_rig
from telemetry.application.can_load import HEADER, steady_traffic
from telemetry.application.depth_seal import open_depth, seal_depth
from telemetry.application.end_seal import content_of_sealed, is_sealed
from telemetry.application.seals import Seals, seals_of
from telemetry.frozen import replace
from telemetry.media.credentials import DEPTH_SOURCE
from telemetry.messages import (
    BASE,
    ENCODER,
    Aiding,
    Command,
    DepthReading,
    Event,
    ImuMean,
    Message,
    NodeFlag,
    NodeMode,
    NodeState,
    Receipt,
    Reply,
    Severity,
    Side,
    StaticRecord,
    SurveyMeasurement,
)
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.transport.hop import pack_frame, parse_frame
from telemetry.transport.joint_seal import JointSeal
from telemetry.transport.key_ring import key_file, read_ring

ROUNDS, TIMES = 40, 200
Z = (0.0, 0.0, 0.0)
COV = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))
AIDING = Aiding(1.0, 1e-8, 0.0, 0.0, 0.1, 100.0, 7, 0, epoch=1)
UP: tuple[Message, ...] = (
    NodeState(1, 5.0, 2, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, Z, 0.0, 0.0, 1e-7, 0.5, 1e-9, NodeFlag.NONE, 7, 0),
    SurveyMeasurement(1, 1, 5.0, 2, (ImuMean(Z, COV),), 1.0, 1e-6, 2e-6, 32, 18.5, NodeFlag.NONE),
    Event(1, 2, 5.0, Severity.INFO, "booted", {"yaw_deg": 1.0}),
    StaticRecord(1, 3, 1, 1.0, 2.0, 5, Z, COV, Z, COV, 20.0, False),
    Reply(1, 4, True, "recording"),
)
DOWN: tuple[Message, ...] = (Receipt(1, 1, bytes(16)), Command(1, 5, "static_record", {"seconds": 60.0}))


def run() -> dict[str, Any]:
    """Seal and judge one message of each kind.

    Returns
    -------
    dict
        ``ratios``: seconds of sealing and judging (ours) and of encoding and decoding (peer) for each kind;
        ``decode_verify_us``: median time from a sealed frame of the link to its message, both seals judged.
    """
    with tempfile.TemporaryDirectory(prefix="borechain-") as place:
        folder, now = Path(place) / "stick", datetime.datetime.now(datetime.UTC)
        init_rig(folder, "rig-1", now)
        add_tube(folder, 1, now)
        found, verified = measured(folder), verify_times(folder)
    return {"bench": "seals", "ratios": found, "decode_verify_us": verified}


def measured(folder: Path) -> dict[str, dict[str, float]]:
    """Times of every kind."""
    base, tube = opened(folder, BASE, [Side.LOWER]), opened(folder, 1, Side)
    meet(base, tube)
    found = {}
    for message in UP:
        payload, told = encode_message(message), tube.close_up(encode_message(message))
        found[type(message).__name__] = both(partial(tube.close_up, payload), partial(base.hear, told, 1, 1.0), message)
    for message in DOWN:
        payload, told = encode_message(message), base.close_down(encode_message(message), 1) or b""
        found[type(message).__name__] = both(
            partial(base.close_down, payload, 1), partial(tube.is_told, told, 1.0, is_offer=False), message
        )
    encoder = opened(folder, ENCODER, Side).measurement
    sealed = encoder.close(AIDING)
    found["Aiding"] = both(
        lambda: encoder.close(AIDING), lambda: tube.measurement.admits(sealed, 1, 100.0), replace(AIDING)
    )
    source, depth = read_ring(key_file(folder, DEPTH_SOURCE), DEPTH_SOURCE), DepthReading(1, 1.0, 2.0, ())
    payload = encode_message(depth)
    reading = seal_depth(source, payload)
    found["DepthReading"] = both(
        lambda: seal_depth(source, payload), lambda: open_depth(lambda: base.ring, reading), depth
    )
    found["frame of 300 bytes"] = frames(base, opened(folder, ENCODER, Side))
    return found


def opened(folder: Path, address: int, sides: Any) -> Seals:
    """Seals of a process."""
    seals = seals_of(folder, address, sides)
    if seals is None:
        raise RuntimeError("expected seals")
    return seals


def meet(base: Seals, tube: Seals) -> None:
    """Begin a session of a tube with the base."""
    base.hear(tube.close_up(encode_message(UP[0])), 1, 0.0)
    for _, offer in base.due_offers():
        tube.is_told(offer, 0.0, is_offer=True)
    if not base.hear(tube.close_up(encode_message(UP[0])), 1, 0.0).is_believed:
        raise RuntimeError("expected a session")


def frames(base: Seals, encoder: Seals) -> dict[str, float]:
    """Times of a frame over one joint; each is sealed anew, since none is believed twice."""
    one, other = joined(base.joints[Side.LOWER], encoder.joints[Side.UPPER])
    payload = bytes(300)
    made = best(lambda: one.close(payload))
    both_ways = best(lambda: other.open(one.close(payload) or b"", 4.0))
    return {"ours": both_ways, "peer": made, "ratio": made / both_ways}


def joined(one: JointSeal, other: JointSeal) -> tuple[JointSeal, JointSeal]:
    """Both ends of a joint once they have proven themselves."""
    for now in range(4):
        for frame in one.own_frames(float(now)):
            other.open(frame, float(now))
        for frame in other.own_frames(float(now)):
            one.open(frame, float(now))
    return one, other


def verify_times(folder: Path) -> dict[str, float]:
    """Median time (us) of verifying each cyclic message at its receiver: tube 1, or the base for a tube's state."""
    found = {}
    base, tube = opened(folder, BASE, [Side.LOWER]), opened(folder, 1, Side)
    encoder = opened(folder, ENCODER, Side)
    meet(base, tube)
    above, below = joined(encoder.joints[Side.LOWER], tube.joints[Side.UPPER])
    for traffic in steady_traffic(1):
        times = []
        for number in range(TIMES * 5):
            message, payload = traffic.message, b""
            if isinstance(message, Aiding):
                message = encoder.measurement.close(replace(message, sequence=number, valid_at=100.0, epoch=1))
            payload = encode_message(message)
            if isinstance(message, NodeState):
                payload = tube.close_up(encode_message(replace(message, tube=1)))
            frame = above.close(pack_frame(HEADER, [(0, payload)])) or b""
            begun = time.perf_counter()
            heard = verified(below.open(frame, 4.0) or b"", tube, base)
            times.append(time.perf_counter() - begun)
            if heard != decode_message(content_of_sealed(payload)):
                raise RuntimeError(f"expected {message}, got {heard}")
        found[type(traffic.message).__name__] = 1e6 * statistics.median(times)
    return found


def verified(frame: bytes, tube: Seals, base: Seals) -> Message | None:
    """Message of an opened frame of the link; None where its own seal does not fit."""
    parsed = parse_frame(frame)
    if parsed is None:
        return None
    payload: bytes = parsed[1][0][1]
    if is_sealed(payload):
        return decode_message(content_of_sealed(payload)) if base.hear(payload, 1, 4.0).is_believed else None
    message = decode_message(payload)
    is_believed = not isinstance(message, Aiding) or tube.measurement.admits(message, 1, 100.0)
    return message if is_believed else None


def both(make: Callable[[], object], judge: Callable[[], object], message: Message) -> dict[str, float]:
    """Making and judging a seal beside encoding and decoding the message."""
    ours = best(make) + best(judge)
    payload = encode_message(message)
    peer = best(lambda: encode_message(message)) + best(lambda: decode_message(payload))
    return {"ours": ours, "peer": peer, "ratio": peer / ours}


def best(act: Callable[[], object]) -> float:
    """Time of one call in the best of the rounds, s: what others do on the machine only adds."""
    times = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        for _ in range(TIMES):
            act()
        times.append((time.perf_counter() - begun) / TIMES)
    return min(times)


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
