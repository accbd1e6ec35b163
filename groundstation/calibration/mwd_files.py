"""Reader of MWD records: voltages of both triads and the temperature at preset attitudes.

Columns: ``tilt_deg`` 0..180 and ``tool_face_deg`` of the jig, ``temperature_c``, the voltages of the accelerometers
``a_v b_v c_v``, and, where the record has them, those of the magnetometers ``x_v y_v z_v`` and the site's field at each
reading, ``field_ut`` and ``dip_deg`` (below the horizontal).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.calibration.calibration_records import ANGLE_RATIO
from groundstation.calibration.laboratory_tables import LARGEST, LaboratoryTable, check_range, line_error, read_table
from groundstation.calibration.mwd_model import gravity_inclination, nominal_triad, vectors_of_volts
from groundstation.calibration.mwd_record import ACCELEROMETER_VOLTS_PER_G
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
HEADER = "tilt_deg,tool_face_deg,temperature_c,a_v,b_v,c_v"
FULL_HEADER = f"{HEADER},x_v,y_v,z_v"
SITE_HEADER = f"{FULL_HEADER},field_ut,dip_deg"
HEADERS = (HEADER, FULL_HEADER, SITE_HEADER)
VOLTS = slice(3, 9)  # columns
COLDEST, HOTTEST = -60.0, 250.0  # C
READING = re.compile(r"(?:quality control: )?reading (\d+)\b")


@dataclass(frozen=True, slots=True)
class MwdRecord:
    """Readings (n,): ``tilt`` and ``tool_face`` rad of the jig, ``temperature`` C, volts (n, 3); ``lines`` of the file.

    ``field_volts``, ``field`` (microtesla) and ``dip`` (rad) are None where the file has no such columns.
    """

    name: str
    tilt: Array
    tool_face: Array
    temperature: Array
    gravity_volts: Array
    field_volts: Array | None
    field: Array | None
    dip: Array | None
    lines: tuple[int, ...]
    sha256: str

    def located(self, error: CalibrationError) -> CalibrationError:
        """The error of a solver with the file, and with the line where it names a reading."""
        text = str(error)
        found = READING.match(text)
        if found is None or not 1 <= int(found[1]) <= len(self.lines):
            return CalibrationError(f"{self.name}: {text}")
        return CalibrationError(f"{self.name}, line {self.lines[int(found[1]) - 1]}: {text}")

    def magnetic_volts(self) -> Array:
        """Voltages (n, 3) of the magnetometers.

        Raises
        ------
        CalibrationError
            When the record has none.
        """
        if self.field_volts is None:
            raise CalibrationError(f"{self.name}: expected the columns x_v, y_v, z_v of the magnetometers, got none")
        return self.field_volts


def read_mwd(path: Path, limit: float = LARGEST) -> MwdRecord:
    """MWD record of a file; ``limit`` (V) is the full scale of every sensor.

    Raises
    ------
    CalibrationError
        When the file is not a record, lacks an axis, holds a cell that is not a number, saturates, or has other units.
    """
    table = read_table(path, HEADERS)
    rows = np.array([table.numbers(k, 0) for k in range(len(table.lines))])
    for line, row in zip(table.lines, rows, strict=True):
        _check_row(table, line, row, limit)
    if not np.any(rows[:, VOLTS]):
        raise line_error(table.name, table.lines[0], "voltages", "nothing but 0")
    _check_tilts(table, rows)
    has_field, has_site = rows.shape[1] >= 9, rows.shape[1] == 11
    return MwdRecord(
        table.name,
        np.radians(rows[:, 0]),
        np.radians(rows[:, 1]),
        rows[:, 2],
        rows[:, 3:6],
        rows[:, 6:9] if has_field else None,
        rows[:, 9] if has_site else None,
        np.radians(rows[:, 10]) if has_site else None,
        tuple(table.lines),
        table.sha256,
    )


def _check_row(table: LaboratoryTable, line: int, row: Array, limit: float) -> None:
    if not 0.0 <= row[0] <= 180.0:
        raise line_error(table.name, line, "a tilt of 0..180 deg", f"{row[0]:.6g}")
    if abs(row[1]) > 360.0:
        raise line_error(table.name, line, "a tool face within +-360 deg", f"{row[1]:.6g}")
    if not COLDEST <= row[2] <= HOTTEST:
        raise line_error(table.name, line, f"a temperature of {COLDEST:.0f}..{HOTTEST:.0f} C", f"{row[2]:.6g}; kelvin?")
    check_range(table.name, line, table.header[VOLTS], row[VOLTS], limit)
    if len(row) == 11 and not (row[9] > 0.0 and abs(row[10]) <= 90.0):
        raise line_error(table.name, line, "field_ut > 0 and |dip_deg| <= 90", f"{row[9]:.6g} and {row[10]:.6g}")


def _check_tilts(table: LaboratoryTable, rows: Array) -> None:
    """Refuse tilts in rad: the readings then lean 57 times as far as the jig is said to."""
    seen = np.degrees(
        gravity_inclination(vectors_of_volts(nominal_triad("ABC", ACCELEROMETER_VOLTS_PER_G), rows[:, 3:6], rows[:, 2]))
    ).max()
    largest = float(rows[:, 0].max())
    if largest > 0.0 and seen > ANGLE_RATIO * largest:
        line = table.lines[int(rows[:, 0].argmax())]
        raise line_error(
            table.name,
            line,
            f"tilts that explain readings leaning {seen:.3g} deg",
            f"at most {largest:.4g} deg: the angles look in rad where deg belongs",
        )
