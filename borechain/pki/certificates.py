"""Certificates of a rig: an authority of its own, and one certificate for each process and role.

They name who connects, for the router's access control, and keep all others from reading. A person's ends after half a
year, that of a process at the surface after two; both are warned of a month before, and made anew while the rig drills.
A tube's ends after 30 years: none expires in the middle of a hole. Who is revoked gets no rights from the router
(``access``), however long its certificate is good.
"""

from __future__ import annotations

import datetime
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, EllipticCurvePrivateKey, generate_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from borechain.pki.access import ROUTER
from borechain.pki.private_files import read_private_key, write_file, write_private
from telemetry.errors import KeyFileError
from telemetry.media.credentials import CA_FILE

CA_KEY = "ca.key"
DAY = datetime.timedelta(days=1)
VALID = 30 * 365 * DAY  # of the authority, and of tubes, which no stick reaches in the hole
AT_THE_SURFACE = 2 * 365 * DAY  # of a process that can be reached
OF_A_PERSON = 183 * DAY
EARLIER = DAY  # for a board whose clock is late


def make_authority(folder: Path, rig: str, now: datetime.datetime) -> None:
    """Make the authority of a rig: its certificate, which everybody has, and its key, which stays.

    Raises
    ------
    KeyFileError
        When they cannot be written.
    """
    key = generate_private_key(SECP256R1())
    name = _name(f"borechain {rig}")
    usage = _usage(signs_certificates=True)
    certificate = (
        _builder(name, name, key, now, VALID)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, hashes.SHA256())
    )
    write_private(folder / CA_KEY, _pem_of(key))
    write_file(folder / CA_FILE, certificate.public_bytes(serialization.Encoding.PEM).decode())


def make_certificate(
    folder: Path,
    name: str,
    now: datetime.datetime,
    valid: datetime.timedelta = AT_THE_SURFACE,
    common_name: str | None = None,
) -> None:
    """Make key and certificate of a process or a person, ``name.key`` and ``name.pem``, good for ``valid``.

    ``common_name`` is what the router knows it by, the name itself where it is not given. Only the
    router's is good for listening: a stolen tube cannot pass for the router.

    Raises
    ------
    KeyFileError
        When the folder holds no authority, or they cannot be written.
    """
    authority_key = read_private_key(folder / CA_KEY)
    try:
        authority = x509.load_pem_x509_certificate((folder / CA_FILE).read_bytes())
    except (OSError, ValueError) as error:
        raise KeyFileError(f"certificate {folder / CA_FILE}: expected that of the rig's authority") from error
    key = generate_private_key(SECP256R1())
    purpose = ExtendedKeyUsageOID.SERVER_AUTH if name == ROUTER else ExtendedKeyUsageOID.CLIENT_AUTH
    certificate = (
        _builder(_name(common_name or name), authority.subject, key, now, valid)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
        .add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
        .add_extension(_usage(signs_reports=name != ROUTER), critical=True)
        .sign(authority_key, hashes.SHA256())
    )
    write_private(folder / f"{name}.key", _pem_of(key))
    write_file(folder / f"{name}.pem", certificate.public_bytes(serialization.Encoding.PEM).decode())


def _usage(*, signs_certificates: bool = False, signs_reports: bool = False) -> x509.KeyUsage:
    """What a key is good for; readers of PDF trust the signature of one that commits to contents alone."""
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=signs_reports,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: EllipticCurvePrivateKey,
    now: datetime.datetime,
    valid: datetime.timedelta,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLIER)
        .not_valid_after(now + valid)
    )


def _pem_of(key: EllipticCurvePrivateKey) -> str:
    return key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    ).decode()
