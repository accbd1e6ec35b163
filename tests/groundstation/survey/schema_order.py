"""What generated bindings tell of a schema and their parser does not check: order of elements, lengths of texts."""

from __future__ import annotations

import dataclasses
import typing
from xml.etree.ElementTree import Element, fromstring


def order_faults(content: bytes) -> list[str]:
    """Elements of a WITSML trajectory out of the schema's order, and texts longer than it allows."""
    from energyml.witsml.v2_1.witsmlv2 import Trajectory

    return _faults(fromstring(content), Trajectory)


def _faults(element: Element, kind: type) -> list[str]:
    parts = [part for part in dataclasses.fields(kind) if part.metadata.get("type") == "Element"]
    names = [part.metadata["name"] for part in parts]
    places = [names.index(str(child.tag).rpartition("}")[2]) for child in element]
    found = [] if places == sorted(places) else [f"{kind.__name__}: {[names[place] for place in places][:8]}"]
    types = _types_of(kind)
    for child, place in zip(element, places, strict=True):
        longest = parts[place].metadata.get("max_length")
        if longest is not None and len(child.text or "") > longest:
            found.append(f"{names[place]}: {len(child.text or '')} letters, at most {longest}")
        inner = [one for one in typing.get_args(types[parts[place].name]) if dataclasses.is_dataclass(one)]
        found += _faults(child, typing.cast(type, inner[0])) if inner else []
    return found


def _types_of(kind: type) -> dict[str, object]:
    from energyml.eml.v2_3 import commonv2
    from energyml.witsml.v2_1 import witsmlv2

    return typing.get_type_hints(kind, None, {**vars(commonv2), **vars(witsmlv2)})
