"""Revisions of a PDF: each signature is appended to all that was there before and changes no byte of it.

Read are the documents that this program sets, with a plain table of objects. What a signature appends follows from the
document before it and from who signs when, so it can be made again: a verifier compares it byte by byte, and nothing
else passes for a signature. Source: ISO 32000-1, 7.5.6 (incremental updates) and 12.8 (digital signatures).
"""

from __future__ import annotations

import datetime
import re
from dataclasses import dataclass

from telemetry.errors import InputError

ROOM = 2048  # bytes of a signature with its certificates
STAMP = "D:%Y%m%d%H%M%SZ"
HEX = re.compile(rb"(?:[0-9a-f]{2})*0*")
NAME = re.compile(r"[A-Za-z0-9_. -]{1,80}")
FOUND = re.compile(
    rb"/Contents<(?P<hex>[0-9a-f]+)>/ByteRange\[0 (?P<first>\d{10}) (?P<second>\d{10}) (?P<length>\d{10})\]"
    rb"/M\((?P<stamp>D:\d{14}Z)\)/Name\((?P<name>[A-Za-z0-9_. -]+)\)"
)


class SignedFileError(InputError):
    """A file that cannot be signed or verified: it is no report of this program, or was changed."""


@dataclass(frozen=True, slots=True)
class SignedRevision:
    """One signature: who says to have signed when, the bytes that are signed, and where the revision ends."""

    name: str
    at: datetime.datetime
    content: bytes  # all before its end but the signature itself
    signature: bytes  # DER, and zeros up to its room
    end: int


def append_revision(pdf: bytes, name: str, at: datetime.datetime) -> tuple[bytes, int]:
    """The document with room for one more signature, and where that room begins.

    Raises
    ------
    SignedFileError
        When the document is none of this program, or the name is no name of a certificate.
    """
    if not NAME.fullmatch(name):
        raise SignedFileError(f"expected a name of letters, digits and _ . - to sign, got {name!r:.80}")
    trailer, table = _last_table(pdf)
    size, root = int(_word(trailer, rb"/Size (\d+)")), int(_word(trailer, rb"/Root (\d+) 0 R"))
    catalog = _catalog(pdf, root)
    fields = re.search(rb"/AcroForm<</SigFlags 3/Fields\[([0-9R ]+)\]>>", catalog)
    listed = b"" if fields is None else fields[1] + b" "
    bare = catalog if fields is None else catalog.replace(fields[0], b"")
    form = b"/AcroForm<</SigFlags 3/Fields[%b%d 0 R]>>" % (listed, size + 1)
    count = 1 + listed.count(b"R")
    before = pdf if pdf.endswith(b"\n") else pdf + b"\n"
    head = b"%d 0 obj\n<</Type/Sig/Filter/Adobe.PPKLite/SubFilter/adbe.pkcs7.detached/Contents<" % size
    start = len(before) + len(head)
    stamp = at.strftime(STAMP).encode()
    tail = b"/M(%b)/Name(%b)>>\nendobj\n" % (stamp, name.encode())
    ranged = b">/ByteRange[0 %010d %010d %010d]"
    field = b"%d 0 obj\n<</FT/Sig/T(Signature%d)/V %d 0 R/Type/Annot/Subtype/Widget/F 132/Rect[0 0 0 0]>>\nendobj\n"
    field = field % (size + 1, count, size)
    top = b"%d 0 obj\n%b%b>>\nendobj\n" % (root, bare.removesuffix(b">>"), form)
    places = {size: len(before)}
    places[size + 1] = start + 2 * ROOM + len(ranged % (0, 0, 0)) + len(tail)
    places[root] = places[size + 1] + len(field)
    at_table = places[root] + len(top)
    rows = b"".join(b"%d 1\n%010d 00000 n \n" % (number, places[number]) for number in sorted(places))
    kept = b"".join(re.findall(rb"/Info \d+ 0 R|/ID\[\([^\]]*\)\]", trailer))
    end = b"xref\n%btrailer\n<</Size %d/Root %d 0 R%b/Prev %d>>\nstartxref\n%d\n%%%%EOF\n"
    end = end % (rows, size + 2, root, kept, table, at_table)
    second = start + 2 * ROOM + 1
    after = tail + field + top + end
    length = len(ranged % (0, 0, 0)) - 1 + len(after)
    made = before + head + b"0" * (2 * ROOM) + ranged % (start - 1, second, length) + after
    return made, start


