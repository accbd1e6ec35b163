"""The image of a node for a chip: what its first cycle would find, loaded by C, refused where it is another's."""

import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from chip_tools import compile_replay, layout_of_one, needs_gcc, run_program, said_numbers
from click.testing import CliRunner
from recorded_calls import NODE, PARAMETERS, SETTINGS, WHOLE, Layout, record_calls
from test_every_event import FAST, Bench

from borechain.cli.firmware.firmware import firmware
from node.errors import NodeConfigurationError
from node.firmware.imu_settings import ImuSettings
from node.firmware.node_image import HEAD, IMAGE, LOADER, provision_node
from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.kernels.record.integer_node import FIXED_PARAMETERS
from node.translation.firmware_build import FirmwareRequest, build_firmware
from telemetry.parameters import ParameterBlock, SensorParameters

ONE = TubeSettings(
    3, MakeUpAngle(0.2, 1e-3), MakeUpAngle(-1.1, 2e-3), 1e-3, stiffness=3e4, torsion="variance", joints="both"
)
TWO = TubeSettings(
    4,
    imus=(
        ImuSettings((0.01, -0.02), 1.5, SensorParameters(bias=(1e-3, 2e-3, -1e-3))),
        ImuSettings((-0.01, 0.02), 0.7),
    ),
)
MAIN = """\
#include <stdio.h>
#include <stdlib.h>
#include "borechain_image.h"
static struct borechain_settings settings;
static struct borechain_parameters parameters[1 + BORECHAIN_IMUS];
static struct borechain_node node;
int main(int count, char **names)
{
    static unsigned char page[1 << 17];
    FILE *file = fopen(names[count - 1], "rb");
    size_t size = fread(page, 1, sizeof page, file);
    int loaded = borechain_load(page, size, &settings, parameters, &node);
    printf("loaded %d imus %d\\n", loaded, (int)settings.imus);
    return 0;
}
"""


def drill(settings: TubeSettings) -> None:
    """A node from its first cycle on."""
    Bench(settings).cycles(60).cycles(30, FAST).cycles(60)


def records_in(path: Path) -> Iterator[tuple[int, int, bytes]]:
    """Kind, slot and bytes of every record of a file of calls."""
    with path.open("rb") as file:
        while head := file.read(12):
            kind, slot, size = struct.unpack("<iii", head)
            yield kind, slot, file.read(size)


def first_records(path: Path) -> dict[int, bytes]:
    """What was written of the node before its first call."""
    found: dict[int, bytes] = {}
    for kind, _, body in records_in(path):
        if kind not in (NODE, SETTINGS, PARAMETERS):
            return found
        found[kind] = body
    return found


def parts_of(image: bytes) -> dict[int, bytes]:
    """The three records of an image."""
    sizes = HEAD.unpack_from(image)[-3:]
    at, found = HEAD.size, {}
    for kind, size in zip((SETTINGS, PARAMETERS, NODE), sizes, strict=True):
        found[kind], at = image[at : at + size], at + size
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("settings", "room"), [(ONE, 1), (ONE, 8), (TWO, 8)])
def test_an_image_is_what_the_first_cycle_of_a_node_finds(settings: TubeSettings, room: int, tmp_path: Path) -> None:
    layout: Layout = layout_of_one() if room == 1 else WHOLE
    record_calls(tmp_path / "calls.bin", lambda: drill(settings), layout=layout)
    provision_node(settings, room, tmp_path)
    image = parts_of((tmp_path / IMAGE).read_bytes())
    recorded = first_records(tmp_path / "calls.bin")
    assert image.keys() == recorded.keys()
    for kind, body in recorded.items():
        assert image[kind][: len(body)] == body, kind
        assert not any(image[kind][len(body) :])


@pytest.mark.slow
def test_the_block_in_use_is_in_the_image(tmp_path: Path) -> None:
    """Its bias in rad/s counts 2^-46, in the first of the corrections."""
    block = ParameterBlock(3, 7, SensorParameters(bias=(1e-3, -2e-3, 3e-3)))
    provision_node(ONE, 8, tmp_path, block)
    image = parts_of((tmp_path / IMAGE).read_bytes())[PARAMETERS]
    used, own = np.frombuffer(image, FIXED_PARAMETERS)[:2]
    assert used["gyroscope"]["bias"][0].tolist() == [round(bias * 2.0**46) for bias in (1e-3, -2e-3, 3e-3)]
    assert not own["gyroscope"]["bias"].any()


