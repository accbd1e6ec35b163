"""Reports signed by a person's certificate, and verified by the rig's authority.

The signature stands in the PDF itself, as other programs read it (detached CMS, ECDSA with SHA-256), so a signed report
is one file. Its time is that of the signer's clock; no authority of time is asked.
"""

from __future__ import annotations

import datetime
import hashlib
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, EllipticCurvePublicKey
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.hazmat.primitives.serialization.pkcs7 import PKCS7Options, PKCS7SignatureBuilder
from cryptography.utils import CryptographyDeprecationWarning
from cryptography.x509.oid import NameOID

from borechain.pki.pdf_revisions import (
    SignedFileError,
    SignedRevision,
    append_revision,
    signed_content,
    signed_revisions,
    with_signature,
)
from borechain.pki.private_files import read_private_key
from telemetry.bounded_bytes import bounded_bytes
from telemetry.errors import KeyFileError

SEQUENCE, SET, INTEGER, OCTETS, ATTRIBUTES = 0x30, 0x31, 0x02, 0x04, 0xA0  # tags of DER
SIGNED_DATA, DATA = bytes.fromhex("06092a864886f70d010702"), bytes.fromhex("06092a864886f70d010701")
MESSAGE_DIGEST = bytes.fromhex("06092a864886f70d010904")
SHA256, ECDSA_SHA256 = bytes.fromhex("0609608648016503040201"), bytes.fromhex("06082a8648ce3d040302")
NULL = b"\5\0"
OPTIONS = [PKCS7Options.DetachedSignature, PKCS7Options.Binary, PKCS7Options.NoCapabilities]


class Signer(NamedTuple):
    """Who signed a report, and when by the clock of its machine."""

    name: str
    at: datetime.datetime
    serial: int  # of the certificate
    ends: datetime.datetime


def sign_report(pdf: bytes, certificate: Path, now: datetime.datetime) -> bytes:
    """The report with one more signature, by a person's certificate whose ``.key`` lies beside it.

    Raises
    ------
    KeyFileError
        When certificate and key cannot be read, or do not belong together, or the certificate is not good now.
    SignedFileError
        When the file is no report of this program, or was changed since it was signed.
    """
    if b"/SubFilter/adbe.pkcs7.detached" in pdf:
        signed_revisions(pdf)
    holder, key = read_certificate(certificate), read_private_key(certificate.with_suffix(".key"))
    if holder.public_key() != key.public_key():
        raise KeyFileError(f"certificate {certificate}: expected that of {certificate.with_suffix('.key').name}")
    if not holder.not_valid_before_utc <= now <= holder.not_valid_after_utc:
        raise KeyFileError(f"certificate {certificate}: it is good from {_period(holder)}, not at {now:%Y-%m-%d %H:%M}")
    made, start = append_revision(pdf, _common_name(holder), now)
    content = signed_content(made, start)
    builder = PKCS7SignatureBuilder().set_data(content).add_signer(holder, key, hashes.SHA256())
    return with_signature(made, start, builder.sign(Encoding.DER, OPTIONS))


def verify_report(pdf: bytes, authority: Path) -> list[Signer]:
    """Who signed a report, the first one first.

    Raises
    ------
    KeyFileError
        When the authority's certificate cannot be read.
    SignedFileError
        When the report is not signed, was changed, or a signer has no certificate of this authority.
    """
    issuer = read_certificate(authority)
    return [_signer_of(number, one, issuer) for number, one in enumerate(signed_revisions(pdf), 1)]


def read_certificate(path: Path) -> x509.Certificate:
    """Certificate of a file; errors as ``verify_report``."""
    try:
        return x509.load_pem_x509_certificate(bounded_bytes(path))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a certificate"
        raise KeyFileError(f"certificate {path}: {reason}; expected a .pem file of borechain pki") from None


def _signer_of(number: int, revision: SignedRevision, issuer: x509.Certificate) -> Signer:
    who = f"signature {number}, {revision.name}"
    try:
        holder, attributes, signature = _parts_of(revision.signature)
    except (ValueError, IndexError, x509.InvalidVersion):
        raise SignedFileError(f"it was changed: {who}, is no signature") from None
    try:
        holder.verify_directly_issued_by(issuer)
    except (InvalidSignature, UnsupportedAlgorithm, ValueError, TypeError):
        raise SignedFileError(f"{who}: its certificate is not of this authority, {_common_name(issuer)}") from None
    public = holder.public_key()
    try:
        if not isinstance(public, EllipticCurvePublicKey):
            raise InvalidSignature
        public.verify(signature, bytes([SET]) + attributes[1:], ECDSA(hashes.SHA256()))
    except InvalidSignature:
        raise SignedFileError(f"it was changed: {who}, is not that of its certificate") from None
    if _digest_in(attributes) != hashlib.sha256(revision.content).digest():
        raise SignedFileError(f"it was changed after {who}, signed it")
    if _common_name(holder) != revision.name:
        raise SignedFileError(f"{who}: its certificate is that of {_common_name(holder)}")
    if not holder.not_valid_before_utc <= revision.at <= holder.not_valid_after_utc:
        raise SignedFileError(
            f"{who}: its certificate is good from {_period(holder)}, signed at {revision.at:%Y-%m-%d}"
        )
    return Signer(revision.name, revision.at, holder.serial_number, holder.not_valid_after_utc)


