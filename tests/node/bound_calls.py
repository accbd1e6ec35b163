"""Calls of the integer step whose comparisons lie at their bounds, sought from recorded ones; see ``chip/seek.c``.

No world leads a rate to within one count of its limit. Here one word after another of what a call reads is moved until
the two sides of a comparison in the C are equal or one count apart, and whatever reaches code that no call has reached
is kept. The search knows the comparisons of the code and nothing of the defects that are planted in it; what a call has
to answer is said by the step that numba compiles.
"""

import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from chip_tools import HERE, TRAPPED, compile_replay, run_program
from recorded_calls import AIDING, NODE, PARAMETERS, SETTINGS, STEP, WHOLE, leaves, sums_of, taken_bytes

from node.kernels.record.integer_node import FIXED_NODE, FIXED_PARAMETERS, FIXED_SETTINGS, new_integers
from node.kernels.record.sensor_record import MAX_IMUS
from node.kernels.step.fixed_step import integer_aiding, integer_step

KEEP, PATCH, BACK = 6, 7, 8  # of replay.c
READINGS, MOMENT, TAKEN = 8 * 20 * MAX_IMUS, 8 * 8, 8 * 12  # bytes
PLACES = dict(zip(
    ("node", "settings", "parameters", "readings", "moment", "aiding", "end"),
    np.cumsum([0, FIXED_NODE.itemsize, FIXED_SETTINGS.itemsize, FIXED_PARAMETERS.itemsize * (1 + MAX_IMUS), READINGS,
               MOMENT, TAKEN]).tolist(),
    strict=True,
))  # fmt: skip
USED_IMUS = 3  # of the recorded nodes
OTHER_LAYOUT = -2  # BORECHAIN_OTHER_LAYOUT of the header
CORRELATED_EACH = 9  # of so many calls of a node that smooths, one has a survey correlated with every error
KEPT = ".filter.ring_", ".cluster.ring_", ".events.ring"  # long, and words of one are like those of another
SEEK = (
    "-std=gnu99", "-O1", "-w", "-fno-wrapv", "-fsanitize=undefined,bounds-strict", "-fsanitize-undefined-trap-on-error",
    "-fsanitize-coverage=trace-cmp",
)  # fmt: skip


class Found(NamedTuple):
    """A call that was found: number of the recorded one it began with, and words moved (place, bytes, number)."""

    call: int
    moved: tuple[tuple[int, int, int], ...]