@needs_gcc
@pytest.mark.slow
def test_a_chip_that_starts_from_an_image_goes_as_the_node_does(tmp_path: Path) -> None:
    """Its file of calls has no record to begin with: all that is there comes from the image."""
    record_calls(tmp_path / "all.bin", lambda: drill(TWO))
    build_firmware(FirmwareRequest("c", out=tmp_path))
    provision_node(TWO, 8, tmp_path)
    given: set[int] = set()
    with (tmp_path / "calls.bin").open("wb") as calls:
        for kind, slot, body in records_in(tmp_path / "all.bin"):
            if kind in (NODE, SETTINGS, PARAMETERS) and kind not in given:
                given.add(kind)
                continue
            calls.write(struct.pack("<iii", kind, slot, len(body)) + body)
    program = compile_replay(tmp_path, "-DFROM_IMAGE")
    done = run_program(program, "calls.bin", IMAGE, folder=tmp_path)
    assert (done.returncode, said_numbers(done.stdout)["wrong"]) == (0, 0), done.stdout
    (tmp_path / "other").mkdir()
    provision_node(ONE, 8, tmp_path / "other")
    other = run_program(program, "calls.bin", tmp_path / "other" / IMAGE, folder=tmp_path)
    assert other.returncode == 1, other.stdout


@pytest.fixture(scope="module")
def loader(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loader")
    build_firmware(FirmwareRequest("c", out=folder))
    provision_node(TWO, 8, folder)
    (folder / "main.c").write_text(MAIN)
    options = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Werror")
    done = run_program("gcc", *options, "main.c", "-o", "main", folder=folder)
    assert done.returncode == 0, done.stderr
    return folder


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "loaded"),
    [
        (lambda image: image, 0),
        (lambda image: image + b"\xff" * 300, 0),  # the rest of its page
        (lambda image: b"", 1),
        (lambda image: b"\xff" * len(image), 1),  # flash that was erased
        (lambda image: image[:4] + b"\x01" + image[5:], 2),
        (lambda image: image[:8] + b"0" * 16 + image[24:], 2),
        (lambda image: image[:24] + b"\x01" + image[25:], 2),
        (lambda image: image[:-1], 3),
        (lambda image: image[:9000] + bytes([image[9000] ^ 1]) + image[9001:], 3),
        (lambda image: image[:-1] + bytes([image[-1] ^ 0x80]), 3),
    ],
)
def test_a_chip_loads_its_own_image_and_no_other(loader: Path, spoil, loaded: int, tmp_path: Path) -> None:
    (tmp_path / "page").write_bytes(spoil((loader / IMAGE).read_bytes()))
    done = run_program(loader / "main", tmp_path / "page", folder=tmp_path)
    assert said_numbers(done.stdout) == {"loaded": loaded, "imus": 2 if loaded == 0 else 0}


@pytest.mark.slow
def test_the_command_writes_both_files_and_refuses_what_cannot_be(tmp_path: Path) -> None:
    def provision(*words: str | Path):
        return CliRunner().invoke(firmware, ["provision", *map(str, words), "--out", str(tmp_path / "made")])

    done = provision("--tube", "3", "--drive-joint-deg", "12.5", "--room", "1")
    assert done.exit_code == 0, done.output
    assert {path.name for path in (tmp_path / "made").iterdir()} == {IMAGE, LOADER}
    assert f", {(tmp_path / 'made' / IMAGE).stat().st_size} bytes" in done.output
    many = provision("--tube", "3", "--imu-noise", "1", "--imu-noise", "1", "--room", "1")
    assert (many.exit_code, many.output) == (
        2,
        "Error: imus: expected at most 1, as the chip has room for, got 2\n",
    )
    wrong = provision("--tube", "0")
    assert (wrong.exit_code, wrong.output) == (2, "Error: tube: expected 1..250, got 0\n")
    with pytest.raises(NodeConfigurationError):
        provision_node(TWO, 1, tmp_path)
