"""Every attack on every kind of message, and what came of it: ``python tests/telemetry/attacks.py`` writes the table.

On a joint the attacker writes to the bus and has no key. End to end he is a stolen tube 2 between tube 1 and the base,
with the keys of tube 2: he seals frames as he likes and has the payloads of others in his hands.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parent)]

from sealed_string import DOWN, SealedString, make_folder, messages_in

from telemetry.application.end_seal import HEAD as END_HEAD
from telemetry.application.end_seal import OVERHEAD as END_OVERHEAD
from telemetry.application.end_to_end import KEPT_WAIT
from telemetry.media.port import Priority
from telemetry.messages import BASE, ENCODER, Side
from telemetry.presentation.msgpack_codec import encode_message, open_payload
from telemetry.schema import MessageKind
from telemetry.transport.joint_seal import HEAD, PROOF_WITHIN, SETTLED
from telemetry.transport.seal import TAG_SIZE, WINDOW, SealKey

PAGE = Path(__file__).parents[2] / "docs" / "seals.md"
ONE_HOP = (MessageKind.AIDING, MessageKind.HELLO, MessageKind.TIME_REQUEST, MessageKind.TIME_REPLY)
UP = (
    MessageKind.NODE_STATE,
    MessageKind.SURVEY_MEASUREMENT,
    MessageKind.REPLY,
    MessageKind.EVENT,
    MessageKind.BLOCK_STATUS,
    MessageKind.STATIC_RECORD,
)
END_TO_END = (*UP, *DOWN)
ON_A_JOINT = (*ONE_HOP, *END_TO_END)
ARRIVED = KEPT_WAIT + 0.5  # s, after which what was said has arrived, though it waited for a state to go up with
LONG = 12.0  # s, after which what is not proven is counted
FOREIGN = SealKey(b"not of this rig!")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of an attack: whether anything changed, and the counts that grew."""

    tried: int
    had_effect: bool
    counted: dict[str, int]


def recorded(folder: Path, kind: MessageKind, repeats: int = 3) -> SealedString:
    """A string that has said messages of a kind; what crossed its joints is noted."""
    string = SealedString(folder)
    string.settle()
    for _ in range(repeats):
        string.say(kind)
        string.run(ARRIVED)
    string.evidence = string.frames_with(kind)[-4:]
    assert string.evidence, f"no frame brought a {kind.name.lower()}"
    return string


def attempt(string: SealedString, made: list[tuple[tuple[int, Side], bytes]]) -> Outcome:
    """Have frames arrive in a moment at which nothing else does, and look what they changed."""
    before, counts = string.effects(), string.counts()
    for end, frame in made:
        string.inject(end, frame)
    changed = string.effects() != before
    string.run(PROOF_WITHIN + 1.0)
    grown = {name: count - counts.get(name, 0) for name, count in string.counts().items()}
    return Outcome(len(made), changed, {name: count for name, count in grown.items() if count > 0})


# on a joint --------------------------------------------------------------------------------------------------------


def joint_attack(change: Callable[[SealedString, MessageKind, list[bytes]], Iterable[bytes]]) -> Callable[..., Outcome]:
    def attack(string: SealedString, kind: MessageKind) -> Outcome:
        frames = list(change(string, kind, string.evidence))
        return attempt(string, [(string.end_of(kind), frame) for frame in frames])

    return attack


def forged(_string: SealedString, _kind: MessageKind, frames: list[bytes]) -> Iterable[bytes]:
    for frame in frames:
        yield frame[HEAD.size : -TAG_SIZE]  # as before there were seals
        yield frame[:-TAG_SIZE] + FOREIGN.tag(frame[:-TAG_SIZE])


def same_session(string: SealedString, _kind: MessageKind, frames: list[bytes]) -> Iterable[bytes]:
    string.run(1.0)
    yield from frames


def old_session(string: SealedString, kind: MessageKind, frames: list[bytes]) -> Iterable[bytes]:
    restart(string, string.end_of(kind)[0])
    yield from frames


def after_both_restart(string: SealedString, kind: MessageKind, frames: list[bytes]) -> Iterable[bytes]:
    del kind
    restart(string, BASE, ENCODER, 2, 1)
    yield from frames


def long_ago(string: SealedString, kind: MessageKind, frames: list[bytes]) -> Iterable[bytes]:
    let_pass(string, string.end_of(kind))
    yield from frames


