"""Which generation of keys is in use, told by who can open what was sealed: the one that both have, and never another.

Everything is sealed by one end and opened by an end that has a single generation, so that a wrong choice is seen
whatever the payload says of itself; then the old keys end.
"""

from __future__ import annotations

import datetime
import itertools
from collections.abc import Callable

import pytest

from telemetry.application.depth_seal import open_depth, seal_depth
from telemetry.application.end_seal import DOWN, UP, BaseEnd, SealFinding, SealingEnd, open_sealed
from telemetry.application.measurement_seal import MeasurementSeal
from telemetry.errors import KeyFileError
from telemetry.media.credentials import DEPTH_SOURCE
from telemetry.messages import BASE, ENCODER, Aiding
from telemetry.transport import joint_seal
from telemetry.transport.joint_seal import HEAD, JointSeal
from telemetry.transport.key_ring import Generation, KeyRing, key_file, keys_of, pack_ring, read_ring

NOW = datetime.datetime(2026, 5, 4, 6, tzinfo=datetime.UTC)
SECRETS = {number: bytes([number]) * 32 for number in (1, 2, 3)}


def ring(address: int, *numbers: int, revoked: tuple[int, ...] = ()) -> KeyRing:
    """Keys of a process, of these generations."""
    made = (Generation(n, keys_of(SECRETS[n], address, revoked), NOW) for n in numbers)
    return KeyRing("rig-1", address, tuple(made), frozenset(revoked))


class Held:
    """Keys that may change, as those of a file."""

    def __init__(self, address: int, *numbers: int) -> None:
        self.address = address
        self.have(*numbers)

    def have(self, *numbers: int) -> None:
        self._ring = ring(self.address, *numbers)

    def __call__(self) -> KeyRing:
        return self._ring


def lots() -> Callable[[], int]:
    """Session numbers, none twice."""
    numbers = itertools.count(1000)
    return lambda: next(numbers)


def generation_of(payload: bytes, address: int, way: bytes, tube: int = 1) -> int:
    """The one generation whose key opens a payload between a tube and the base."""
    opening = [n for n in SECRETS if open_sealed(ring(address, n), "end", way, payload, tube) is not None]
    (number,) = opening
    return number


class Ends:
    """A tube and the base, in session."""

    def __init__(self, tube: tuple[int, ...], base: tuple[int, ...]) -> None:
        self.tube_keys, self.base_keys = Held(1, *tube), Held(BASE, *base)
        lot = lots()
        self.tube, self.base = SealingEnd(1, self.tube_keys, lot), BaseEnd(self.base_keys, lot)

    def meet(self) -> None:
        """Let the base offer a session and the tube take it."""
        assert self.base.open(self.tube.close(b"hello"), 1, 0.0) is SealFinding.NOTHING
        ((_, offer),) = self.base.due_offers(lambda tube: b"offer")
        assert self.tube.open(offer, 0.1, is_offer=True)
        assert self.base.open(self.tube.close(b"first"), 1, 0.2) is SealFinding.BEGINS

    def told_down(self) -> int:
        """Generation with which the base speaks; the tube believes it."""
        payload = self.base.close(b"order", 1)
        assert payload is not None
        assert self.tube.open(payload, 1.0, is_offer=False)
        return generation_of(payload, 1, DOWN)

    def told_up(self) -> int:
        """Generation with which the tube speaks; the base believes it."""
        payload = self.tube.close(b"survey")
        assert self.base.open(payload, 1, 1.0) is SealFinding.BELIEVED
        return generation_of(payload, BASE, UP)


@pytest.mark.parametrize("numbers", [(1,), (1, 2), (2, 3)])
def test_a_tube_that_has_not_heard_the_base_speaks_with_its_oldest_keys(numbers: tuple[int, ...]) -> None:
    end = SealingEnd(1, Held(1, *numbers), lots())
    assert generation_of(end.close(b"hello"), BASE, UP) == numbers[0]


