"""The table of media: to add one, write a module with ``open_medium`` and name it here."""

from __future__ import annotations

import importlib
from contextlib import AbstractContextManager
from types import ModuleType
from typing import cast

from telemetry.errors import UnknownMediumError
from telemetry.media.port import Medium

# name -> module with ``open_medium(where: str) -> AbstractContextManager[Medium]``; imported when it is asked for, so
# that a board needs the libraries of its own buses only
MEDIA: dict[str, str] = {
    "can": "telemetry.media.can_medium",  # where: channel and settings, such as can0,frames=classic
    "memory": "telemetry.media.memory",  # where: name of a net inside this process
    "zenoh": "telemetry.media.zenoh_port",  # where: endpoint of the router
}


def open_medium(text: str) -> AbstractContextManager[Medium]:
    """Medium named by ``NAME:WHERE``, such as ``zenoh:tcp/127.0.0.1:7447``, open inside the context.

    Raises
    ------
    UnknownMediumError
        When the table has no medium of that name.
    MediumError
        When the bus cannot be opened.
    """
    module, where = _module_of(text)
    return cast("AbstractContextManager[Medium]", module.open_medium(where))


def check_medium(text: str) -> None:
    """Check what ``open_medium`` would open, and open nothing; a module may have a function ``check_settings``.

    Raises
    ------
    MediumError
        When the table has no medium of that name, or its settings are wrong.
    """
    module, where = _module_of(text)
    if hasattr(module, "check_settings"):
        module.check_settings(where)


def _module_of(text: str) -> tuple[ModuleType, str]:
    name, _, where = text.partition(":")
    if name not in MEDIA:
        raise UnknownMediumError(f"medium: expected one of {', '.join(sorted(MEDIA))}, got {name or 'none'}")
    return importlib.import_module(MEDIA[name]), where
