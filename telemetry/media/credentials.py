"""What a process shows to a router over TLS, and what endpoints may be used without it."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from pathlib import Path

from telemetry.errors import MediumError
from telemetry.messages import BASE, ENCODER, address_name

CA_FILE = "ca.pem"
DEPTH_SOURCE = 252  # in place of an address: what measures the depth of the bit
TLS = "tls/"
OVER_A_NETWORK = ("tcp", "udp", "quic", "ws")


@dataclass(frozen=True, slots=True)
class Credentials:
    """Certificate of the rig's authority, own certificate and own key."""

    authority: Path
    certificate: Path
    key: Path


def file_name(address: int) -> str:
    """Name of the files of a process without their suffix, and the common name of its certificate."""
    if address == DEPTH_SOURCE:
        return "depth"
    return address_name(address) if address in (BASE, ENCODER) else f"tube-{address}"


def credentials_for(endpoint: str, place: Path | None, name: str) -> Credentials | None:
    """Credentials that an endpoint asks for, from a folder of keys; None for one without TLS.

    Raises
    ------
    MediumError
        When there is no such folder, or a file is missing.
    """
    if not endpoint.startswith(TLS):
        return None
    if place is None:
        raise MediumError(f"endpoint {endpoint}: expected --keys with it, where the certificates lie")
    return credentials_of(place, name)


def credentials_of(place: Path, name: str) -> Credentials:
    """Credentials ``name.pem`` and ``name.key`` of a folder, or of the folder that a key file lies in.

    Raises
    ------
    MediumError
        When one of the files is missing; it is named.
    """
    folder = place if place.is_dir() else place.parent
    found = Credentials(folder / CA_FILE, folder / f"{name}.pem", folder / f"{name}.key")
    for path in (found.authority, found.certificate, found.key):
        if not path.is_file():
            raise MediumError(f"TLS: expected {path}, which borechain pki makes; it is not there")
    return found


def needs_tls(endpoint: str) -> bool:
    """Return whether an endpoint is on an open network: neither TLS nor this machine alone."""
    protocol, _, place = endpoint.partition("/")
    host = place.rpartition(":")[0].strip("[]")
    if protocol not in OVER_A_NETWORK:
        return False
    try:
        return not ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host != "localhost"