@pytest.mark.parametrize(
    ("tube", "base", "common"),
    [((1,), (1,), 1), ((1, 2), (1,), 1), ((1,), (1, 2), 1), ((1, 2), (1, 2), 2), ((2, 3), (1, 2), 2)],
)
def test_both_ends_speak_with_the_newest_keys_that_both_have(
    tube: tuple[int, ...], base: tuple[int, ...], common: int
) -> None:
    ends = Ends(tube, base)
    ends.meet()
    assert (ends.told_down(), ends.told_up()) == (common, common)


def test_keys_that_come_within_a_session_are_used_as_soon_as_both_have_them_and_the_old_ones_end() -> None:
    for _ in range(2):  # and the same again in another string
        ends = Ends((1,), (1,))
        ends.meet()
        recorded = ends.tube.close(b"survey under the old keys")
        ends.base_keys.have(1, 2)
        assert (ends.told_down(), ends.told_up()) == (1, 1)
        ends.tube_keys.have(1, 2)
        assert ends.told_up() == 2  # the base has said by now that it has them
        assert ends.told_down() == 2
        ends.base_keys.have(2)
        ends.tube_keys.have(2)
        assert (ends.told_down(), ends.told_up()) == (2, 2)
        assert ends.base.open(recorded, 1, 2.0) is SealFinding.NOTHING


def test_of_too_many_offers_the_oldest_is_dropped() -> None:
    """A tube that starts again and again is offered a session each time; what it takes last must be there."""
    base = BaseEnd(Held(BASE, 1), lots())
    lot = lots()
    offers, tubes = [], []
    for start in range(10):
        tube = SealingEnd(1, Held(1, 1), lot)
        base.open(tube.close(b"hello"), 1, float(start) / 10.0)
        ((_, offer),) = base.due_offers(lambda tube: b"offer")
        offers.append(offer)
        tubes.append(tube)
    taken = []
    for offer, tube in zip(offers, tubes, strict=True):
        assert tube.open(offer, 2.0, is_offer=True)
        taken.append(tube.close(b"first"))
    assert base.open(taken[0], 1, 2.0) is SealFinding.NOTHING
    assert base.open(taken[-1], 1, 2.0) is SealFinding.BEGINS


def joint(address: int, *numbers: int) -> JointSeal:
    return JointSeal(address, Held(address, *numbers), lots_of(address))


def lots_of(address: int) -> Callable[[], int]:
    numbers = itertools.count(1000 * address)
    return lambda: next(numbers)


def joint_generation(frame: bytes, sender: int, addressee: int) -> int:
    """The one generation whose key fits a frame of a joint."""
    purpose = ("call", 0) if HEAD.unpack_from(frame)[4] == joint_seal.ANYBODY else ("joint", sender)
    (number,) = [
        n
        for n in SECRETS
        if ring(addressee, n).generations[0].seal_key(*purpose).fits(frame[-8:], frame[:-8])  # type: ignore[union-attr]
    ]
    return number


def joined(one: JointSeal, two: JointSeal) -> None:
    """Let two ends prove themselves to each other."""
    for step in range(8):
        now = 0.3 * step
        for a, b in ((one, two), (two, one)):
            for frame in a.own_frames(now):
                b.open(frame, now)
    assert one.partner is not None
    assert two.partner is not None


@pytest.mark.parametrize(("one", "two", "common"), [((1,), (1,), 1), ((1, 2), (1,), 1), ((1, 2), (1, 2), 2)])
def test_a_joint_speaks_with_the_newest_keys_of_both_and_calls_with_the_oldest(
    one: tuple[int, ...], two: tuple[int, ...], common: int
) -> None:
    upper, lower = joint(2, *one), joint(1, *two)
    (call,) = joint(2, *one).own_frames(0.0)
    assert joint_generation(call, 2, 1) == one[0]
    joined(upper, lower)
    for sender, receiver in ((upper, lower), (lower, upper)):
        frame = sender.close(b"beat")
        assert frame is not None
        assert joint_generation(frame, sender._address, receiver._address) == common
        assert receiver.open(frame, 3.0) == b"beat"


