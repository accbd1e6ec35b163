"""What is said where nothing is: every field of every message with what it is when it is left out, limits of
signals, and which extra brings a module that is missing."""

from __future__ import annotations

import inspect
import math
import re
import tomllib
from pathlib import Path

import msgspec
import pytest

import telemetry.messages as messages
from telemetry.frozen import Frozen
from telemetry.presentation.can_signals import NARROWER
from telemetry.runtime.command_line import EXTRA_OF, missing_module_text

ALL_ZERO = bytes(8)
NEEDED = "needed"
FIELDS = {
    "Aiding": "yaw yaw_var systematic_var offset rate valid_at sequence hops torque=0.0 torsion_var=0.0 "
    "under_torque=False epoch=0 seal=b''",
    "BlockSegment": "tube sequence version digest count index data tag",
    "BlockStatus": "tube sequence digest phase received version in_use detail",
    "Command": "tube sequence name arguments={}",
    "DepthReading": "sequence at md stands epoch=0",
    "Event": "tube sequence at severity code arguments={} epoch=0",
    "Hello": "tube boot_count hops mode link_quality",
    "ImuMean": "force force_cov",
    "NodeState": "tube at hops mode yaw yaw_var systematic_var gyro_bias scale_factor innovation innovation_var "
    "aiding_age clock_var flags cycles overruns parameters_version=0 parameters_hash=b'\\x00\\x00\\x00\\x00\\x00\\x00"
    "\\x00\\x00' alignment=(0.0,0.0,0.0) epoch=0 numbered=0 upper_margin=inf lower_margin=inf",
    "Receipt": "tube sequence content=b''",
    "Reply": "tube sequence done detail values={}",
    "SessionOffer": "tube",
    "Stand": "epoch begun_at ended_at md",
    "StaticRecord": "tube sequence command begun_at ended_at samples rate rate_cov force force_cov temperature moved "
    "epoch=0",
    "SurveyMeasurement": "tube sequence station_at hops imus yaw yaw_var systematic_var samples settle_time flags "
    "epoch=0",
    "TimeReply": "asked_at received_at replied_at rig_at rig_rate clock_var epoch=0",
    "TimeRequest": "asked_at",
}


def classes() -> dict[str, type[msgspec.Struct]]:
    found = inspect.getmembers(messages, inspect.isclass)
    return {name: made for name, made in found if issubclass(made, Frozen) and made is not Frozen}


def left_out(field: msgspec.structs.FieldInfo) -> str:
    if field.default_factory is not msgspec.NODEFAULT:
        return f"={field.default_factory()!r}"
    return "" if field.default is msgspec.NODEFAULT else f"={field.default!r}".replace(" ", "")


@pytest.mark.parametrize("name", FIELDS)
def test_a_message_has_its_fields_in_their_order_and_is_made_without_those_of_later_versions(name: str) -> None:
    fields = msgspec.structs.fields(classes()[name])
    assert " ".join(field.name + left_out(field) for field in fields) == FIELDS[name]


def test_every_message_is_in_the_list() -> None:
    assert sorted(classes()) == sorted(FIELDS)


def test_numbers_that_stand_for_something_else_stay_apart() -> None:
    assert (messages.ENCODER, messages.MAX_TUBE, messages.BASE) == (0, 250, 251)
    assert (messages.HOPS_UNKNOWN, messages.EPOCH_UNKNOWN) == (-1, 0)
    assert pytest.approx((2.0 * math.pi) ** 2 / 12.0) == messages.UNKNOWN_YAW_STD**2  # a uniform angle's
    assert messages.CONTENT_SIZE == 16
    assert messages.SEGMENT_SIZE * messages.MAX_SEGMENTS == 6144


def test_limits_of_signals_name_fields_of_a_message_and_fill_their_bits() -> None:
    """A signal of n bits ends at 2^n - 1 whole numbers, or at a binary fraction either side of zero."""
    named = {field.name for made in classes().values() for field in msgspec.structs.fields(made)}
    assert set(NARROWER) <= named
    assert NARROWER == {
        "cycles": 4194303,
        "overruns": 255,
        "gyro_bias": 1 / 8,
        "innovation": 3 / 4,
        "parameters_version": 4095,
        "epoch": 65535,
        "numbered": 268435455,
    }


# what is imported, where it is not called as its distribution is
CALLED = {"psycopg": "psycopg[binary]"}


def test_the_extra_that_is_named_brings_the_module() -> None:
    extras = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    brings = {extra: {re.split(r"[>=<]", line)[0] for line in lines} for extra, lines in extras.items()}
    for module, extra in EXTRA_OF.items():
        assert CALLED.get(module, module) in brings[extra], module
        assert missing_module_text(f"{module}.part") == (
            f"needs the extra {extra}: pip install 'borechain[{extra}]' ({module} is not installed)"
        )
    offered = set().union(*(brings[extra] for extra in set(EXTRA_OF.values())))
    assert offered == {CALLED.get(module, module) for module in EXTRA_OF}  # and no module of an extra is unnamed


def test_a_module_of_no_extra_is_named_alone() -> None:
    assert missing_module_text("elsewhere.deep") == "needs elsewhere, which is not installed here"
    assert missing_module_text("sim.world") == (
        "needs the package sim of borechain, which is not on this machine: pip install borechain"
    )
