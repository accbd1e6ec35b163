"""Certificates of a rig: an authority of its own, and one certificate for each process and role.

They name the process that connects, for the router's access control, and keep all others from reading. They end after
30 years: none expires in the middle of a hole. A revoked process gets no rights from the router (``access``).
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
VALID = datetime.timedelta(days=30 * 365)
EARLIER = datetime.timedelta(days=1)  # for a board whose clock is late


def make_authority(folder: Path, rig: str, now: datetime.datetime) -> None:
    """Make the authority of a rig: its certificate, which everybody has, and its key, which stays.

    Raises
    ------
    KeyFileError
        When they cannot be written.
    """
    key = generate_private_key(SECP256R1())
    name = _name(f"borechain {rig}")
    usage = x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=True,
        crl_sign=True,
        encipher_only=False,
        decipher_only=False,
    )
    certificate = (
        _builder(name, name, key, now)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, hashes.SHA256())
    )
    write_private(folder / CA_KEY, _pem_of(key))
    write_file(folder / CA_FILE, certificate.public_bytes(serialization.Encoding.PEM).decode())


def make_certificate(folder: Path, name: str, now: datetime.datetime) -> None:
    """Make key and certificate of a process or a role, ``name.key`` and ``name.pem``.

    Only the router's is good for listening: a stolen tube cannot pass for the router.

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
        _builder(_name(name), authority.subject, key, now)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.SubjectAlternativeName([x509.DNSName(name)]), critical=False)
        .add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
        .sign(authority_key, hashes.SHA256())
    )
    write_private(folder / f"{name}.key", _pem_of(key))
    write_file(folder / f"{name}.pem", certificate.public_bytes(serialization.Encoding.PEM).decode())


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _builder(
    subject: x509.Name, issuer: x509.Name, key: EllipticCurvePrivateKey, now: datetime.datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLIER)
        .not_valid_after(now + VALID)
    )


def _pem_of(key: EllipticCurvePrivateKey) -> str:
    return key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    ).decode()
