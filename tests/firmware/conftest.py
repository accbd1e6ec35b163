"""What tests of a chip's node share: its C as a library, and the image that it is provisioned with."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator

import pytest
from chip_in_process import build_node, image_of, load_node
from chip_rig import SETTINGS
from made_once import made_once


@pytest.fixture(scope="session")
def loaded_node(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return load_node(made_once(tmp_path_factory, "chip_node", build_node))


@pytest.fixture(scope="module")
def library(loaded_node: ctypes.CDLL) -> Iterator[ctypes.CDLL]:
    """The library, without a key once a module is through."""
    yield loaded_node
    loaded_node.shim_key(None)


@pytest.fixture(scope="session")
def image(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return image_of(SETTINGS, tmp_path_factory.mktemp("image"))
