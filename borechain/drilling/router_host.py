"""The router as a process of its own, which follows its files: who is let in, and its own certificate.

zenoh takes its access rules when a session opens. So a router whose files have changed closes its session and opens it
anew; the processes of the rig connect again by themselves, and what was under way is repeated by the links.
"""

from __future__ import annotations

import queue
import ssl
from pathlib import Path

from borechain.drilling.rig_host import guard_of, opened_router
from borechain.pki.access import ACCESS_FILE
from telemetry.errors import BorechainError, KeyFileError, MediumError
from telemetry.media.credentials import CA_FILE
from telemetry.runtime.hosting import begin_process, on_termination, write_warning

NAME = "router"
LOOK_EVERY = 1.0  # s
OPEN_TRIES = 10  # looks for which the address may still be held by the session before
Stamp = tuple[tuple[int, int], ...]


def run_router(endpoint: str, keys_place: Path | None = None) -> None:
    """Be the router that the processes of a rig meet at, until a signal comes.

    Raises
    ------
    MediumError, KeyFileError
        When the endpoint cannot be listened on, or there are no keys for it, at the start.
    """
    begin_process(NAME)
    stopped: queue.SimpleQueue[None] = queue.SimpleQueue()
    on_termination(lambda: stopped.put(None))
    files = RouterFiles(endpoint, keys_place)
    tries = 1
    while True:
        try:
            with opened_router(endpoint, keys_place):
                tries = OPEN_TRIES
                if wait_for_change(files, stopped):
                    return
        except MediumError:
            tries -= 1
            if tries <= 0 or is_stopped(stopped):
                raise


def wait_for_change(files: RouterFiles, stopped: queue.SimpleQueue[None]) -> bool:
    """Wait until the files have changed and can be used; True when the router is to end instead."""
    while not is_stopped(stopped):
        if files.have_changed():
            return False
    return True


def is_stopped(stopped: queue.SimpleQueue[None]) -> bool:
    """Return whether a signal came, after a while without one."""
    try:
        stopped.get(timeout=LOOK_EVERY)
    except queue.Empty:
        return False
    return True


class RouterFiles:
    """What a router is told by the files of its folder of keys; of one without TLS nothing.

    Files that cannot be used are told once and left: the router goes on with those it has.
    """

    def __init__(self, endpoint: str, place: Path | None) -> None:
        credentials, _ = guard_of(endpoint, place)
        self._endpoint, self._place = endpoint, place
        folder = None if credentials is None else credentials.authority.parent
        names = (ACCESS_FILE, CA_FILE, f"{NAME}.pem", f"{NAME}.key")
        self._paths = () if folder is None else tuple(folder / name for name in names)
        self._used = self._seen = self._stamp()

    def have_changed(self) -> bool:
        """Whether there are new files that can be used, which have not changed since the last look."""
        stamp = self._stamp()
        is_settled, self._seen = stamp == self._seen, stamp
        if stamp == self._used or not is_settled:
            return False
        self._used = stamp
        try:
            self._check()
        except (BorechainError, OSError) as error:
            write_warning(NAME, f"{error}; the files of before stay in use")
            return False
        return True

    def _check(self) -> None:
        credentials, _ = guard_of(self._endpoint, self._place)
        if credentials is None:
            return
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(credentials.certificate, credentials.key)
        except (OSError, ssl.SSLError) as error:
            raise KeyFileError(
                f"{credentials.certificate}: expected a certificate and its key {credentials.key.name}, got others"
            ) from error

    def _stamp(self) -> Stamp:
        return tuple(stamp_of(path) for path in self._paths)


def stamp_of(path: Path) -> tuple[int, int]:
    """When a file was written and how long it is; -1 where it is not there."""
    try:
        status = path.stat()
    except OSError:
        return -1, -1
    return status.st_mtime_ns, status.st_size
