"""The block: what its hash covers, what it refuses, and that its file is whole or the old one."""

import copy
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.calibration import block
from groundstation.calibration.block import Calibration, Provenance, from_json, model_of, to_json
from telemetry.errors import CalibrationError

MATRIX = np.array([[1.01, 0.02, 0.0], [-0.01, 0.98, 0.03], [0.0, 0.01, 1.0]])
PROVENANCE = Provenance(
    input_sha256="0" * 64,
    day="2024-05-31",
    design="turn table, two rotations per axis",
    residual_rms=1e-3,
    matrix_std=np.full((3, 3), 1e-4),
    bias_std=np.full(3, 1e-3),
    matrix_slopes_std=np.zeros((1, 3, 3)),
    bias_slopes_std=np.full((2, 3), 1e-6),
)
BLOCK = Calibration(
    sensor="gyroscope",
    matrix=MATRIX,
    bias=np.array([0.1, -0.2, 0.3]),
    matrix_slopes=1e-4 * MATRIX[np.newaxis],
    bias_slopes=np.array([[1e-3, 2e-3, 3e-3], [1e-6, 2e-6, 3e-6]]),
    reference=25.0,
    provenance=PROVENANCE,
)
SHA256 = "5c452c28ccf9213aca3eb4bb4f31d9b3a6c319218d7903ad399173ceb034dfbf"
NUMBER = st.floats(allow_nan=False, allow_infinity=False, width=64).map(lambda x: x / 1e3)


def plain() -> dict[str, Any]:
    return copy.deepcopy(json.loads(to_json(BLOCK)))


def test_the_hash_is_the_same_on_every_machine() -> None:
    assert BLOCK.sha256() == SHA256


def test_the_canonical_bytes_are_sorted_and_without_spaces() -> None:
    text = BLOCK.canonical().decode()
    keys = list(json.loads(text))
    assert keys == sorted(keys)
    assert text.startswith('{"bias":[0.1,-0.2,0.3],"bias_slopes":[[0.001,')
    assert ", " not in text.replace(PROVENANCE.design, "")


def test_a_block_comes_back_from_its_text_to_the_last_bit() -> None:
    again = from_json(to_json(BLOCK))
    assert again.canonical() == BLOCK.canonical()
    np.testing.assert_array_equal(again.matrix, BLOCK.matrix)
    np.testing.assert_array_equal(again.bias_slopes, BLOCK.bias_slopes)
    np.testing.assert_array_equal(again.provenance.matrix_std, PROVENANCE.matrix_std)
    assert again.provenance.design == PROVENANCE.design


@given(
    bias=st.lists(NUMBER, min_size=3, max_size=3), reference=NUMBER, rms=st.floats(0.0, 1e9), design=st.text(min_size=1)
)
@pytest.mark.slow
def test_any_block_comes_back(bias: list[float], reference: float, rms: float, design: str) -> None:
    provenance = replace(PROVENANCE, residual_rms=rms, design=f"x{design}")
    made = replace(BLOCK, bias=np.array(bias), reference=reference, provenance=provenance)
    again = from_json(to_json(made))
    assert again.sha256() == made.sha256()
    np.testing.assert_array_equal(again.bias, bias)


def test_a_block_without_temperature_comes_back() -> None:
    provenance = replace(PROVENANCE, matrix_slopes_std=np.zeros((0, 3, 3)), bias_slopes_std=np.zeros((0, 3)))
    made = replace(BLOCK, matrix_slopes=np.zeros((0, 3, 3)), bias_slopes=np.zeros((0, 3)), provenance=provenance)
    again = from_json(to_json(made))
    assert again.sha256() == made.sha256()
    assert again.matrix_slopes.shape == (0, 3, 3)
    np.testing.assert_array_equal(model_of(again).matrix_at(np.array(90.0)), MATRIX)


@pytest.mark.parametrize("name", ["matrix", "bias", "matrix_slopes", "bias_slopes"])
def test_every_number_is_under_the_hash(name: str) -> None:
    for index in np.ndindex(getattr(BLOCK, name).shape):
        value = getattr(BLOCK, name).copy()
        value[index] = np.nextafter(value[index], 2.0)
        assert replace(BLOCK, **{name: value}).sha256() != SHA256
        std = getattr(PROVENANCE, f"{name}_std").copy()
        std[index] = np.nextafter(std[index], 2.0)
        changed = replace(PROVENANCE, **{f"{name}_std": std})
        assert replace(BLOCK, provenance=changed).sha256() != SHA256


