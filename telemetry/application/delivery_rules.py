"""How each kind of message travels: one hop or the whole string, surely or as well as it goes, and how urgently."""

from __future__ import annotations

from telemetry.media.port import Priority
from telemetry.messages import Event, Kept, Severity
from telemetry.schema import MessageKind

ONE_HOP = (MessageKind.AIDING, MessageKind.HELLO, MessageKind.TIME_REQUEST, MessageKind.TIME_REPLY)
RELIABLE = (
    MessageKind.SURVEY_MEASUREMENT,
    MessageKind.EVENT,
    MessageKind.REPLY,
    MessageKind.RECEIPT,
    MessageKind.COMMAND,
    MessageKind.BLOCK_SEGMENT,
    MessageKind.BLOCK_STATUS,
    MessageKind.STATIC_RECORD,
)
PRIORITIES: dict[MessageKind, Priority] = {
    MessageKind.TIME_REQUEST: Priority.TIME,
    MessageKind.TIME_REPLY: Priority.TIME,
    MessageKind.AIDING: Priority.AIDING,
    MessageKind.HELLO: Priority.HELLO,
    MessageKind.COMMAND: Priority.COMMAND,
    MessageKind.RECEIPT: Priority.COMMAND,
    MessageKind.SURVEY_MEASUREMENT: Priority.SURVEY,
    MessageKind.EVENT: Priority.SURVEY,
    MessageKind.REPLY: Priority.SURVEY,
    MessageKind.NODE_STATE: Priority.STATE,
    MessageKind.STATIC_RECORD: Priority.SURVEY,
    MessageKind.BLOCK_STATUS: Priority.SURVEY,
    MessageKind.BLOCK_SEGMENT: Priority.BLOCK,
    MessageKind.DEPTH_READING: Priority.STATE,
    MessageKind.SESSION_OFFER: Priority.COMMAND,
}


def is_warning(message: Kept) -> bool:
    """Return whether the crew may have to act at once."""
    return isinstance(message, Event) and message.severity is not Severity.INFO
