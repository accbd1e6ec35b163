"""What a part of the firmware has to say; the node's reporter makes events of it."""

from __future__ import annotations

from telemetry.messages import Scalar, Severity

PendingEvent = tuple[str, Severity, dict[str, Scalar]]  # code, severity and arguments of an event