def signed_content(pdf: bytes, start: int) -> bytes:
    """What is signed of a document whose signature's room begins at ``start``: all but that room."""
    return pdf[: start - 1] + pdf[start + 2 * ROOM + 1 :]


def with_signature(pdf: bytes, start: int, signature: bytes) -> bytes:
    """The document with its signature in the room for it.

    Raises
    ------
    SignedFileError
        When it does not go in.
    """
    if len(signature) > ROOM:
        raise SignedFileError(f"expected a signature of at most {ROOM} bytes, got {len(signature)}")
    return pdf[:start] + signature.hex().encode().ljust(2 * ROOM, b"0") + pdf[start + 2 * ROOM :]


def signed_revisions(pdf: bytes) -> list[SignedRevision]:
    """All signatures of a document, the first one first; each is exactly what ``append_revision`` appends.

    Raises
    ------
    SignedFileError
        When there is none, or anything else was appended or changed about them.
    """
    found = list(FOUND.finditer(pdf))
    if not found:
        raise SignedFileError("expected a signed report, got one without a signature")
    revisions = []
    for number, match in enumerate(found, 1):
        name, at = match["name"].decode(), _moment(match["stamp"])
        before = pdf[: pdf.rfind(b"%%EOF", 0, match.start()) + 6]
        made, start = append_revision(before, name, at)
        theirs = pdf[: len(made)]
        if theirs[:start] != made[:start] or theirs[start + 2 * ROOM :] != made[start + 2 * ROOM :]:
            raise SignedFileError(f"it was changed: what signature {number}, {name}, appended is not there as it was")
        room = theirs[start : start + 2 * ROOM]
        if not HEX.fullmatch(room):
            raise SignedFileError(f"it was changed: signature {number}, {name}, is none")
        revisions.append(SignedRevision(name, at, signed_content(made, start), bytes.fromhex(room.decode()), len(made)))
    if revisions[-1].end != len(pdf):
        raise SignedFileError(
            f"it was changed: {len(pdf) - revisions[-1].end} bytes were appended after the signatures"
        )
    return revisions


def _moment(stamp: bytes) -> datetime.datetime:
    try:
        return datetime.datetime.strptime(stamp.decode(), STAMP).replace(tzinfo=datetime.UTC)
    except ValueError:
        raise SignedFileError(f"expected the time of a signature, got {stamp!r}") from None


def _last_table(pdf: bytes) -> tuple[bytes, int]:
    """Trailer and place of the newest table of objects."""
    found = re.search(rb"trailer\n<<(.*)>>\nstartxref\n(\d+)\n%%EOF\n?$", pdf[-4096:], re.DOTALL)
    if not pdf.startswith(b"%PDF-") or found is None or pdf[int(found[2]) : int(found[2]) + 4] != b"xref":
        raise SignedFileError("expected a report as this program sets it, a PDF with a table of its objects")
    return found[1].rpartition(b"trailer\n<<")[2], int(found[2])


def _catalog(pdf: bytes, root: int) -> bytes:
    """Newest catalog of a document, between its double angles."""
    head = b"\n%d 0 obj\n" % root
    _, found, rest = pdf.rpartition(head)
    body = rest[: rest.find(b"endobj")].strip() if found else b""
    if not body.startswith(b"<<") or b"/Type/Catalog" not in body:
        raise SignedFileError("expected a report as this program sets it, got a PDF without a plain catalog")
    return body


def _word(trailer: bytes, pattern: bytes) -> bytes:
    found = re.search(pattern, trailer)
    if found is None:
        raise SignedFileError("expected a report as this program sets it, its trailer names no catalog")
    return found[1]
