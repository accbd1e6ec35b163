"""What the ground station keeps: surveys, static records and events, on the disk before they are acknowledged.

A row is the message as it came (telemetry's payload) with the depth it was given, which may come later, and the length
of string below its tube. The same message twice is one row: identity is tube, sequence and content, so a tube that lost
its memory and counts anew still gets its surveys stored.

A disk that refuses leaves what is there readable: a database that cannot be written is opened all the same, a row that
is damaged is passed over and counted, and a file that was deleted under the running program is noticed before the next
commit, which would be lost with it.
"""

from __future__ import annotations

import contextlib
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from groundstation.errors import StoreError
from groundstation.service.alarm_record import DamagedAlarmError, alarm_of_text, alarm_to_text
from groundstation.service.crew_alarms import CrewAlarm
from groundstation.service.depth import NEVER, Doubt, Instant
from groundstation.survey.joint_angles import Joint, Pair
from telemetry.errors import DecodeError
from telemetry.messages import Event, Kept, Stand, StaticRecord, SurveyMeasurement
from telemetry.parameters import ParameterBlock, unpack_block
from telemetry.presentation.content import content_of
from telemetry.presentation.msgpack_codec import decode, encode
from telemetry.runtime.disk import MACHINE, Disk

SCHEMA = 3
READABLE = (2, 3)  # schemas; what a later one has more is made when it is opened
ALARMS_KEPT = 1000
SHOWN = 5  # tables named of a database that is not ours
METADATA = sa.MetaData()
META = sa.Table(
    "meta",
    METADATA,
    sa.Column("name", sa.String(32), primary_key=True),
    sa.Column("value", sa.String(64), nullable=False),
)
MESSAGES = sa.Table(
    "messages",
    METADATA,
    sa.Column("id", sa.Integer, primary_key=True),
    sa.Column("tube", sa.Integer, nullable=False),
    sa.Column("sequence", sa.BigInteger, nullable=False),
    sa.Column("content", sa.String(32), nullable=False),
    sa.Column("kind", sa.String(16), nullable=False),
    sa.Column("md", sa.Float),
    sa.Column("below", sa.Float),
    sa.Column("payload", sa.LargeBinary, nullable=False),
    sa.UniqueConstraint("tube", "sequence", "content"),
)
SAME = sa.and_(*(MESSAGES.c[name] == sa.bindparam(f"its_{name}") for name in ("tube", "sequence", "content")))
FIND, DROP, ADD = sa.select(MESSAGES.c.payload).where(SAME), sa.delete(MESSAGES).where(SAME), sa.insert(MESSAGES)
PLACE = sa.update(MESSAGES).where(SAME).values(md=sa.bindparam("depth"))
STANDS = sa.Table(
    "stands",
    METADATA,
    sa.Column("epoch", sa.BigInteger, primary_key=True, autoincrement=False),
    sa.Column("begun_at", sa.Float, primary_key=True),
    sa.Column("ended_at", sa.Float, nullable=False),
    sa.Column("md", sa.Float, nullable=False),
)
STRING = sa.Table(
    "string",
    METADATA,
    sa.Column("place", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("tube", sa.Integer, nullable=False),
)
BLOCKS = sa.Table(
    "blocks",
    METADATA,
    sa.Column("sha256", sa.String(64), primary_key=True),
    sa.Column("content", sa.LargeBinary, nullable=False),
)
RECALIBRATION = sa.Table(
    "recalibration",
    METADATA,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("progress", sa.Text, nullable=False),
)


JOINTS = sa.Table(
    "joints",
    METADATA,
    sa.Column("upper", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("lower", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("angle", sa.Float, nullable=False),
    sa.Column("var", sa.Float, nullable=False),
)
ALARMS = sa.Table(
    "alarms",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("content", sa.Text, nullable=False),
)
DROP_ALARM, ADD_ALARM = sa.delete(ALARMS).where(ALARMS.c.number == sa.bindparam("its_number")), sa.insert(ALARMS)


@dataclass(frozen=True, slots=True)
class Stored:
    """A message from the store, the depth (m) it was measured at and the string (m) below its tube, if known."""

    message: Kept
    md: float | None
    below: float | None = None


class Store:
    """Database of one rig.

    Parameters
    ----------
    url : SQLAlchemy URL; SQLite runs in WAL mode with every commit forced to the disk
    disk : that holds a database which is a file

    Attributes
    ----------
    refusal : why the database takes nothing, or empty
    damaged : messages that could not be read

    Raises
    ------
    StoreError
        When the database cannot be opened, is no database, or belongs to another version.
    """

    def __init__(self, url: str, disk: Disk = MACHINE) -> None:
        self._disk = disk
        self._engine = _engine_of(url, disk)
        address = self._engine.url
        self._where = address.database or address.render_as_string(hide_password=True)
        self._file = Path(address.database) if self._engine.dialect.name == "sqlite" and address.database else None
        self.refusal = ""
        self.damaged = 0
        self.boots = 0
        try:
            with self._refusing("; choose a writable --folder or another database"):
                if self._file is not None:
                    disk.make_folder(self._file.parent)
                self._begin(self._check_schema())
        except StoreError:
            self.close()
            raise
        self._inode = self._found_inode()

    def add_message(self, message: Kept, md: float | None, below: float | None = None) -> bool:
        """Store one message, see ``add_messages``."""
        return self.add_messages([Stored(message, md, below)])[0]

    def add_messages(self, arrived: Sequence[Stored]) -> list[bool]:
        """Store messages, all or none; durable on return. False for each that was already there.

        Raises
        ------
        StoreError
            When the disk refuses; nothing may be acknowledged then.
        """
        with self._writing() as connection:
            return [self._add(connection, one) for one in arrived]

    @staticmethod
    def _add(connection: sa.Connection, one: Stored) -> bool:
        payload = encode(one.message)
        row = row_of(one.message, payload)
        same = {f"its_{name}": value for name, value in row.items()}
        there = connection.execute(FIND, same).first()
        if there is not None and there.payload == payload:
            return False
        connection.execute(DROP, same)  # of a row that is damaged
        kind = type(one.message).__name__
        connection.execute(ADD, {**row, "kind": kind, "md": one.md, "below": one.below, "payload": payload})
        return True

    def place_messages(self, placed: Iterable[tuple[Kept, float]]) -> None:
        """Store the depths (m) of messages that came before they were known: of all, or of none."""
        rows = []
        for message, md in placed:
            row = row_of(message, encode(message))
            rows.append({"depth": md, **{f"its_{name}": value for name, value in row.items()}})
        with self._writing() as connection:
            connection.execute(PLACE, rows)

    def keep_stand(self, stand: Stand) -> None:
        """Store that the bit stood, in the place of what it overlaps."""
        with self._writing() as connection:
            overlaps = sa.and_(
                STANDS.c.epoch == stand.epoch,
                STANDS.c.begun_at <= stand.ended_at,
                STANDS.c.ended_at >= stand.begun_at,
                STANDS.c.md == stand.md,
            )
            connection.execute(sa.delete(STANDS).where(overlaps))
            row = {"epoch": stand.epoch, "begun_at": stand.begun_at, "ended_at": stand.ended_at, "md": stand.md}
            connection.execute(sa.insert(STANDS).values(**row))

    def messages(self) -> Iterator[Stored]:
        """Everything stored, in the order of arrival; what is damaged is passed over and counted."""
        with self._refusing(), self._engine.connect() as connection:
            for row in connection.execute(sa.select(MESSAGES).order_by(MESSAGES.c.id)):
                try:
                    message = decode(row.payload)
                except DecodeError:
                    self.damaged += 1
                    continue
                if isinstance(message, SurveyMeasurement | Event | StaticRecord) and is_depth(row.md):
                    yield Stored(message, row.md, row.below)
                else:
                    self.damaged += 1

    def stands(self) -> list[Stand]:
        """Where the bit stood, in the order of time."""
        order = sa.select(STANDS).order_by(STANDS.c.epoch, STANDS.c.begun_at)
        with self._refusing(), self._engine.connect() as connection:
            return [Stand(row.epoch, row.begun_at, row.ended_at, row.md) for row in connection.execute(order)]

    def keep_epoch(self, epoch: int) -> None:
        """Store the epoch of rig time."""
        with self._writing() as connection:
            connection.execute(sa.delete(META).where(META.c.name == "epoch"))
            connection.execute(sa.insert(META).values(name="epoch", value=str(epoch)))

    def keep_depth_doubt(self, doubt: Doubt) -> None:
        """Store since when depths are refused, and when the crew accepted one."""
        rows = [{"name": "depth_accepted", "value": _numbers(*doubt.accepted)}]
        if doubt.trusted is not None:
            rows.append({"name": "depth_trusted", "value": _numbers(*doubt.trusted)})
        with self._writing() as connection:
            connection.execute(sa.delete(META).where(META.c.name.in_(["depth_accepted", "depth_trusted"])))
            connection.execute(sa.insert(META), rows)

    def depth_doubt(self) -> Doubt:
        """Since when depths have been refused, and when the crew accepted one."""
        with self._refusing():
            meta = self._meta()
        trusted, accepted = meta.get("depth_trusted"), meta.get("depth_accepted")
        try:
            return Doubt(
                None if trusted is None else _reading_of(trusted), NEVER if accepted is None else _instant_of(accepted)
            )
        except ValueError as error:
            raise StoreError(
                f"database {self._where}: expected numbers of the depth, got {trusted!r} and {accepted!r}"
            ) from error

    def keep_joints(self, joints: Mapping[Pair, Joint]) -> None:
        """Store the angles of the joints, in the place of those stored before."""
        rows = [
            {"upper": upper, "lower": lower, "angle": joint.angle, "var": joint.var}
            for (upper, lower), joint in joints.items()
        ]
        with self._writing() as connection:
            connection.execute(sa.delete(JOINTS))
            if rows:
                connection.execute(sa.insert(JOINTS), rows)

    def joints(self) -> dict[Pair, Joint]:
        """Angles of the joints."""
        if not self._has(JOINTS):
            return {}
        with self._refusing(), self._engine.connect() as connection:
            return {(row.upper, row.lower): Joint(row.angle, row.var) for row in connection.execute(sa.select(JOINTS))}

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
            return [row.tube for row in connection.execute(sa.select(STRING).order_by(STRING.c.place))]

    def keep_block(self, block: ParameterBlock) -> None:
        """Store a parameter block before it is sent, so that what a tube uses can be named later."""
        digest = block.sha256().hex()
        with self._writing() as connection:
            connection.execute(sa.delete(BLOCKS).where(BLOCKS.c.sha256 == digest))
            connection.execute(sa.insert(BLOCKS).values(sha256=digest, content=block.canonical()))

    def blocks(self) -> list[ParameterBlock]:
        """Every block that was sent."""
        with self._refusing(), self._engine.connect() as connection:
            rows = connection.execute(sa.select(BLOCKS).order_by(BLOCKS.c.sha256)).all()
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
            return connection.execute(sa.select(RECALIBRATION.c.progress)).scalar()

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
            rows = connection.execute(sa.select(ALARMS).order_by(ALARMS.c.number)).all()
        found = []
        for row in rows:
            try:
                found.append(alarm_of_text(row.content))
            except DamagedAlarmError:
                self.damaged += 1
        return found

    def _has(self, table: sa.Table) -> bool:
        """Whether there is a table; a database of before that cannot be written lacks the later ones."""
        with self._refusing():
            return sa.inspect(self._engine).has_table(table.name)

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

    @contextlib.contextmanager
    def _writing(self) -> Iterator[sa.Connection]:
        """A transaction, committed to a file that still has its name."""
        try:
            with self._refusing():
                if self._found_inode() != self._inode:
                    raise StoreError(f"database {self._where}: was removed or replaced while the ground station ran")
                with self._engine.begin() as connection:
                    yield connection
        except StoreError as error:
            self.refusal = str(error)
            self._engine.dispose()  # a file that was opened while it could not be written stays so
            raise
        self.refusal = ""

    def _found_inode(self) -> int:
        """Identity of the file that has the database's name; 0 where there is none, or no file."""
        return self._disk.identity(self._file) if self._file is not None else 0

    @contextlib.contextmanager
    def _refusing(self, remedy: str = "") -> Iterator[None]:
        """Name the database and the reason in whatever it refuses."""
        try:
            yield
        except StoreError:
            raise
        except (sa.exc.SQLAlchemyError, OSError) as error:
            reason = str(getattr(error, "orig", None) or getattr(error, "strerror", None) or error)
            raise StoreError(f"database {self._where}: {reason}{remedy}") from error

    def _check_schema(self) -> list[str]:
        """Look without a change whether the database is one of ours; its tables, none of a new one."""
        tables = sorted(sa.inspect(self._engine).get_table_names())
        if tables and META.name not in tables:
            raise StoreError(
                f"database {self._where}: expected an empty one or that of a ground station, "
                f"got tables {', '.join(tables[:SHOWN])}; choose another --folder or database"
            )
        found = self._meta() if tables else {}
        if found and found.get("schema") not in [str(schema) for schema in READABLE]:
            wanted = " or ".join(map(str, READABLE))
            raise StoreError(
                f"database {self._where}: expected schema {wanted}, got {found.get('schema')}; "
                "one of a later version is read by that version"
            )
        return tables if found else []

    def _meta(self) -> dict[str, str]:
        with self._engine.connect() as connection:
            return {row.name: row.value for row in connection.execute(sa.select(META))}

    def _begin(self, tables: list[str]) -> None:
        """Make ready for writing and count this start; a database of ours that refuses is read all the same."""
        if self._engine.dialect.name == "sqlite":
            self._engine.dispose()  # the connection that only looked is not durable
            sa.event.listen(self._engine, "connect", _durable)
        try:
            with self._refusing():
                if lacking := [table for table in METADATA.sorted_tables if table.name not in tables]:
                    METADATA.create_all(self._engine, lacking)
                self._count_start()
        except StoreError as error:
            if not tables:
                raise
            self.refusal = str(error)

    def _count_start(self) -> None:
        boots = int(self._meta().get("boots", "0")) + 1
        rows = [{"name": "schema", "value": str(SCHEMA)}, {"name": "boots", "value": str(boots)}]
        self.boots = boots
        with self._engine.begin() as connection:
            connection.execute(sa.delete(META).where(META.c.name.in_(["schema", "boots"])))
            connection.execute(sa.insert(META), rows)


def _numbers(*values: float) -> str:
    return " ".join(map(repr, values))


def _reading_of(text: str) -> tuple[int, float, float]:
    epoch, at, md = text.split()
    return int(epoch), float(at), float(md)


def _instant_of(text: str) -> Instant:
    epoch, at = text.split()
    return int(epoch), float(at)


def row_of(message: Kept, payload: bytes) -> dict[str, Any]:
    """Identity of a message."""
    return {"tube": message.tube, "sequence": message.sequence, "content": content_of(payload).hex()}


def is_depth(value: object) -> bool:
    """Whether a stored depth is one, or not known yet."""
    return value is None or (isinstance(value, float) and math.isfinite(value) and value >= 0.0)


def _engine_of(url: str, disk: Disk) -> sa.Engine:
    """Engine of a URL, a file by ``disk``; a refusal does not repeat the URL, which may hold a password."""
    try:
        address = sa.make_url(url)
        if address.get_backend_name() == "sqlite" and address.database and not address.query:
            file = Path(address.database)
            return sa.create_engine(address, creator=lambda _record=None: disk.connect(file))
        if address.drivername == "postgresql":
            address = address.set(drivername="postgresql+psycopg")
        return sa.create_engine(address)
    except (sa.exc.SQLAlchemyError, ImportError) as error:
        raise StoreError(
            f"database URL: expected one such as sqlite:///FILE whose driver is installed: {error}"
        ) from error


def _durable(connection: sa.engine.interfaces.DBAPIConnection, _record: object) -> None:
    cursor = connection.cursor()
    with contextlib.suppress(sqlite3.OperationalError):  # a file that cannot be written can be read
        cursor.execute("PRAGMA journal_mode=WAL")
    cursor.execute("PRAGMA synchronous=FULL")
    cursor.execute("PRAGMA busy_timeout=5000")
    cursor.close()