def held_back(string: SealedString, kind: MessageKind, _frames: list[bytes]) -> Iterable[bytes]:
    """Frames that arrive only after 64 later ones."""
    end, held, take = string.end_of(kind), [], string._deliver

    def deliver(to: tuple[int, Side], frame: bytes) -> None:
        if to == end and not held and any(k is kind for k, _ in messages_in(frame)):
            held.append(frame)
        else:
            take(to, frame)

    string._deliver = deliver  # type: ignore[method-assign]
    string.say(kind)
    string.run(20.0, lambda: bool(held))
    let_pass(string, end)
    string._deliver = take  # type: ignore[method-assign]
    yield from held


def let_pass(string: SealedString, end: tuple[int, Side]) -> None:
    """Run until 64 more frames have come at an end."""
    begun = len(string.wire[end])
    string.run(120.0, lambda: len(string.wire[end]) > begun + WINDOW + 1)


def truncated(_string: SealedString, _kind: MessageKind, frames: list[bytes]) -> Iterable[bytes]:
    yield from (frames[0][:n] for n in range(0, len(frames[0]), 7))
    yield from (frames[0][:-1], frames[0][1:])


def spliced(string: SealedString, kind: MessageKind, frames: list[bytes]) -> Iterable[bytes]:
    first, last = frames[0], string.wire[string.end_of(kind)][-1]
    yield last[: HEAD.size] + first[HEAD.size : -TAG_SIZE] + last[-TAG_SIZE:]
    yield first[: HEAD.size] + last[HEAD.size :]
    yield first[:-TAG_SIZE] + last[-TAG_SIZE:]


def wrong_joint(string: SealedString, kind: MessageKind) -> Outcome:
    frames, right = string.evidence, string.end_of(kind)
    ends = [end for end in string.wire if end != right and end not in ((BASE, Side.UPPER), (1, Side.LOWER))]
    return attempt(string, [(end, frame) for end in ends for frame in frames])


# end to end --------------------------------------------------------------------------------------------------------


def payload_attack(
    change: Callable[[SealedString, MessageKind, list[bytes]], Iterable[bytes]],
) -> Callable[..., Outcome]:
    """What a stolen tube 2 hands on, in frames that it seals itself."""

    def attack(string: SealedString, kind: MessageKind) -> Outcome:
        payloads = [p for frame in string.evidence for k, p in messages_in(frame) if k is kind]
        made = list(change(string, kind, payloads))
        thief = string.endpoints[2]._links[Side.LOWER if kind in DOWN else Side.UPPER]
        before, counts = heard(string, kind), string.counts()
        for number, payload in enumerate(made):
            thief.send_best_effort(payload, ("thief", number), Priority.COMMAND)
            string.run(0.1)
        changed = heard(string, kind) != before
        string.run(LONG)
        grown = {name: count - counts.get(name, 0) for name, count in string.counts().items()}
        return Outcome(len(made), changed, {name: count for name, count in grown.items() if count > 0})

    return attack


def heard(string: SealedString, kind: MessageKind) -> object:
    """What the victim has heard of a kind, and what tube 1 still keeps.

    A part of a block, and what a tube says of it, may come as often as they like: both name the whole state.
    """
    victim = 1 if kind in DOWN else BASE
    of_kind = [m for m in string.heard[victim] if open_payload(encode_message(m)).kind is kind]
    repeatable = kind in (MessageKind.BLOCK_SEGMENT, MessageKind.BLOCK_STATUS)
    return list(dict.fromkeys(of_kind)) if repeatable else of_kind, string.endpoints[1].mail.outbox_size


def forged_payload(string: SealedString, kind: MessageKind, payloads: list[bytes]) -> Iterable[bytes]:
    """Unsealed, under a key of no rig, and under the thief's own key."""
    thief = string.seals(2).ring.seal_key(1, "end", 2)
    assert thief is not None
    for payload in payloads[:1]:
        head, content = payload[: END_HEAD.size], payload[END_OVERHEAD:]
        way = b"down" if kind in DOWN else b"up"
        yield content
        for key, tube in ((FOREIGN, 1), (thief, 1), (thief, 2)):
            yield head + key.tag(way, bytes([tube]), head, content) + content


def payload_of_old_session(string: SealedString, kind: MessageKind, payloads: list[bytes]) -> Iterable[bytes]:
    restart(string, 1 if kind in DOWN else BASE)
    yield from payloads


def payload_after_reboot(string: SealedString, _kind: MessageKind, payloads: list[bytes]) -> Iterable[bytes]:
    restart(string, 1)
    yield from payloads


