"""DXF: the axis of every hole as a polyline, a circle of its column at every depth, layers by verdict."""

from __future__ import annotations

import io

from groundstation.survey.exports.export_hole import ExportSite

COLOURS = {"tight": 3, "not proven": 2, "not tight": 1, "": 7}  # of AutoCAD: green, yellow, red, white


def dxf_bytes(site: ExportSite) -> bytes:
    """Drawing in m, x east, y north, z up."""
    from ezdxf import units  # an extra
    from ezdxf.filemanagement import new

    drawing = new("R2010", units=units.M)
    space = drawing.modelspace()
    for verdict in sorted({hole.verdict for hole in site.holes}):
        drawing.layers.add(layer_of(verdict), color=COLOURS.get(verdict, 7))
    for hole in site.holes:
        layer = {"layer": layer_of(hole.verdict)}
        space.add_polyline3d([tuple(point) for point in hole.axis.tolist()], dxfattribs=layer)
        if hole.radius is not None:
            for point in hole.axis.tolist():
                space.add_circle(tuple(point), hole.radius, dxfattribs=layer)
        space.add_text(hole.name, height=0.2, dxfattribs=layer).set_placement(tuple(hole.axis[0].tolist()))
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue().encode("utf-8")


def layer_of(verdict: str) -> str:
    """Name of the layer of a verdict."""
    return f"HOLE-{verdict.upper().replace(' ', '-')}" if verdict else "HOLE"
