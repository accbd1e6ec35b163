"""What a chip begins with: settings, corrections and a new record of a node in integers, as one block of bytes.

The block is for a page of flash. It says of which source, which layout and how many IMUs its records are, and ends with
a checksum: a chip whose program was built of another source refuses it (``borechain_load`` of the header beside it).
"""

from __future__ import annotations

import itertools
import struct
import zlib
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from node.errors import NodeConfigurationError
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import Array
from node.kernels.record.filter_record import default_config
from node.kernels.record.integer_node import new_integers
from node.kernels.record.node_record import MOMENT, NODE_LAYOUT, READING, new_node
from node.kernels.record.sensor_record import MAX_IMUS, PARAMETERS
from node.kernels.step.shadow_words import learn_inputs, learn_node
from node.translation.imu_limit import record_kinds, write_for_imus
from telemetry.parameters import ParameterBlock

IMAGE, LOADER = "borechain_image.bin", "borechain_image.h"
MAGIC: Final = b"BCIM"
HEAD: Final = struct.Struct("<4sI16sIIII")  # magic, layout, digest of the source, IMUs, bytes of the three records
LOADER_TEXT: Final = """\
/* A node's settings, corrections and new record, from the image that `borechain firmware provision` writes.
 *
 * A chip keeps the image in a page of its flash and loads it where it has no saved record that is good. */
#ifndef BORECHAIN_IMAGE_H
#define BORECHAIN_IMAGE_H

#include <string.h>

#include "borechain_step.h"

enum borechain_loaded {
    BORECHAIN_LOADED = 0,
    BORECHAIN_NO_IMAGE = 1,     /* the page holds something else, or nothing */
    BORECHAIN_OTHER_SOURCE = 2, /* of another source, layout or number of IMUs: provision it anew */
    BORECHAIN_DAMAGED = 3       /* it is cut, or its checksum is another */
};

static inline uint32_t borechain_word(const unsigned char *at)
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

static inline uint32_t borechain_checksum(const unsigned char *at, size_t count)
{
    uint32_t sum = 0xFFFFFFFFu;
    for (size_t k = 0; k < count; k++) {
        sum ^= at[k];
        for (int bit = 0; bit < 8; bit++) {
            sum = (sum >> 1) ^ (0xEDB88320u & (0u - (sum & 1u)));
        }
    }
    return ~sum;
}

/* Where the corrections of a good image lie: the block's in use, then each IMU's own. */
static inline const unsigned char *borechain_image_corrections(const unsigned char *image)
{
    return image + 40 + sizeof(struct borechain_settings);
}

/* Records from an image of `size` bytes; those given are left alone where it is refused. */
static inline enum borechain_loaded borechain_load(const unsigned char *image, size_t size,
    struct borechain_settings *settings, struct borechain_parameters parameters[1 + BORECHAIN_IMUS],
    struct borechain_node *node)
{
    const size_t head = 40, all = (1 + BORECHAIN_IMUS) * sizeof *parameters;
    const size_t whole = head + sizeof *settings + all + sizeof *node;
    if (size < head || memcmp(image, "BCIM", 4) != 0) {
        return BORECHAIN_NO_IMAGE;
    }
    if (borechain_word(image + 4) != BORECHAIN_LAYOUT || memcmp(image + 8, BORECHAIN_DIGEST, 16) != 0
        || borechain_word(image + 24) != BORECHAIN_IMUS || borechain_word(image + 28) != sizeof *settings
        || borechain_word(image + 32) != all || borechain_word(image + 36) != sizeof *node) {
        return BORECHAIN_OTHER_SOURCE;
    }
    if (size < whole + 4 || borechain_word(image + whole) != borechain_checksum(image, whole)) {
        return BORECHAIN_DAMAGED;
    }
    memcpy(settings, image + head, sizeof *settings);
    memcpy(parameters, image + head + sizeof *settings, all);
    memcpy(node, image + head + sizeof *settings + all, sizeof *node);
    return BORECHAIN_LOADED;
}

#endif
"""


class ChipRecords(NamedTuple):
    """Records of a node in integers: settings and node of one element, parameters (1 + IMUs,)."""

    settings: Array
    parameters: Array
    node: Array


class Provisioned(NamedTuple):
    """What was written, and the digest of the source that it is for."""

    files: tuple[Path, ...]
    digest: str
    size: int


def provision_node(settings: TubeSettings, imus: int, out: Path, block: ParameterBlock | None = None) -> Provisioned:
    """Write the image of a node into ``out``, for a chip whose program has room for ``imus`` IMUs, and its loader.

    Raises
    ------
    NodeConfigurationError
        When the tube has more IMUs than that.
    UntranslatableKernelError
        When a kernel says what is not translated.
    """
    own = len(settings.imus)
    if own > imus:
        raise NodeConfigurationError(f"imus: expected at most {imus}, as the chip has room for, got {own}")
    digest = write_for_imus(imus).digest
    image = pack_image(records_for(records_of(settings, block), imus), digest, imus)
    files = out / IMAGE, out / LOADER
    files[0].write_bytes(image)
    files[1].write_text(LOADER_TEXT, encoding="utf-8")
    return Provisioned(files, digest, len(image))


def records_of(settings: TubeSettings, block: ParameterBlock | None = None) -> ChipRecords:
    """Records of a node that is new, as the step of its first cycle would make them, with ``block`` in use."""
    integers, configs = new_integers(), default_config()
    corrections = np.zeros(1 + len(settings.imus), PARAMETERS)
    tube = Tube(
        settings,
        configs,
        new_node(configs),
        itertools.count().__next__,
        restored=False,
        parameters=block,
        corrections=corrections,
    )
    learn_node(tube.nodes, tube.settings_record, integers)
    learn_inputs(corrections, np.zeros((len(settings.imus), READING)), np.zeros(MOMENT), integers)
    return ChipRecords(integers["settings"], integers[0]["parameters"], integers["node"])


def records_for(records: ChipRecords, imus: int) -> ChipRecords:
    """The same in records that have room for ``imus`` IMUs: what is of the last ones is left out."""
    if imus == MAX_IMUS:
        return records
    settings, parameters, node = record_kinds(imus)
    made = ChipRecords(np.zeros(1, settings), np.zeros(1 + imus, parameters), np.zeros(1, node))
    for own, wide in zip(made, records, strict=True):
        _copy_part(own, wide[: len(own)])
    return made


def _copy_part(own: Any, wide: Any) -> None:
    """Copy every field that ``own`` has, as far as its shape goes."""
    if own.dtype.names is None:
        own[...] = wide[tuple(slice(0, length) for length in own.shape)]
        return
    for name in own.dtype.names:
        cut = tuple(slice(0, length) for length in own[name].shape)
        _copy_part(own[name], wide[name][cut])


def pack_image(records: ChipRecords, digest: str, imus: int) -> bytes:
    """The image: head, records, checksum. Holes of the records are zero."""
    parts = [record.tobytes() for record in records]
    body = HEAD.pack(MAGIC, NODE_LAYOUT, digest.encode(), imus, *map(len, parts)) + b"".join(parts)
    return body + struct.pack("<I", zlib.crc32(body))
