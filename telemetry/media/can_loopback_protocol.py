"""What the loopback bus says beside frames: a few bytes between a controller and the hub of its segment."""

from __future__ import annotations

INTERFACE = "borechain_loopback"  # name for python-can
ATTACH = b"\xff\xff\xff\xffattach"  # no frame begins so; then a byte of flags and the name of the segment
DETACH, RESTART, ATTACHED, HERE = b"D", b"R", b"A", b"H"
FLAG_FD, FLAG_OWN = 0x01, 0x02  # of ATTACH
LARGEST_DATAGRAM = 512
RECEIVE_BUFFER = 1 << 20  # bytes, asked of the system; the usual default drops most of a flood of frames
