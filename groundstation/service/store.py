"""What the ground station keeps: surveys, static records and events, on the disk before they are acknowledged.

A row is the message as it came (telemetry's payload) with the depth it was given. The same message twice is one row:
identity is tube, sequence and content, so a tube that lost its memory and counts anew still gets its surveys stored.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import sqlalchemy as sa

from groundstation.errors import StoreError
from telemetry.errors import DecodeError
from telemetry.messages import Event, Kept, StaticRecord, SurveyMeasurement
from telemetry.parameters import ParameterBlock, unpack_block
from telemetry.presentation.msgpack_codec import decode, encode

SCHEMA = 1
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
    sa.Column("payload", sa.LargeBinary, nullable=False),
    sa.UniqueConstraint("tube", "sequence", "content"),
)
DEPTHS = sa.Table(
    "depths", METADATA, sa.Column("at", sa.Float, primary_key=True), sa.Column("md", sa.Float, nullable=False)
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


@dataclass(frozen=True, slots=True)
class Stored:
    """A message from the store and the depth (m) it was measured at, if known."""

    message: Kept
    md: float | None


class Store:
    """Database of one rig.

    Parameters
    ----------
    url : SQLAlchemy URL; SQLite runs in WAL mode with every commit forced to the disk

    Raises
    ------
    StoreError
        When the database cannot be opened, is no database, or belongs to another version.
    """

    def __init__(self, url: str) -> None:
        self._engine = _engine_of(url)
        address = self._engine.url
        self._where = address.database or address.render_as_string(hide_password=True)
        try:
            with self._refusing("; choose a writable --folder or another database"):
                if self._engine.dialect.name == "sqlite":
                    Path(address.database or "").parent.mkdir(parents=True, exist_ok=True)
                self._check_schema()
                if self._engine.dialect.name == "sqlite":
                    self._engine.dispose()  # the connection that only looked is not durable
                    sa.event.listen(self._engine, "connect", _durable)
                METADATA.create_all(self._engine)
                self.boots = self._begin()
        except StoreError:
            self.close()
            raise

    def add_message(self, message: Kept, md: float | None) -> bool:
        """Store a message; durable on return. False when it was already there.

        Raises
        ------
        StoreError
            When the disk refuses; nothing may be acknowledged then.
        """
        payload = encode(message)
        content = hashlib.blake2b(payload, digest_size=16).hexdigest()
        row = {"tube": message.tube, "sequence": message.sequence, "content": content}
        with self._refusing(), self._engine.begin() as connection:
            same = sa.and_(*(MESSAGES.c[name] == value for name, value in row.items()))
            if connection.execute(sa.select(MESSAGES.c.id).where(same)).first() is not None:
                return False
            kind = type(message).__name__
            connection.execute(sa.insert(MESSAGES).values(**row, kind=kind, md=md, payload=payload))
        return True

    def add_depth(self, at: float, md: float) -> None:
        """Store that the bit stood at ``md`` (m) from rig time ``at`` (s) on."""
        with self._refusing(), self._engine.begin() as connection:
            connection.execute(sa.delete(DEPTHS).where(DEPTHS.c.at == at))
            connection.execute(sa.insert(DEPTHS).values(at=at, md=md))

    def messages(self) -> Iterator[Stored]:
        """Everything stored, in the order of arrival."""
        with self._refusing(), self._engine.connect() as connection:
            for row in connection.execute(sa.select(MESSAGES).order_by(MESSAGES.c.id)):
                try:
                    message = decode(row.payload)
                except DecodeError as error:
                    raise StoreError(f"database {self._where}: message {row.id}: {error}") from error
                if isinstance(message, SurveyMeasurement | Event | StaticRecord):
                    yield Stored(message, row.md)

    def depths(self) -> list[tuple[float, float]]:
        """Rig times (s) and depths (m) at which the bit came to stand."""
        with self._refusing(), self._engine.connect() as connection:
            return [(row.at, row.md) for row in connection.execute(sa.select(DEPTHS).order_by(DEPTHS.c.at))]

    def keep_tally(self, tubes: list[int]) -> None:
        """Store which tubes hang in the string, top first."""
        with self._refusing(), self._engine.begin() as connection:
            connection.execute(sa.delete(STRING))
            connection.execute(sa.insert(STRING), [{"place": n, "tube": tube} for n, tube in enumerate(tubes, 1)])

    def tally(self) -> list[int]:
        """Tubes of the string, top first."""
        with self._refusing(), self._engine.connect() as connection:
            return [row.tube for row in connection.execute(sa.select(STRING).order_by(STRING.c.place))]

    def keep_block(self, block: ParameterBlock) -> None:
        """Store a parameter block before it is sent, so that what a tube uses can be named later."""
        digest = block.sha256().hex()
        with self._refusing(), self._engine.begin() as connection:
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
        with self._refusing(), self._engine.begin() as connection:
            connection.execute(sa.delete(RECALIBRATION))
            connection.execute(sa.insert(RECALIBRATION).values(id=1, progress=text))

    def progress(self) -> str | None:
        """How far the calibration in the field had come."""
        with self._refusing(), self._engine.connect() as connection:
            return connection.execute(sa.select(RECALIBRATION.c.progress)).scalar()

    def close(self) -> None:
        """Close every connection."""
        self._engine.dispose()

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

    def _check_schema(self) -> None:
        """Look without a change whether the database is new or one of ours."""
        tables = sorted(sa.inspect(self._engine).get_table_names())
        if tables and META.name not in tables:
            raise StoreError(
                f"database {self._where}: expected an empty one or that of a ground station, "
                f"got tables {', '.join(tables[:SHOWN])}; choose another --folder or database"
            )
        found = self._meta() if tables else {}
        if found and found.get("schema") != str(SCHEMA):
            raise StoreError(f"database {self._where}: expected schema {SCHEMA}, got {found.get('schema')}")

    def _meta(self) -> dict[str, str]:
        with self._engine.connect() as connection:
            return {row.name: row.value for row in connection.execute(sa.select(META))}

    def _begin(self) -> int:
        """Count this start."""
        boots = int(self._meta().get("boots", "0")) + 1
        with self._engine.begin() as connection:
            connection.execute(sa.delete(META))
            connection.execute(
                sa.insert(META), [{"name": "schema", "value": str(SCHEMA)}, {"name": "boots", "value": str(boots)}]
            )
        return boots


def _engine_of(url: str) -> sa.Engine:
    """Engine of a URL; a refusal does not repeat the URL, which may hold a password."""
    try:
        return sa.create_engine(url)
    except (sa.exc.SQLAlchemyError, ImportError) as error:
        raise StoreError(
            f"database URL: expected one such as sqlite:///FILE whose driver is installed: {error}"
        ) from error


def _durable(connection: sa.engine.interfaces.DBAPIConnection, _record: object) -> None:
    cursor = connection.cursor()
    cursor.execute("PRAGMA journal_mode=WAL")
    cursor.execute("PRAGMA synchronous=FULL")
    cursor.execute("PRAGMA busy_timeout=5000")
    cursor.close()
