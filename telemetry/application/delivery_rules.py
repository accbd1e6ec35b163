"""How each kind of message travels: one hop or the whole string, surely or as well as it goes, and how urgently."""

from __future__ import annotations

from telemetry.media.port import Priority
from telemetry.messages import Event, Kept, Severity
from telemetry.schema import Kind

ONE_HOP = (Kind.AIDING, Kind.HELLO, Kind.TIME_REQUEST, Kind.TIME_REPLY)
RELIABLE = (
    Kind.SURVEY_MEASUREMENT,
    Kind.EVENT,
    Kind.REPLY,
    Kind.RECEIPT,
    Kind.COMMAND,
    Kind.BLOCK_SEGMENT,
    Kind.BLOCK_STATUS,
    Kind.STATIC_RECORD,
)
PRIORITIES: dict[Kind, Priority] = {
    Kind.TIME_REQUEST: Priority.TIME,
    Kind.TIME_REPLY: Priority.TIME,
    Kind.AIDING: Priority.AIDING,
    Kind.HELLO: Priority.HELLO,
    Kind.COMMAND: Priority.COMMAND,
    Kind.RECEIPT: Priority.COMMAND,
    Kind.SURVEY_MEASUREMENT: Priority.SURVEY,
    Kind.EVENT: Priority.SURVEY,
    Kind.REPLY: Priority.SURVEY,
    Kind.NODE_STATE: Priority.STATE,
    Kind.STATIC_RECORD: Priority.SURVEY,
    Kind.BLOCK_STATUS: Priority.SURVEY,
    Kind.BLOCK_SEGMENT: Priority.BLOCK,
    Kind.DEPTH_READING: Priority.STATE,
    Kind.SESSION_OFFER: Priority.COMMAND,
}


def is_warning(message: Kept) -> bool:
    """Return whether the crew may have to act at once."""
    return isinstance(message, Event) and message.severity is not Severity.INFO
