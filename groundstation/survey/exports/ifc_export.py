"""IFC4: every column as a pile, a disc swept along its axis as built. Source: ISO 16739-1, IFC 4.0.2.1."""

from __future__ import annotations

import uuid

from groundstation.survey.exports.export_hole import ExportHole, ExportSite

ALPHABET = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"
LABEL = 255  # letters, the longest name
THINNEST = 0.05  # m, radius of a hole that has none
OWN = uuid.UUID("1f2f6c4e-5c2b-5b54-8f6b-4b7c8b0d6f20")  # of names of ours


class _StepLines:
    """Lines of a STEP file, numbered, and identifiers within its project."""

    def __init__(self, project: str) -> None:
        self.lines: list[str] = []
        self._project = project

    def add(self, text: str) -> str:
        self.lines.append(f"#{len(self.lines) + 1}={text};")
        return f"#{len(self.lines)}"

    def guid(self, name: str) -> str:
        """Identifier of 22 letters, the same for the same thing of the same project."""
        number = uuid.uuid5(OWN, f"{self._project}/{name}").int
        letters = []
        for _ in range(22):
            number, digit = divmod(number, 64)
            letters.append(ALPHABET[digit])
        return "".join(reversed(letters))

    def point(self, values: list[float]) -> str:
        return self.add(f"IFCCARTESIANPOINT(({','.join(_real(v) for v in values)}))")


def ifc_bytes(site: ExportSite) -> bytes:
    """Model in m; the site stands at the first head, so that far coordinates keep their digits."""
    w = _StepLines(f"{site.project}/{site.name}")
    origin = site.holes[0].axis[0].tolist()
    context, placed, project = _frame(w, site, origin)
    piles = [_pile(w, hole, origin, context, placed) for hole in site.holes]
    inside = f"IFCRELCONTAINEDINSPATIALSTRUCTURE('{w.guid('inside')}',$,$,$,({','.join(piles)}),{project})"
    w.add(inside)
    head = (
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('ViewDefinition [ReferenceView_V1.2]'),'2;1');\n"
        f"FILE_NAME('{_text(site.name)}','{site.day}T00:00:00',(''),(''),'borechain','borechain','');\n"
        "FILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\n"
    )
    return (head + "\n".join(w.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n").encode("ascii")


def _frame(w: _StepLines, site: ExportSite, origin: list[float]) -> tuple[str, str, str]:
    """Context of the shapes, placement of the site, and the site."""
    zero = w.add(f"IFCAXIS2PLACEMENT3D({w.point([0.0, 0.0, 0.0])},$,$)")
    context = w.add(f"IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-06,{zero},$)")
    units = [
        w.add(f"IFCSIUNIT(*,.{kind}.,$,.{name}.)")
        for kind, name in (("LENGTHUNIT", "METRE"), ("PLANEANGLEUNIT", "RADIAN"))
    ]
    assigned = w.add(f"IFCUNITASSIGNMENT(({','.join(units)}))")
    named = _text((site.project or site.name)[:LABEL])
    project = w.add(f"IFCPROJECT('{w.guid('project')}',$,'{named}',$,$,$,$,({context}),{assigned})")
    at = w.add(f"IFCAXIS2PLACEMENT3D({w.point(origin)},$,$)")
    placed = w.add(f"IFCLOCALPLACEMENT($,{at})")
    words = _text("; ".join((site.crs or "local coordinates", *site.remarks)))
    found = w.add(
        f"IFCSITE('{w.guid('site')}',$,'{_text(site.name[:LABEL])}','{words}',$,{placed},$,$,.ELEMENT.,$,$,$,$,$)"
    )
    w.add(f"IFCRELAGGREGATES('{w.guid('aggregate')}',$,$,$,{project},({found}))")
    return context, placed, found


def _pile(w: _StepLines, hole: ExportHole, origin: list[float], context: str, placed: str) -> str:
    points = [w.point([a - b for a, b in zip(row, origin, strict=True)]) for row in hole.axis.tolist()]
    line = w.add(f"IFCPOLYLINE(({','.join(points)}))")
    solid = w.add(f"IFCSWEPTDISKSOLID({line},{_real(hole.radius or THINNEST)},$,$,$)")
    shape = w.add(f"IFCSHAPEREPRESENTATION({context},'Body','AdvancedSweptSolid',({solid}))")
    product = w.add(f"IFCPRODUCTDEFINITIONSHAPE($,$,({shape}))")
    at = w.add(f"IFCLOCALPLACEMENT({placed},{w.add(f'IFCAXIS2PLACEMENT3D({w.point([0.0, 0.0, 0.0])},$,$)')})")
    words = f"'{_text(hole.verdict)}'" if hole.verdict else "$"
    name = _text(hole.name[:LABEL])
    return w.add(
        f"IFCPILE('{w.guid('pile/' + hole.name)}',$,'{name}',{words},$,{at},{product},'{name}',.BORED.,.CAST_IN_PLACE.)"
    )


def _real(value: float) -> str:
    """A real of STEP, which has a point always."""
    text = repr(float(value)).upper()
    if "E" in text and "." not in text:
        return text.replace("E", ".E")
    return text


def _text(text: str) -> str:
    """A string of STEP: other letters as hexadecimal numbers."""
    plain = text.replace("\\", "\\\\").replace("'", "''")
    return "".join(c if " " <= c <= "~" else _other_letter(c) for c in plain)


def _other_letter(letter: str) -> str:
    """A letter beyond ASCII in four hexadecimal digits, or in eight where they do not hold it."""
    code = ord(letter)
    return f"\\X2\\{code:04X}\\X0\\" if code < 0x10000 else f"\\X4\\{code:08X}\\X0\\"