def movable_words(random: np.random.Generator) -> list[tuple[int, int]]:
    """Place and bytes of every word of a call's inputs that the search may move."""
    found = []
    for path, at, size in leaves(FIXED_NODE):
        width = 4 if path.endswith("yaw") and size in (4, 16) else 8
        words = [(at + k, width) for k in range(0, size - width + 1, width)]
        if path.startswith(KEPT):
            words = [word for word in words if random.random() < 1 / 16]
        elif size // width % MAX_IMUS == 0 and path.startswith((".cluster", ".mount")):
            words = words[: len(words) * USED_IMUS // MAX_IMUS]
        elif any(f"[{imu}]" in path for imu in range(USED_IMUS, MAX_IMUS)):
            continue
        found += words
    for part, last in (("settings", FIXED_SETTINGS.itemsize), ("parameters", FIXED_PARAMETERS.itemsize * 2),
                       ("readings", 8 * 20 * USED_IMUS), ("moment", MOMENT), ("aiding", TAKEN)):  # fmt: skip
        found += [(PLACES[part] + at, 8) for at in range(0, last, 8)]
    return found


def seek_bounds(folder: Path, calls: Path, evaluations: int) -> list[Found]:
    """Search in ``evaluations`` calls of the C that lies in ``folder``, from those recorded in ``calls``."""
    words = movable_words(np.random.default_rng(54))
    (folder / "words.bin").write_bytes(b"".join(struct.pack("<ii", *word) for word in words))
    code = run_program("gcc", *SEEK, "-I.", "-c", "borechain_step.c", "-o", "sought.o", folder=folder)
    assert code.returncode == 0, code.stderr[-2000:]
    done = run_program("gcc", "-std=gnu99", "-O1", "-I.", "sought.o", HERE / "seek.c", "-o", "seek", folder=folder)
    assert done.returncode == 0, done.stderr[-2000:]
    done = run_program(folder / "seek", calls, "words.bin", str(evaluations), folder=folder)
    assert done.returncode == 0, done.stderr
    found = []
    for line in done.stdout.splitlines():
        call, *moved = map(int, line.split())
        found.append(Found(call, tuple(zip(moved[::3], moved[1::3], moved[2::3], strict=True))))
    return found


def read_records(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Kind, slot and body of every record of a file of calls."""
    with path.open("rb") as file:
        while head := file.read(12):
            kind, slot, size = struct.unpack("<iii", head)
            yield kind, slot, file.read(size)


def record_bound_calls(path: Path, calls: Path, found: list[Found]) -> None:
    """Write the calls that were found from those in ``calls``, and those of no world, with answers.

    Of no world are surveys correlated with every error, refused calls, and the first call that tells each event with
    one flag after another the other way; of these a call in which an operation of the C is undefined is left out.
    """
    wanted: dict[int, list[Found]] = {}
    for one in found:
        wanted.setdefault(one.call, []).append(one)
    slots, number = [new_integers() for _ in range(4)], 0
    random, events = np.random.default_rng(54), set[int]()
    with path.open("wb") as file:
        for kind, slot, body in read_records(calls):
            own = slots[slot]
            if kind == NODE:
                own[0]["node"] = np.frombuffer(body, FIXED_NODE)[0]
            elif kind == SETTINGS:
                own[0]["settings"] = np.frombuffer(body, FIXED_SETTINGS)[0]
            elif kind == PARAMETERS:
                own[0]["parameters"] = np.frombuffer(body, FIXED_PARAMETERS)
            elif kind in (STEP, AIDING):
                _put_inputs(own, kind, body)
                sought = wanted.get(number, [])
                if own[0]["node"]["filter"]["smoothing"] == 1 and number % CORRELATED_EACH == 0:
                    sought = [*sought, _correlated(number, random)]
                if sought:
                    file.write(_found_calls(own, kind, sought))
                number += 1
                before, told = own.copy(), int(own[0]["node"]["events"]["told"])
                _answer(own, kind)
                codes = _codes_since(own, told)
                if not events.issuperset(codes):
                    file.write(_found_calls(before, kind, _other_flags(before, number - 1)))
                events.update(codes)
        file.write(_refused_calls(slots[0]))
    _leave_out_undefined(path)


def _leave_out_undefined(path: Path) -> None:
    """Leave out the calls in which an operation of the C, which lies beside the file, is undefined."""
    program = compile_replay(path.parent, "-w", *TRAPPED, name="trapped")
    said = run_program(program, path, folder=path.parent).stdout
    undefined = {int(number) for number in re.findall(r"^undefined (\d+)$", said, re.MULTILINE)}
    number, kept = 0, path.with_suffix(".kept")
    with kept.open("wb") as file:
        for kind, _, body in read_records(path):
            number += kind in (STEP, AIDING)
            if kind not in (STEP, AIDING) or number not in undefined:
                file.write(_framed(kind, body))
    kept.replace(path)


def _correlated(call: int, random: np.random.Generator) -> Found:
    """A recorded call whose last survey is correlated with every error; worlds leave some of these covariances 0."""
    at, size = next((at, size) for path, at, size in leaves(FIXED_NODE) if path == ".filter.surveyed_with")
    moved = tuple((at + k, 8, int(random.integers(-(1 << 36), 1 << 36))) for k in range(0, size, 8))
    return Found(call, moved)


def _codes_since(own: np.ndarray, told: int) -> list[int]:
    """Codes of the events that a record has told beyond the first ``told``."""
    events = own[0]["node"]["events"]
    return [int(events["ring"]["code"][k % len(events["ring"])]) for k in range(told, int(events["told"]))]


def _other_flags(own: np.ndarray, call: int) -> list[Found]:
    """A call with one flag after another the other way: each single word of the record that is 0 or 1."""
    node = own[0:1]["node"].view(np.uint8).reshape(-1)
    found = []
    for _, at, size in leaves(FIXED_NODE):
        value = int(node[at : at + 8].view(np.int64)[0]) if size == 8 else -1
        if value in (0, 1):
            found.append(Found(call, ((at, 8, 1 - value),)))
    return found


def _refused_calls(own: np.ndarray) -> bytes:
    """Calls with numbers of IMUs that the C has no room for: it refuses each, and leaves the record as it is."""
    said = [_framed(NODE, taken_bytes(own[0]["node"], WHOLE.node))]
    sums = sums_of(taken_bytes(own[0]["node"], WHOLE.node))
    answer = struct.pack("<qII", OTHER_LAYOUT, *sums)
    for imus in (MAX_IMUS + 1, 1 << 40, 0, -1):
        own[0]["settings"]["imus"] = imus
        said.append(
            _framed(SETTINGS, taken_bytes(own[0]["settings"], WHOLE.settings))
            + _framed(STEP, struct.pack("<q", MAX_IMUS) + bytes(READINGS + MOMENT) + answer)
            + _framed(AIDING, bytes(TAKEN) + answer)
        )
    return b"".join(said)


def _framed(kind: int, body: bytes) -> bytes:
    return struct.pack("<iii", kind, 0, len(body)) + body


def _put_inputs(own: np.ndarray, kind: int, body: bytes) -> None:
    """Give a record the readings and moment of a recorded step, or its aiding."""
    words = np.frombuffer(body[: len(body) - 16], np.int64)
    if kind == AIDING:
        own[0]["aiding"] = words
        return
    imus = int(words[0])
    own[0]["readings"] = 0
    own[0]["readings"][:imus] = words[1 : 1 + 20 * imus].reshape(imus, 20)
    own[0]["moment"] = words[1 + 20 * imus :]


def _answer(own: np.ndarray, kind: int) -> int:
    """What the numba step answers, whose record is ``own`` afterwards."""
    record = own[0]
    if kind == STEP:
        return integer_step(own["node"], own["settings"], record["parameters"], record["readings"], record["moment"])
    return integer_aiding(own["node"], own["settings"], record["aiding"])


def _found_calls(own: np.ndarray, kind: int, found: list[Found]) -> bytes:
    """Records of the calls that begin with one record, with their answers."""
    node = taken_bytes(own[0]["node"], WHOLE.node)
    written = {SETTINGS: b"", PARAMETERS: b""}
    said = [(NODE, node), (KEEP, b"")]
    for one in found:
        new = own.copy()
        for place, width, value in one.moved:
            part = next(name for name, at in reversed(PLACES.items()) if at <= place)
            at = place - PLACES[part]
            new[part].view(np.uint8).reshape(-1)[at : at + width] = np.frombuffer(
                struct.pack("<q", value)[:width], np.uint8
            )
            if part == "node":
                said.append((PATCH, struct.pack("<iiq", place, width, value)))
        settings = taken_bytes(new[0]["settings"], WHOLE.settings)
        for what, body in ((SETTINGS, settings), (PARAMETERS, new[0]["parameters"].tobytes())):
            if body != written[what]:
                written[what] = body
                said.append((what, body))
        if kind == STEP:
            inputs = struct.pack("<q", MAX_IMUS) + new[0]["readings"].tobytes() + new[0]["moment"].tobytes()
        else:
            inputs = new[0]["aiding"].tobytes()
        answer = _answer(new, kind)
        written[PARAMETERS] = new[0]["parameters"].tobytes()  # the step leaves its corrections in them
        sums = sums_of(taken_bytes(new[0]["node"], WHOLE.node))
        said += [(kind, inputs + struct.pack("<qII", answer, *sums)), (BACK, b"")]
    return b"".join(_framed(what, body) for what, body in said)
