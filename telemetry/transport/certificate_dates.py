"""Certificates that end soon, have ended, or begin later than the clock of this machine says."""

from __future__ import annotations

import datetime
from pathlib import Path

from cryptography import x509

from telemetry.bounded_bytes import bounded_bytes

WARNED = datetime.timedelta(days=30)  # before its end
SUFFIX = ".pem"


def certificate_trouble(path: Path, now: datetime.datetime) -> str:
    """What is wrong with the dates of a certificate at ``now`` (UTC), or with its file; empty if nothing is."""
    try:
        certificate = x509.load_pem_x509_certificate(bounded_bytes(path))
    except (OSError, ValueError):
        return f"{path}: expected a certificate in PEM, got something else"
    begin, end = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    if now < begin:
        return f"{path}: good from {begin:%Y-%m-%d %H:%M} UTC, which is in the future; expected a clock that is set"
    if now >= end:
        return f"{path}: has ended, on {end:%Y-%m-%d %H:%M} UTC; {renewal_advice(path)}"
    if now >= end - WARNED:
        return f"{path}: ends in {(end - now).days} days, on {end:%Y-%m-%d %H:%M} UTC; {renewal_advice(path)}"
    return ""


def renewal_advice(path: Path) -> str:
    """How a certificate is made anew."""
    return f"borechain pki renew {path.stem} makes it anew, and the rig drills on"


def certificate_troubles(place: Path | None, now: datetime.datetime) -> dict[str, str]:
    """What is wrong, by name, of every certificate of a folder of keys, or of the folder that a key file lies in."""
    if place is None:
        return {}
    folder = place if place.is_dir() else place.parent
    troubles = {path.stem: certificate_trouble(path, now) for path in sorted(folder.glob(f"*{SUFFIX}"))}
    return {name: trouble for name, trouble in troubles.items() if trouble}