def _parts_of(signature: bytes) -> tuple[x509.Certificate, bytes, bytes]:
    """Certificate, signed attributes and signature of a detached CMS with one signer; what follows it is zeros.

    It is made again of these three and compared, so that no byte of it may be another. Source: RFC 5652, SignedData.
    """
    whole, end = _element(signature, 0)
    content = [*_elements(whole)][1]  # explicit SignedData
    *_, certificates, signers = _elements(_inside(content))
    (signer,) = _elements(signers)
    (der,) = _elements(certificates)
    *_, attributes, _, signed = _elements(signer)
    with warnings.catch_warnings():  # of a number that was changed to one below zero, whenever it is read
        warnings.simplefilter("ignore", CryptographyDeprecationWarning)
        holder = x509.load_der_x509_certificate(der)
        is_numbered = holder.serial_number > 0
    if not is_numbered or _packed(holder, der, attributes, signed) != whole or signature[end:].strip(b"\0"):
        raise ValueError("another form of signature")
    return holder, attributes, _inside(signed)


def _packed(holder: x509.Certificate, der: bytes, attributes: bytes, signed: bytes) -> bytes:
    """The CMS that ``sign_report`` makes of its parts."""
    digest = _encoded(SEQUENCE, SHA256, NULL)
    serial = holder.serial_number.to_bytes(holder.serial_number.bit_length() // 8 + 1, "big")
    issuer = _encoded(SEQUENCE, holder.issuer.public_bytes(), _encoded(INTEGER, serial))
    one = _encoded(INTEGER, b"\1")
    said, shut = _encoded(ATTRIBUTES, _inside(attributes)), _encoded(OCTETS, _inside(signed))
    signer = _encoded(SEQUENCE, one, issuer, digest, said, _encoded(SEQUENCE, ECDSA_SHA256), shut)
    data = _encoded(SEQUENCE, one, _encoded(SET, digest), _encoded(SEQUENCE, DATA), _encoded(ATTRIBUTES, der),
                    _encoded(SET, signer))  # fmt: skip
    return _encoded(SEQUENCE, SIGNED_DATA, _encoded(ATTRIBUTES, data))


def _encoded(tag: int, *parts: bytes) -> bytes:
    """An element of DER."""
    content = b"".join(parts)
    size = len(content)
    if size < 0x80:
        return bytes([tag, size]) + content
    length = size.to_bytes((size.bit_length() + 7) // 8, "big")
    return bytes([tag, 0x80 | len(length)]) + length + content


def _digest_in(attributes: bytes) -> bytes:
    """Digest of the content among the signed attributes."""
    for attribute in _elements(attributes):
        kind, values = _elements(attribute)
        if kind == MESSAGE_DIGEST:
            (digest,) = _elements(values)
            return _inside(digest)
    return b""


def _element(data: bytes, start: int) -> tuple[bytes, int]:
    """One element of DER from ``start`` on, and where it ends."""
    size, head = data[start + 1], 2
    if size & 0x80:
        count = size & 0x7F
        if not 1 <= count <= 4:
            raise ValueError("length of DER")
        head += count
        size = int.from_bytes(data[start + 2 : start + head], "big")
    end = start + head + size
    if end > len(data):
        raise ValueError("end of DER")
    return data[start:end], end


def _inside(element: bytes) -> bytes:
    """Content of an element."""
    return element[2 + (element[1] & 0x7F if element[1] & 0x80 else 0) :]


def _elements(element: bytes) -> Iterator[bytes]:
    """Elements inside one."""
    content, start = _inside(element), 0
    while start < len(content):
        part, start = _element(content, start)
        yield part


def _common_name(certificate: x509.Certificate) -> str:
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def _period(certificate: x509.Certificate) -> str:
    return f"{certificate.not_valid_before_utc:%Y-%m-%d} to {certificate.not_valid_after_utc:%Y-%m-%d}"
