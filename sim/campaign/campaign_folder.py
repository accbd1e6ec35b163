"""A campaign's folder: what it is of, and its chunks as Parquet, each written beside its place and renamed when whole.

``surveys-FIRST-LAST.parquet`` and ``epochs-FIRST-LAST.parquet`` hold the runs FIRST..LAST; a chunk is there when its
epochs are, which are renamed last. So a campaign that was cut off goes on with the chunks that are not there, and no
run is in it twice.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from node.kernels.arithmetic.jit import source_digest
from node.process.drivers import frame_clock
from sim.campaign.chunk import EPOCH_COLUMNS, RUNS, SURVEY_COLUMNS, Chunk, Columns
from sim.errors import RigError
from sim.kernel import ROOMS

VERSION: Final = 1
MANIFEST: Final = "campaign.json"
NAME: Final = re.compile(r"epochs-(\d{8})-(\d{8})\.parquet")
TABLES: Final = {"surveys": SURVEY_COLUMNS, "epochs": EPOCH_COLUMNS}


class Folder:
    """Where the chunks of one campaign lie.

    Parameters
    ----------
    path : made if it is not there
    name, digest : of the scenario

    Raises
    ------
    RigError
        When the folder holds another campaign, or cannot be written.
    """

    def __init__(self, path: Path, name: str, digest: str) -> None:
        self.path = path
        self._manifest = {
            "version": VERSION,
            "scenario": name,
            "scenario_digest": digest,
            "code_digest": code_digest(),
        }
        try:
            path.mkdir(parents=True, exist_ok=True)
            self._check()
        except OSError as error:
            raise RigError(f"{path}: {error.strerror or error}; expected a folder that can be written to") from error

    def _check(self) -> None:
        file = self.path / MANIFEST
        if not file.exists():
            if any(self.path.glob("*.parquet")):
                raise RigError(f"{self.path}: holds tables but no {MANIFEST}; expected an empty folder or a campaign's")
            write_whole(file, json.dumps(self._manifest, indent=1).encode() + b"\n")
            return
        try:
            found = json.loads(file.read_text())
        except ValueError as error:
            raise RigError(f"{file}: expected what a campaign writes there, got something else: {error}") from error
        for key, wanted in self._manifest.items():
            got = found.get(key) if isinstance(found, dict) else None
            if got != wanted:
                raise RigError(f"{self.path}: holds a campaign of {key} {got!r}, not {wanted!r}; choose another folder")

    def missing(self, first: int, last: int) -> list[tuple[int, int]]:
        """Ranges of the runs ``first``..``last`` that are not there, in chunks that end at multiples of ``RUNS``."""
        there = np.zeros(last - first + 2, bool)
        for begin, end in self.chunks():
            there[max(begin - first, 0) : max(end - first + 1, 0)] = True
        ranges, at = [], first
        while at <= last:
            if there[at - first]:
                at += 1
                continue
            end = at
            while end < last and end % RUNS and not there[end + 1 - first]:
                end += 1
            ranges.append((at, end))
            at = end + 1
        return ranges

    def chunks(self) -> Iterator[tuple[int, int]]:
        """First and last run of every chunk that is there, in order."""
        for file in sorted(self.path.glob("epochs-*.parquet")):
            if found := NAME.fullmatch(file.name):
                yield int(found[1]), int(found[2])

    def keep(self, first: int, last: int, chunk: Chunk) -> None:
        """Write a chunk.

        Raises
        ------
        RigError
            When it cannot be written; chunks that are there stay.
        """
        for table, columns in (("surveys", chunk.surveys), ("epochs", chunk.epochs)):
            sink = pa.BufferOutputStream()
            pq.write_table(arrow_table(columns, TABLES[table]), sink, compression="zstd")
            write_whole(self._file(table, first, last), sink.getvalue().to_pybytes())

    def read(self, table: str, first: int, last: int) -> Iterator[Columns]:
        """Rows of ``surveys`` or ``epochs`` of the runs ``first``..``last``, chunk by chunk.

        Raises
        ------
        RigError
            Names a file that cannot be read.
        """
        for begin, end in self.chunks():
            if end < first or begin > last:
                continue
            file = self._file(table, begin, end)
            try:
                whole = pq.read_table(file)
            except (OSError, pa.ArrowException) as error:
                raise RigError(f"{file}: expected a table of this campaign: {error}; remove it and go on") from error
            chosen = (whole["run"].to_numpy() >= first) & (whole["run"].to_numpy() <= last)
            yield {name: whole[name].to_numpy()[chosen] for name in whole.column_names}

    def _file(self, table: str, first: int, last: int) -> Path:
        return self.path / f"{table}-{first:08d}-{last:08d}.parquet"


def arrow_table(columns: Columns, described: Mapping[str, str]) -> pa.Table:
    """Columns with what each of them is as its metadata."""
    fields = [
        pa.field(name, pa.from_numpy_dtype(columns[name].dtype), metadata={"description": text})
        for name, text in described.items()
    ]
    return pa.table({name: columns[name] for name in described}, schema=pa.schema(fields))


def write_whole(file: Path, content: bytes) -> None:
    """Write a file so that it is whole or not there.

    Raises
    ------
    RigError
        What kept it from being written.
    """
    part = file.with_name(f".{file.name}.{secrets.token_hex(4)}.tmp")
    try:
        with part.open("wb") as out:
            out.write(content)
            out.flush()
            os.fsync(out.fileno())
        part.replace(file)
    except OSError as error:
        raise RigError(f"{file}: {error.strerror or error}; the chunks before it are kept") from error
    finally:
        part.unlink(missing_ok=True)


def code_digest() -> str:
    """Digest of everything that decides what a run gives: kernels, the world and its string, and the driver."""
    digest = hashlib.sha256(source_digest().encode())
    sources = [source for room in (*ROOMS, Path(__file__).parent) for source in room.rglob("*.py")]
    for source in sorted([*sources, Path(frame_clock.__file__)]):
        digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]