@pytest.mark.parametrize(
    ("name", "value"), [("input_sha256", "1" * 64), ("day", "2024-06-01"), ("design", "other"), ("residual_rms", 2e-3)]
)
def test_the_provenance_is_under_the_hash(name: str, value: str | float) -> None:
    assert replace(BLOCK, provenance=replace(PROVENANCE, **{name: value})).sha256() != SHA256


def test_sensor_and_reference_are_under_the_hash() -> None:
    assert replace(BLOCK, sensor="accelerometer").sha256() != SHA256
    assert replace(BLOCK, reference=26.0).sha256() != SHA256


def test_the_two_zeros_are_one() -> None:
    negative = MATRIX.copy()
    negative[0, 2] = -0.0
    assert replace(BLOCK, matrix=negative).sha256() == SHA256


def test_a_block_does_not_change_with_the_arrays_it_was_made_of() -> None:
    matrix = MATRIX.copy()
    made = replace(BLOCK, matrix=matrix)
    matrix[0, 0] = 2.0
    assert made.sha256() == SHA256
    with pytest.raises(ValueError, match="read-only"):
        made.matrix[0, 0] = 2.0


def test_the_model_of_a_block() -> None:
    temperature = np.array([25.0, 35.0])
    np.testing.assert_allclose(model_of(BLOCK).matrix_at(temperature), [MATRIX, 1.001 * MATRIX])
    np.testing.assert_allclose(model_of(BLOCK).bias_at(temperature)[1], [0.1101, -0.1798, 0.3303])


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("sensor", "compass", "sensor: expected one of accelerometer, gyroscope, magnetometer, got compass"),
        ("sensor", 3, "sensor: expected text, got 3"),
        ("matrix", np.ones((3, 2)), r"matrix: expected the shape \(3, 3\), got \(3, 2\)"),
        ("matrix", np.ones((3, 3)), "expected three independent sensor axes"),
        ("matrix", np.full((3, 3), np.nan), "matrix: expected finite numbers"),
        ("bias", np.array([1.0, np.inf, 0.0]), "bias: expected finite numbers"),
        ("bias", [10**400, 0, 0], "bias: expected numbers, got"),
        ("bias", np.ones(2), r"bias: expected the shape \(3,\), got \(2,\)"),
        ("bias", ["a", "b", "c"], "bias: expected numbers, got"),
        ("bias", [True, False, True], "bias: expected finite numbers, got"),
        ("bias", [[1.0], [1.0, 2.0], 3.0], "bias: expected numbers, got"),
        ("bias_slopes", np.ones((1, 3)), r"bias_slopes_std: expected the shape \(1, 3\), got \(2, 3\)"),
        ("bias_slopes", np.ones(3), r"bias_slopes: expected the shape \(n, 3\), got \(3,\)"),
        ("matrix_slopes", np.ones((3, 3)), r"matrix_slopes: expected the shape \(n, 3, 3\), got \(3, 3\)"),
        ("reference", np.nan, "reference: expected finite numbers, got nan"),
        ("reference", None, "reference: expected"),
    ],
)
def test_parameters_that_are_none_are_refused(name: str, value: object, reason: str) -> None:
    with pytest.raises(CalibrationError, match=reason):
        replace(BLOCK, **{name: value})


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("input_sha256", "0" * 63, "input_sha256: expected 64 hex digits, got 0"),
        ("input_sha256", "G" * 64, "input_sha256: expected 64 hex digits, got G"),
        ("day", "31.5.2024", "day: expected a day as 2024-05-31, got 31.5.2024"),
        ("day", "2024-02-30", "day: expected a day as 2024-05-31, got 2024-02-30"),
        ("day", "20240531", "day: expected a day as 2024-05-31, got 20240531"),
        ("day", None, "day: expected text, got None"),
        ("design", "  ", "design: expected words"),
        ("residual_rms", -1.0, "residual_rms: expected 0 or more, got -1.0"),
        ("residual_rms", np.inf, "residual_rms: expected finite numbers, got inf"),
        ("matrix_std", np.full((3, 3), -1.0), "matrix_std: expected standard errors of 0 or more"),
        ("bias_std", np.full(3, np.inf), "bias_std: expected finite numbers"),
    ],
)
def test_a_provenance_that_is_none_is_refused(name: str, value: object, reason: str) -> None:
    with pytest.raises(CalibrationError, match=reason):
        replace(PROVENANCE, **{name: value})


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("calibration", "bias", 1), -0.2000001),
        (("calibration", "provenance", "design"), "another"),
        (("calibration", "provenance", "residual_rms"), 0.0),
        (("sha256",), "0" * 64),
    ],
)
def test_a_text_that_was_changed_is_refused(path: tuple[str | int, ...], value: object) -> None:
    whole = plain()
    place: Any = whole
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(CalibrationError, match=r"^sha256: expected [0-9a-f]{64}, got [0-9a-f]{64}$"):
        from_json(json.dumps(whole))


