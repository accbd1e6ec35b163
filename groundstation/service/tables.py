"""The tables of the ground station's database, and what is asked of them most often."""

from __future__ import annotations

import sqlalchemy as sa

SCHEMA = 3
READABLE = (2, 3)  # schemas; what a later one has more is made when it is opened
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