def test_no_number_comes_twice_in_a_session_of_a_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint_seal, "LAST_NUMBER", 10)
    upper, lower = joint(2, 1), joint(1, 1)
    joined(upper, lower)
    seen = set()
    for step in range(35):
        frame = upper.close(b"%d" % step)
        assert frame is not None
        _, _, _, _, _, session, _, number = HEAD.unpack_from(frame)
        seen.add((session, number))
        assert lower.open(frame, 3.0 + 0.01 * step) == b"%d" % step
        back = lower.close(b"back")
        assert back is not None
        upper.open(back, 3.0 + 0.01 * step)
        if step % 10 == 9:
            joined(upper, lower)
    assert len(seen) == 35
    assert len({session for session, _ in seen}) > 1


def test_a_frame_that_the_medium_doubles_is_no_attack_however_many_came_before() -> None:
    upper, lower = joint(2, 1), joint(1, 1)
    joined(upper, lower)
    frames = [upper.close(b"beat") or b"" for _ in range(200)]
    for step, frame in enumerate(frames):
        lower.open(frame, 3.0 + 0.01 * step)
    assert lower.open(frames[-1], 5.0) is None
    assert lower.counters["seal_duplicate"] == 1
    assert lower.open(frames[0], 5.0) is None
    assert lower.counters["seal_repeated"] == 1


AIDING = Aiding(1.0, 1e-8, 0.0, 0.0, 0.1, 100.0, 5, 0, epoch=1)


@pytest.mark.parametrize("numbers", [(1,), (1, 2), (2, 3)])
def test_who_says_it_to_all_uses_the_oldest_keys_which_all_have(numbers: tuple[int, ...]) -> None:
    sealed = MeasurementSeal(Held(ENCODER, *numbers)).close(AIDING)
    admitting = [n for n in SECRETS if MeasurementSeal(Held(1, n)).admits(sealed, 1, 100.1)]
    assert admitting == [numbers[0]]
    depth = seal_depth(ring(DEPTH_SOURCE, *numbers), b"a reading of the depth")
    assert [n for n in SECRETS if open_depth(Held(BASE, n), depth) is not None] == [numbers[0]]


def test_a_measurement_is_believed_until_it_is_exactly_as_old_as_may_be() -> None:
    """Five seconds of rig time: the joints' own repetitions take less, and a recording is older."""
    sealed = MeasurementSeal(Held(ENCODER, 1)).close(AIDING)
    assert MeasurementSeal(Held(1, 1)).admits(sealed, 1, 105.0)
    assert not MeasurementSeal(Held(1, 1)).admits(sealed, 1, 105.001)


def test_a_block_is_sealed_with_the_newest_keys_of_a_tube_or_with_the_oldest_of_one_that_is_not_known() -> None:
    base = ring(BASE, 1, 2)
    keys = {n: keys_of(SECRETS[n], 1)["block", 1] for n in (1, 2)}
    assert base.block_key(1) == keys[1]
    assert [base.block_key(1, newest) for newest in (1, 2, 3)] == [keys[1], keys[2], keys[2]]
    assert ring(BASE, 2, 3).block_key(1, 1) == keys_of(SECRETS[2], 1)["block", 1]
    revoked = KeyRing("rig-1", BASE, base.generations, frozenset({1}))  # its keys are still in the file
    assert [revoked.block_key(1), revoked.block_key(1, 2)] == [None, None]
    assert revoked.block_key(2) == keys_of(SECRETS[1], 2)["block", 2]


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o610, 0o601])
def test_keys_that_others_may_touch_are_refused(tmp_path: object, mode: int) -> None:
    path = key_file(tmp_path, 1)  # type: ignore[arg-type]
    path.write_text(pack_ring(ring(1, 1, 2)))
    path.chmod(0o600)
    assert read_ring(path, 1, NOW).newest == 2
    path.chmod(mode)
    with pytest.raises(KeyFileError, match="expected permissions 0600"):
        read_ring(path, 1, NOW)