@pytest.mark.parametrize("path", [(), ("calibration",), ("calibration", "provenance")])
def test_a_key_too_few_or_too_many_is_refused(path: tuple[str, ...]) -> None:
    for name, change in (("missing", "pop"), ("unknown", "add")):
        whole = plain()
        place = whole
        for key in path:
            place = place[key]
        if change == "add":
            place["colour"] = 1
        else:
            place.popitem()
        with pytest.raises(CalibrationError, match=rf"expected the keys .* {name} \['"):
            from_json(json.dumps(whole))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "expected JSON"),
        ("{", "expected JSON"),
        ("[" * 100_000, "expected JSON"),
        ("1" * 5000, "expected JSON"),
        ("[]", r"calibration file: expected an object, got \[\]"),
        ("NaN", "expected JSON of finite numbers, got NaN"),
        ('{"format": 1, "sha256": "", "calibration": 3}', "calibration: expected an object, got 3"),
        ('{"format": 2, "sha256": "", "calibration": {}}', "format: expected 1, got 2"),
    ],
)
def test_a_text_that_is_no_block_is_refused(text: str, reason: str) -> None:
    with pytest.raises(CalibrationError, match=reason):
        from_json(text)


def test_a_provenance_that_is_no_object_is_refused() -> None:
    whole = plain()
    whole["calibration"]["provenance"] = []
    with pytest.raises(CalibrationError, match="provenance: expected an object"):
        from_json(json.dumps(whole))


def test_a_file_is_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    path = tmp_path / "a1.json"
    path.write_text("old")
    block.write_calibration(path, BLOCK)
    assert block.read_calibration(path).sha256() == SHA256
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_disk_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str) -> None:
    path = tmp_path / "a1.json"
    block.write_calibration(path, BLOCK)

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(*((os, "fsync") if step == "fsync" else (Path, "replace")), fail)
    with pytest.raises(CalibrationError, match="expected a place to write to, got No space left on device"):
        block.write_calibration(path, replace(BLOCK, reference=50.0))
    monkeypatch.undo()
    assert list(tmp_path.iterdir()) == [path]
    assert block.read_calibration(path).reference == 25.0


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match=r"a1\.json: expected a place to write to, got No such file"):
        block.write_calibration(tmp_path / "none" / "a1.json", BLOCK)
    with pytest.raises(CalibrationError, match=r"a1\.json: expected a calibration, got .*No such file"):
        block.read_calibration(tmp_path / "a1.json")
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(CalibrationError, match=r"a1\.json: expected a place to write to, got Not a directory"):
        block.write_calibration(tmp_path / "file" / "a1.json", BLOCK)


def test_a_file_that_was_cut_is_refused_with_its_name(tmp_path: Path) -> None:
    path = tmp_path / "a1.json"
    path.write_text(to_json(BLOCK)[:100])
    with pytest.raises(CalibrationError, match=r"a1\.json: calibration: expected JSON"):
        block.read_calibration(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(CalibrationError, match=r"a1\.json: expected a calibration, got"):
        block.read_calibration(path)
