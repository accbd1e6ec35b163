"""The tables of the ground station's database, and what is asked of them most often."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping

import sqlalchemy as sa
from sqlalchemy.dialects import sqlite

SCHEMA = 5
READABLE = (2, 3, 4, 5)  # schemas; what a later one has more is made when it is opened
METADATA = sa.MetaData()


def digest_column() -> sa.Column[str]:
    """Hash of the other columns of a row; none in a row that a version wrote which knows of no hashes."""
    return sa.Column("digest", sa.String(32))


META = sa.Table(
    "meta",
    METADATA,
    sa.Column("name", sa.String(32), primary_key=True),
    sa.Column("value", sa.String(64), nullable=False),
)
ALL_META, ADD_META = sa.select(META), sa.insert(META)
DROP_META = sa.delete(META).where(META.c.name == sa.bindparam("its_name"))
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
OF_A_MESSAGE = (MESSAGES.c.content, MESSAGES.c.payload, MESSAGES.c.md, MESSAGES.c.below)
ALL_MESSAGES = sa.select(*OF_A_MESSAGE).order_by(MESSAGES.c.id)
PLACE = sa.update(MESSAGES).where(SAME).values(md=sa.bindparam("depth"))
STANDS = sa.Table(
    "stands",
    METADATA,
    sa.Column("epoch", sa.BigInteger, primary_key=True, autoincrement=False),
    sa.Column("begun_at", sa.Float, primary_key=True),
    sa.Column("ended_at", sa.Float, nullable=False),
    sa.Column("md", sa.Float, nullable=False),
    digest_column(),
)
ALL_STANDS = sa.select(STANDS).order_by(STANDS.c.epoch, STANDS.c.begun_at)
ADD_STAND = sa.insert(STANDS)
OVERLAPS = sa.and_(
    STANDS.c.begun_at <= sa.bindparam("its_end"),
    STANDS.c.ended_at >= sa.bindparam("its_begin"),
    STANDS.c.md == sa.bindparam("its_md"),
)
DROP_OVERLAPS = sa.delete(STANDS).where(
    STANDS.c.epoch == sa.bindparam("its_epoch"),
    sa.or_(OVERLAPS, STANDS.c.begun_at == sa.bindparam("its_begin")),  # of another depth, it is damaged
)
STRING = sa.Table(
    "string",
    METADATA,
    sa.Column("place", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("tube", sa.Integer, nullable=False),
)
WHOLE_STRING = sa.select(STRING).order_by(STRING.c.place)
BLOCKS = sa.Table(
    "blocks",
    METADATA,
    sa.Column("sha256", sa.String(64), primary_key=True),
    sa.Column("content", sa.LargeBinary, nullable=False),
)
ALL_BLOCKS = sa.select(BLOCKS).order_by(BLOCKS.c.sha256)
RECALIBRATION = sa.Table(
    "recalibration",
    METADATA,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("progress", sa.Text, nullable=False),
)
PROGRESS = sa.select(RECALIBRATION.c.progress)
JOINTS = sa.Table(
    "joints",
    METADATA,
    sa.Column("upper", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("lower", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("angle", sa.Float, nullable=False),
    sa.Column("var", sa.Float, nullable=False),
    digest_column(),
)
ALL_JOINTS = sa.select(JOINTS)
ALARMS = sa.Table(
    "alarms",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("content", sa.Text, nullable=False),
)
ALL_ALARMS = sa.select(ALARMS).order_by(ALARMS.c.number)
SETUP = sa.Table(
    "setup",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("content", sa.Text, nullable=False),
    digest_column(),
)
ALL_SETUP, ADD_SETUP = sa.select(SETUP).order_by(SETUP.c.number), sa.insert(SETUP)
DROP_SETUP = sa.delete(SETUP).where(SETUP.c.number == sa.bindparam("its_number"))
DROP_ALARM, ADD_ALARM = sa.delete(ALARMS).where(ALARMS.c.number == sa.bindparam("its_number")), sa.insert(ALARMS)
DIGESTED = (STANDS, JOINTS, SETUP)
MOMENTS = sa.Table(
    "moments",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("basis", sa.String(64), nullable=False),
    sa.Column("content", sa.LargeBinary, nullable=False),
)
ALL_MOMENTS = sa.select(MOMENTS).where(MOMENTS.c.basis == sa.bindparam("its_basis")).order_by(MOMENTS.c.number)
MOMENT_NUMBERS = sa.select(MOMENTS.c.number)
DROP_MOMENT, ADD_MOMENT = sa.delete(MOMENTS).where(MOMENTS.c.number == sa.bindparam("its_number")), sa.insert(MOMENTS)


@functools.cache
def add_new(dialect: str) -> sa.Insert:
    """Insertion of a message that does nothing where it is there already."""
    if dialect == "postgresql":
        from sqlalchemy.dialects import postgresql  # 2 MB, not needed with a file

        return postgresql.insert(MESSAGES).on_conflict_do_nothing()
    return sqlite.insert(MESSAGES).on_conflict_do_nothing()


def replace_meta(connection: sa.Connection, values: Mapping[str, str], without: Iterable[str] = ()) -> None:
    """Store values by their names, in the place of those stored before, of which those ``without`` go."""
    connection.execute(DROP_META, [{"its_name": name} for name in (*values, *without)])
    connection.execute(ADD_META, [{"name": name, "value": value} for name, value in values.items()])
