"""The ``Home`` entry of Sweet Home 3D before 5.3, a Java serialisation, as the ``Home.xml`` that newer ones write.

The library only reads the values: no class is loaded and nothing is run. Fields have the names of the later attributes;
a wall's neighbours and an object's level are references, which get ids here.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from typing import Any, Final
from xml.etree import ElementTree as ET

from pipeline.rejection import Reason, Rejection
from pipeline.sources.xml_tree import Element

MODEL: Final = "com.eteks.sweethome3d.model."
_ADVICE: Final = "open it in Sweet Home 3D 5.3 or newer and save it"
_LISTS: Final = ("furnitureWithGroups", "furnitureWithDoorsAndWindows", "furniture")
"""Where the furniture stands, from 2.3 on, from 1.8 on, and before."""
_DEEPEST: Final = 50


def home_element(data: bytes, name: str) -> Element:
    """Return a home as the root of ``Home.xml``; raises Rejection (UNREADABLE) where it is damaged, or no home."""
    from javaobj.v2.main import load

    try:
        fields = _fields(load(io.BytesIO(data)))
        return _Writer().home(fields)
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001  # the library raises whatever broken bytes lead it to
        text = " ".join(str(error).split())[:120]
        detail = f"{name}: its Home, which Sweet Home 3D wrote before version 5.3, cannot be read: {text}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None


class _Writer:
    """Makes elements of objects, and gives ids to those that others refer to."""

    def __init__(self) -> None:
        self._ids: dict[int, str] = {}

    def home(self, fields: Mapping[str, Any]) -> Element:
        root = ET.Element("home", _plain(fields))
        for level in fields.get("levels") or ():
            ET.SubElement(root, "level", {"id": self._id(level), **_plain(_fields(level))})
        listed: Iterable[Any] = next((fields[key] for key in _LISTS if fields.get(key) is not None), ())
        for piece in listed:
            self._piece(root, piece, 0)
        for wall in fields.get("walls") or ():
            self._object(root, "wall", wall)
        for room in fields.get("rooms") or ():
            made = self._object(root, "room", room)
            for x, y in _fields(room).get("points") or ():
                ET.SubElement(made, "point", {"x": str(float(x)), "y": str(float(y))})
        return root

    def _piece(self, parent: Element, piece: Any, deep: int) -> None:
        kind = piece.classdesc.name.removeprefix(MODEL)
        if kind == "HomeFurnitureGroup" and deep < _DEEPEST:
            group = self._object(parent, "furnitureGroup", piece)
            for inner in _fields(piece).get("furniture") or ():
                self._piece(group, inner, deep + 1)
            return
        made = self._object(parent, "doorOrWindow" if kind == "HomeDoorOrWindow" else "pieceOfFurniture", piece)
        for _ in _fields(piece).get("sashes") or ():
            ET.SubElement(made, "sash")

    def _object(self, parent: Element, tag: str, found: Any) -> Element:
        fields = _fields(found)
        refers = {key: self._id(fields[key]) for key in ("level", "wallAtStart", "wallAtEnd") if fields.get(key)}
        return ET.SubElement(parent, tag, {"id": self._id(found), **_plain(fields), **refers})

    def _id(self, found: Any) -> str:
        return self._ids.setdefault(found.handle, f"{len(self._ids)}")


def _fields(found: Any) -> dict[str, Any]:
    """Return the fields of an object and of the classes above it, by name."""
    return {field.name: value for fields in found.field_data.values() for field, value in fields.items()}


def _plain(fields: Mapping[str, Any]) -> dict[str, str]:
    """Return the numbers, flags and texts among fields, as attributes; a number in an object counts too."""
    found = {}
    for key, value in fields.items():
        kind = getattr(getattr(value, "classdesc", None), "name", "")
        if kind in {"java.lang.Float", "java.lang.Double", "java.lang.Integer", "java.lang.Long"}:
            value = _fields(value)["value"]  # noqa: PLW2901
        if isinstance(value, bool):
            found[key] = str(value).lower()
        elif isinstance(value, int | float):
            found[key] = repr(float(value))
        elif type(value).__name__ == "JavaString":
            found[key] = str(value)
    return found
