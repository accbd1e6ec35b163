"""One well written by hand in every format of the field, for readers to agree on."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable

ROWS = ((0.0, 0.0, 0.0), (10.0, 1.0, 120.0), (20.0, 3.0, 125.0), (30.0, 5.0, 130.0))  # m, deg: AGS has whole degrees


def csv_text(separator: str = ",", decimal: str = ".", head: str = "") -> bytes:
    rows = [separator.join(f"{value:.3f}".replace(".", decimal) for value in row) for row in ROWS]
    return "\n".join([head + separator.join(("MD (m)", "Inc (deg)", "Azi (deg)")), *rows]).encode()


def usft() -> bytes:
    rows = "".join(f"{md * 3937.0 / 1200.0!r} {inc / 0.9!r} {azi / 0.9!r}\n" for md, inc, azi in ROWS)
    return f"Site 7\nsurvey of May\n\n# MD[usft] INCL[gon] AZIM[gon]\n{rows}".encode("utf-16")


def xlsx() -> bytes:
    from openpyxl import Workbook

    book = Workbook()
    book.active.append(["an empty first sheet"])
    sheet = book.create_sheet("Survey")
    sheet.append(["Well 7"])
    sheet.append([])
    sheet.append(["MD", "INCL", "AZIM"])
    sheet.append(["m", "deg", "deg"])
    for row in ROWS:
        sheet.append(list(row))
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


def las_2() -> bytes:
    rows = "".join(f"{md:10.3f} {inc:10.3f} {azi:10.3f} -999.25\n" for md, inc, azi in ROWS)
    return (
        "~Version\nVERS. 2.0 : CWLS\nWRAP. NO : one line\n~Well\nSTRT.M 0 : first\nSTOP.M 30 : last\nSTEP.M 10 : step\n"
        "NULL. -999.25 : none\nWELL. 7 : name\n~Curve\nDEPT.M : measured depth\nINCL.DEG : inclination\n"
        f"AZIM.DEG : azimuth\nGR.GAPI : gamma\n~A\n{rows}"
    ).encode()


def las_3() -> bytes:
    rows = "".join(f"{md},{inc},{azi}\n" for md, inc, azi in ROWS)
    return (
        "~Version\nVERS. 3.0 : CWLS\nWRAP. NO : one line\nDLM. COMMA : separator\n~Well\nNULL. -999.25 : none\n"
        "~Inclinometry_Definition\nMD.M : depth {F}\nDEVI.DEG : deviation {F}\nAZIM.DEG : azimuth {F}\n"
        f"~Inclinometry_Data | Inclinometry_Definition\n{rows}"
    ).encode()


def witsml_1() -> bytes:
    rows = "".join(
        f'<trajectoryStation uid="{k}"><typeTrajStation>magnetic MWD</typeTrajStation><md uom="m">{md}</md>'
        f'<incl uom="dega">{inc}</incl><azi uom="dega">{azi}</azi></trajectoryStation>'
        for k, (md, inc, azi) in enumerate(ROWS)
    )
    return (
        '<?xml version="1.0"?><trajectorys xmlns="http://www.witsml.org/schemas/1series" version="1.4.1.1">'
        '<trajectory uidWell="w" uidWellbore="b" uid="t"><nameWell>7</nameWell><nameWellbore>7</nameWellbore>'
        f"<name>t</name>{rows}</trajectory></trajectorys>"
    ).encode()


def witsml_2(version: str = "2.1", doctype: str = "", md: str = "") -> bytes:
    rows = "".join(
        f'<w:TrajectoryStation uid="{k}"><e:Md><e:MeasuredDepth uom="m">{md or row[0]}</e:MeasuredDepth></e:Md>'
        f'<w:Incl uom="dega">{row[1]}</w:Incl>'
        f'<w:Azi uom="dega">{row[2]}</w:Azi></w:TrajectoryStation>'
        for k, row in enumerate(ROWS)
    )
    return (
        f'<?xml version="1.0"?>{doctype}<w:Trajectory xmlns:w="http://www.energistics.org/energyml/data/witsmlv2" '
        f'xmlns:e="http://www.energistics.org/energyml/data/commonv2" schemaVersion="{version}" uuid="u">'
        f"<e:Citation><e:Title>7</e:Title></e:Citation>{rows}</w:Trajectory>"
    ).encode()


def ags() -> bytes:
    ends = [*[row[0] for row in ROWS[1:]], ROWS[-1][0]]
    rows = "".join(
        f'"DATA","BH7","{md:.2f}","{end:.2f}","{azi:.0f}","{90 - inc:.0f}"\r\n'
        for (md, inc, azi), end in zip(ROWS, ends, strict=True)
    )
    return (
        '"GROUP","TRAN"\r\n"HEADING","TRAN_ISNO","TRAN_AGS"\r\n"UNIT","",""\r\n"TYPE","X","X"\r\n'
        '"DATA","1","4.1.1"\r\n\r\n"GROUP","HORN"\r\n"HEADING","LOCA_ID","HORN_TOP","HORN_BASE","HORN_ORNT","HORN_INCL"'
        f'\r\n"UNIT","","m","m","deg","deg"\r\n"TYPE","ID","2DP","2DP","0DP","0DP"\r\n{rows}'
    ).encode()


def diggs() -> bytes:
    depths, values = " ".join(f"{row[0]}" for row in ROWS), " ".join(f"{inc},{azi}" for _, inc, azi in ROWS)
    return (
        '<Diggs xmlns="http://diggsml.org/schemas/3" xmlns:gml="http://www.opengis.net/gml/3.2"><measurement><Test>'
        "<outcome><TestResult><location><MultiPointLocation><gml:posList>"
        f"{depths}</gml:posList></MultiPointLocation></location><results><ResultSet><parameters><PropertyParameters>"
        "<properties><Property><propertyClass>inclination</propertyClass><uom>deg</uom></Property>"
        "<Property><propertyClass>azimuth</propertyClass><uom>deg</uom></Property></properties></PropertyParameters>"
        f'</parameters><dataValues cs="," ts=" ">{values}</dataValues></ResultSet></results></TestResult></outcome>'
        "</Test></measurement></Diggs>"
    ).encode()


def edm() -> bytes:
    rows = "".join(
        f'<CD_DEFINITIVE_SURVEY_STATION def_survey_header_id="h" md="{md / 0.3048!r}" inclination="{inc}" '
        f'azimuth="{azi}"/>'
        for md, inc, azi in ROWS
    )
    return f'<?xml version="1.0" standalone="no"?><export>{rows}</export>'.encode()


def dips() -> bytes:
    return ("md_m,dip_deg,azi_deg\n" + "".join(f"{md},{inc - 90},{azi}\n" for md, inc, azi in ROWS)).encode()


FORMATS: dict[str, Callable[[], bytes]] = {
    "own.csv": lambda: csv_text().replace(b"MD (m),Inc (deg),Azi (deg)", b"md_m,inclination_deg,azimuth_deg"),
    "comma.csv": csv_text,
    "semicolon.csv": lambda: csv_text(";", ",", "sep below\nWell 7\n").replace(b",000", b",00"),
    "usft.txt": usft,
    "old.csv": lambda: csv_text(";").decode().replace("(deg)", "[°]").encode("cp1252"),
    "dip.csv": dips,
    "book.xlsx": xlsx,
    "two.las": las_2,
    "three.las": las_3,
    "one.xml": witsml_1,
    "two.xml": witsml_2,
    "hole.ags": ags,
    "diggs.xml": diggs,
    "edm.xml": edm,
}


def bomb() -> bytes:
    """A workbook that unpacks to more than 256 MiB."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for k in range(3):
            archive.writestr(f"xl/worksheets/sheet{k}.xml", bytes(100 * 2**20))
    return content.getvalue()
