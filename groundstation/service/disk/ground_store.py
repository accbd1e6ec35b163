"""What the ground station keeps: surveys, static records and events, on the disk before they are acknowledged.

A row is the message as it came (telemetry's payload) with the depth it was given, which may come later, and the length
of string below its tube. The same message twice is one row: identity is tube, sequence and content, so a tube that lost
its memory and counts anew still gets its surveys stored.

A row that is damaged is passed over and counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import sqlalchemy as sa

from groundstation.errors import StoreError
from groundstation.service.alarms.crew_alarms import CrewAlarm
from groundstation.service.disk.alarm_record import DamagedAlarmError, alarm_of_text, alarm_to_text
from groundstation.service.disk.database import Database
from groundstation.service.disk.database_tables import (
    ADD,
    ADD_ALARM,
    ADD_MOMENT,
    ADD_SETUP,
    ADD_STAND,
    ALARMS,
    ALL_ALARMS,
    ALL_BLOCKS,
    ALL_JOINTS,
    ALL_MESSAGES,
    ALL_MOMENTS,
    ALL_SETUP,
    ALL_STANDS,
    BLOCKS,
    DROP,
    DROP_ALARM,
    DROP_MOMENT,
    DROP_OVERLAPS,
    DROP_SETUP,
    FIND,
    JOINTS,
    MOMENT_NUMBERS,
    MOMENTS,
    PLACE,
    PROGRESS,
    RECALIBRATION,
    SETUP,
    STRING,
    WHOLE_STRING,
    add_new,
    replace_meta,
)
from groundstation.service.disk.moment_record import DamagedMomentError, moment_of_bytes, moment_to_bytes
from groundstation.service.disk.row_digest import add_digest, as_read, is_sound
from groundstation.service.hole.history import Moment
from groundstation.service.setup.told_value import DamagedSetupError, ToldValue, told_of_text, told_to_text
from groundstation.service.string.depth import NEVER, DepthDoubt, Instant
from groundstation.service.string.stored import Stored
from groundstation.survey.fusion.joint_angles import JointAngle, Pair
from telemetry.errors import DecodeError
from telemetry.messages import Event, Kept, Stand, StaticRecord, SurveyMeasurement
from telemetry.parameters import ParameterBlock, unpack_block
from telemetry.presentation.content import content_of
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.runtime.disk import MACHINE, Disk

ALARMS_KEPT = 1000


class Store(Database):
    """What one rig's ground station keeps.

    Attributes
    ----------
    damaged : messages and rows that could not be read, or are not what was written
    """

    def __init__(self, url: str, disk: Disk = MACHINE) -> None:
        super().__init__(url, disk)
        self.damaged = 0

    def add_message(self, message: Kept, md: float | None, below: float | None = None) -> bool:
        """Store one message, see ``add_messages``."""
        return self.add_messages([Stored(message, md, below)])[0]

    def add_messages(self, arrived: Sequence[Stored[Kept]]) -> list[bool]:
        """Store messages, all or none; durable on return. False for each that was already there.

        Raises
        ------
        StoreError
            When the disk refuses; nothing may be acknowledged then.
        """
        with self._writing() as connection:
            return [self._add(connection, one) for one in arrived]

    @staticmethod
    def _add(connection: sa.Connection, one: Stored[Kept]) -> bool:
        payload = encode_message(one.message)
        same = row_of(one.message, payload)
        kind = type(one.message).__name__
        row = {**same, "kind": kind, "md": one.md, "below": one.below, "payload": payload}
        if connection.execute(add_new(connection.dialect.name), row).rowcount == 1:
            return True
        its = {f"its_{name}": value for name, value in same.items()}
        if connection.execute(FIND, its).scalar() == payload:
            return False
        connection.execute(DROP, its)  # it is damaged
        connection.execute(ADD, row)
        return True

    def place_messages(self, placed: Iterable[tuple[Kept, float | None]]) -> None:
        """Store the depths (m) of messages that came earlier, or take them back (None): all or none."""
        rows = []
        for message, md in placed:
            row = row_of(message, encode_message(message))
            rows.append({"depth": md, **{f"its_{name}": value for name, value in row.items()}})
        with self._writing() as connection:
            connection.execute(PLACE, rows)

    def keep_stand(self, stand: Stand) -> None:
        """Store that the bit stood, in the place of what it overlaps."""
        with self._writing() as connection:
            begun_at, ended_at, md = map(as_read, (stand.begun_at, stand.ended_at, stand.md))
            its = {"its_epoch": stand.epoch, "its_begin": begun_at, "its_end": ended_at, "its_md": md}
            connection.execute(DROP_OVERLAPS, its)
            row = {"epoch": stand.epoch, "begun_at": begun_at, "ended_at": ended_at, "md": md}
            connection.execute(ADD_STAND, add_digest(row))

    def messages(self) -> Iterator[Stored[Kept]]:
        """Everything stored, in the order of arrival; what is damaged is passed over and counted."""
        with self._refusing(), self._engine.connect() as connection:
            for content, payload, md, below in connection.execute(ALL_MESSAGES):
                message = kept_message(content, payload)
                if message is not None and is_depth(md):
                    yield Stored(message, md, below)
                else:
                    self.damaged += 1

    def stands(self) -> list[Stand]:
        """Where the bit stood, in the order of time; what is damaged is passed over and counted."""
        rows = self._sound_rows(ALL_STANDS)
        return [Stand(row["epoch"], row["begun_at"], row["ended_at"], row["md"]) for row in rows]

    def keep_epoch(self, epoch: int) -> None:
        """Store the epoch of rig time."""
        with self._writing() as connection:
            replace_meta(connection, {"epoch": str(epoch)})

    def keep_depth_doubt(self, doubt: DepthDoubt) -> None:
        """Store since when depths are refused, when the crew accepted one, and of which times none is believed."""
        values = {"depth_accepted": _join_numbers(*doubt.accepted)}
        if doubt.trusted is not None:
            values["depth_trusted"] = _join_numbers(*doubt.trusted)
        if doubt.times:
            values["depth_doubted"] = "; ".join(map(_stand_text, doubt.times))
        with self._writing() as connection:
            replace_meta(connection, values, without=["depth_trusted", "depth_doubted"])

    def depth_doubt(self) -> DepthDoubt:
        """What was kept last of what is doubtful of the depth."""
        with self._refusing():
            meta = self._meta()
        trusted, accepted, times = (meta.get(f"depth_{name}") for name in ("trusted", "accepted", "doubted"))
        try:
            return DepthDoubt(
                None if trusted is None else _reading_of(trusted),
                NEVER if accepted is None else _instant_of(accepted),
                () if times is None else tuple(map(_stand_of, times.split(";"))),
            )
        except ValueError as error:
            raise StoreError(
                f"database {self._where}: expected numbers of the depth, got {trusted!r}, {accepted!r} and {times!r}"
            ) from error

    def keep_joints(self, joints: Mapping[Pair, JointAngle]) -> None:
        """Store the angles of the joints, in the place of those stored before."""
        rows = [
            add_digest({"upper": upper, "lower": lower, "angle": as_read(joint.angle), "var": as_read(joint.var)})
            for (upper, lower), joint in joints.items()
        ]
        with self._writing() as connection:
            connection.execute(sa.delete(JOINTS))
            if rows:
                connection.execute(sa.insert(JOINTS), rows)

    def joints(self) -> dict[Pair, JointAngle]:
        """Angles of the joints; what is damaged is passed over and counted."""
        rows = self._sound_rows(ALL_JOINTS) if self._has(JOINTS) else []
        return {(row["upper"], row["lower"]): JointAngle(row["angle"], row["var"]) for row in rows}

    def epoch(self) -> int:
        """Epoch of rig time that was known last, 0 for none."""
        with self._refusing():
            return int(self._meta().get("epoch", "0"))

    def keep_tally(self, tubes: list[int]) -> None:
        """Store which tubes hang in the string, top first."""
        with self._writing() as connection:
            connection.execute(sa.delete(STRING))
            connection.execute(sa.insert(STRING), [{"place": n, "tube": tube} for n, tube in enumerate(tubes, 1)])

    def tally(self) -> list[int]:
        """Tubes of the string, top first."""
        with self._refusing(), self._engine.connect() as connection:
            return [row.tube for row in connection.execute(WHOLE_STRING)]

    def keep_block(self, block: ParameterBlock) -> None:
        """Store a parameter block before it is sent, so that what a tube uses can be named later."""
        digest = block.sha256().hex()
        with self._writing() as connection:
            connection.execute(sa.delete(BLOCKS).where(BLOCKS.c.sha256 == digest))
            connection.execute(sa.insert(BLOCKS).values(sha256=digest, content=block.canonical()))

    def blocks(self) -> list[ParameterBlock]:
        """Every block that was sent."""
        with self._refusing(), self._engine.connect() as connection:
            rows = connection.execute(ALL_BLOCKS).all()
        try:
            return [unpack_block(row.content) for row in rows]
        except DecodeError as error:
            raise StoreError(f"database {self._where}: blocks: {error}") from error

    def keep_progress(self, text: str) -> None:
        """Store how far the calibration in the field has come."""
        with self._writing() as connection:
            connection.execute(sa.delete(RECALIBRATION))
            connection.execute(sa.insert(RECALIBRATION).values(id=1, progress=text))

    def progress(self) -> str | None:
        """How far the calibration in the field had come."""
        with self._refusing(), self._engine.connect() as connection:
            return connection.execute(PROGRESS).scalar()

    def keep_alarms(self, alarms: Iterable[CrewAlarm]) -> None:
        """Store alarms as they are now; of all the newest are kept."""
        texts = {alarm.number: alarm_to_text(alarm) for alarm in alarms}
        if not texts:
            return
        with self._writing() as connection:
            connection.execute(DROP_ALARM, [{"its_number": number} for number in texts])
            connection.execute(ADD_ALARM, [{"number": n, "content": text} for n, text in texts.items()])
            if max(texts) > ALARMS_KEPT:
                connection.execute(sa.delete(ALARMS).where(ALARMS.c.number <= max(texts) - ALARMS_KEPT))

    def alarms(self) -> list[CrewAlarm]:
        """Alarms of before, the oldest first; what is damaged is passed over and counted."""
        if not self._has(ALARMS):
            return []
        with self._refusing(), self._engine.connect() as connection:
            rows = connection.execute(ALL_ALARMS).all()
        found = []
        for row in rows:
            try:
                found.append(alarm_of_text(row.content))
            except DamagedAlarmError:
                self.damaged += 1
        return found

    def keep_told(self, told: ToldValue) -> None:
        """Store what was told of the setup, before it counts; in the place of one that is damaged.

        Raises
        ------
        StoreError
            When the disk refuses.
        """
        with self._writing() as connection:
            connection.execute(DROP_SETUP, {"its_number": told.number})
            connection.execute(ADD_SETUP, add_digest({"number": told.number, "content": told_to_text(told)}))

    def told(self) -> list[ToldValue]:
        """What was told of the setup, the oldest first; what is damaged is passed over and counted."""
        found = []
        for row in self._sound_rows(ALL_SETUP) if self._has(SETUP) else []:
            try:
                found.append(told_of_text(row["content"]))
            except DamagedSetupError:
                self.damaged += 1
        return found

    def _sound_rows(self, statement: sa.Select[Any]) -> list[dict[str, Any]]:
        """Rows whose hash fits; the others are counted."""
        with self._refusing(), self._engine.connect() as connection:
            rows = [dict(row) for row in connection.execute(self._known_columns(statement)).mappings()]
        sound = [row for row in rows if is_sound(row)]
        self.damaged += len(rows) - len(sound)
        return sound

    def keep_moments(self, basis: str, moments: Sequence[Moment], dropped: Iterable[int] = ()) -> None:
        """Store what was known at the end of stops, by a basis, in the place of what was kept of them before.

        Raises
        ------
        StoreError
            When the disk refuses.
        """
        rows = [{"number": one.number, "basis": basis, "content": moment_to_bytes(one)} for one in moments]
        gone = [{"its_number": number} for number in {*dropped, *(one.number for one in moments)}]
        with self._writing() as connection:
            if gone:
                connection.execute(DROP_MOMENT, gone)
            if rows:
                connection.execute(ADD_MOMENT, rows)

    def moments(self, basis: str) -> list[Moment]:
        """What was kept of stops by a basis, the oldest first; what is damaged is passed over, to be made anew."""
        if not self._has(MOMENTS):
            return []
        with self._refusing(), self._engine.connect() as connection:
            rows = connection.execute(ALL_MOMENTS, {"its_basis": basis}).all()
        found = []
        for row in rows:
            try:
                found.append(moment_of_bytes(row.number, row.content))
            except DamagedMomentError:
                continue
        return found

    def moment_numbers(self) -> list[int]:
        """Numbers of all moments that are kept, whatever they rest on."""
        if not self._has(MOMENTS):
            return []
        with self._refusing(), self._engine.connect() as connection:
            return [row.number for row in connection.execute(MOMENT_NUMBERS)]


def _join_numbers(*values: float) -> str:
    return " ".join(map(repr, values))


def _stand_text(stand: Stand) -> str:
    return _join_numbers(stand.epoch, stand.begun_at, stand.ended_at, stand.md)


def _reading_of(text: str) -> tuple[int, float, float]:
    epoch, at, md = text.split()
    return int(epoch), float(at), float(md)


def _instant_of(text: str) -> Instant:
    epoch, at = text.split()
    return int(epoch), float(at)


def _stand_of(text: str) -> Stand:
    epoch, begun_at, ended_at, md = text.split()
    return Stand(int(epoch), float(begun_at), float(ended_at), float(md))


def row_of(message: Kept, payload: bytes) -> dict[str, Any]:
    """Identity of a message."""
    return {"tube": message.tube, "sequence": message.sequence, "content": content_of(payload).hex()}


def kept_message(content: str, payload: bytes) -> Kept | None:
    """Message of a stored payload; None of one that is damaged, also where a changed bit left other numbers."""
    if content_of(payload).hex() != content:
        return None
    try:
        message = decode_message(payload)
    except DecodeError:
        return None
    return message if isinstance(message, SurveyMeasurement | Event | StaticRecord) else None


def is_depth(value: object) -> bool:
    """Whether a stored depth is one, or not known yet."""
    return value is None or (isinstance(value, float) and math.isfinite(value) and value >= 0.0)