def payload_of_long_ago(string: SealedString, _kind: MessageKind, payloads: list[bytes]) -> Iterable[bytes]:
    """Of before 64 later orders, which is what a tube remembers."""
    for _ in range(66):
        string.say(MessageKind.COMMAND)
        string.run(0.3)
    yield from payloads[-3:]


def truncated_payload(_string: SealedString, _kind: MessageKind, payloads: list[bytes]) -> Iterable[bytes]:
    yield payloads[0][:END_OVERHEAD] + b"\x80"
    yield payloads[0][: END_OVERHEAD - 1]
    yield payloads[0][:-1]
    yield payloads[0][:-1] + bytes([payloads[0][-1] ^ 1])


def spliced_payload(string: SealedString, kind: MessageKind, payloads: list[bytes]) -> Iterable[bytes]:
    """The seal of one message with what another says, and the other way round."""
    string.say(MessageKind.EVENT if kind is not MessageKind.EVENT else MessageKind.NODE_STATE)
    string.run(ARRIVED)
    others = [p for frame in string.wire[BASE, Side.LOWER] for k, p in messages_in(frame) if k is not kind]
    others = [p for p in others if p[0] == payloads[0][0]]
    yield payloads[0][:END_OVERHEAD] + others[-1][END_OVERHEAD:]
    yield others[-1][:END_OVERHEAD] + payloads[0][END_OVERHEAD:]


def same_session_payload(_string: SealedString, _kind: MessageKind, payloads: list[bytes]) -> Iterable[bytes]:
    yield from payloads[-3:]


def restart(string: SealedString, *addresses: int) -> None:
    """Power cuts and what follows of them, until all is as before."""
    for address in addresses:
        string.start(address)
    string.talking = True
    string.run(5.0)
    string.talking = False
    string.run(SETTLED + 1.0)


Attack = Callable[[SealedString, MessageKind], Outcome]
JOINT_ATTACKS: dict[str, Attack] = {
    "forged": joint_attack(forged),
    "truncated": joint_attack(truncated),
    "spliced": joint_attack(spliced),
    "wrong joint": wrong_joint,
    "same session": joint_attack(same_session),
    "64 later": joint_attack(long_ago),
    "reordered": joint_attack(held_back),
    "old session": joint_attack(old_session),
    "after reboot": joint_attack(after_both_restart),
}  # in this order on one string
END_ATTACKS: dict[str, Attack] = {
    "forged": payload_attack(forged_payload),
    "truncated": payload_attack(truncated_payload),
    "spliced": payload_attack(spliced_payload),
    "same session": payload_attack(same_session_payload),
    "64 later": payload_attack(payload_of_long_ago),
    "old session": payload_attack(payload_of_old_session),
    "after reboot": payload_attack(payload_after_reboot),
}  # in this order on one string


def outcomes(folder: Path, kind: MessageKind, attacks: dict[str, Attack]) -> dict[str, Outcome]:
    """Outcome of each attack on one kind of message."""
    string = recorded(folder, kind)
    return {name: attack(string, kind) for name, attack in attacks.items()}


def name_of(kind: MessageKind) -> str:
    return kind.name.lower().replace("_", " ")


def cell(outcome: Outcome) -> str:
    """What the table says: by what it was refused."""
    if not outcome.tried:
        return "-"
    if outcome.had_effect:
        return "**had an effect**"
    names = sorted(outcome.counted)
    return ", ".join(name.removeprefix("seal_").removeprefix("end_").replace("_", " ") for name in names) or "no effect"


def table(folder: Path, attacks: dict[str, Attack], kinds: Iterable[MessageKind]) -> str:
    lines = ["| message | " + " | ".join(attacks) + " |", "|---" * (len(attacks) + 1) + "|"]
    for kind in kinds:
        cells = [cell(outcome) for outcome in outcomes(folder, kind, attacks).values()]
        lines.append(f"| {name_of(kind)} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def filled(text: str, folder: Path) -> str:
    """The page with its tables made anew."""
    for name, attacks, kinds in (("joint", JOINT_ATTACKS, ON_A_JOINT), ("between", END_ATTACKS, END_TO_END)):
        begin, end = f"<!-- {name} -->\n", f"<!-- end {name} -->"
        before, _, rest = text.partition(begin)
        text = f"{before}{begin}\n{table(folder, attacks, kinds)}\n{end}{rest.partition(end)[2]}"
    return text


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        PAGE.write_text(filled(PAGE.read_text(), make_folder(Path(place) / "keys")))
