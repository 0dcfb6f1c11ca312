"""The tiny home of ``sweethome`` as Sweet Home 3D wrote it before 5.3: a serialisation of Java objects."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.etree import ElementTree as ET

MODEL = "com.eteks.sweethome3d.model."


@dataclass(eq=False)
class Thing:
    """An object of a class: floats, flags, texts, lists, other objects, and rings of points, by field."""

    kind: str
    fields: Mapping[str, Any] = field(default_factory=dict)


class _Stream:
    """Writes what the grammar of Java's Object Serialization Stream Protocol asks for; each class in full."""

    def __init__(self) -> None:
        self.parts = [b"\xac\xed\x00\x05"]
        self._handles: dict[int, int] = {}
        self._count = 0

    def put(self, value: Any) -> None:
        if value is None:
            self.parts.append(b"\x70")
        elif isinstance(value, str):
            self._count += 1
            self.parts += [b"\x74", _utf(value)]
        elif isinstance(value, Thing):
            self._object(value)
        elif isinstance(value, tuple):
            self._ring(value)
        else:
            self._list(value)

    def _class(self, name: str, flags: int, fields: Sequence[tuple[bytes, str, str]]) -> None:
        self.parts += [b"\x72", _utf(name), struct.pack(">qBH", 1, flags, len(fields))]
        self._count += 1
        for code, key, kind in fields:
            self.parts += [code, _utf(key)]
            if kind:
                self.put(kind)
        self.parts.append(b"\x78\x70")

    def _object(self, value: Thing) -> None:
        if id(value) in self._handles:
            self.parts.append(b"\x71" + struct.pack(">I", 0x7E0000 + self._handles[id(value)]))
            return
        plain = {key: each for key, each in value.fields.items() if isinstance(each, bool | float)}
        others = {key: each for key, each in value.fields.items() if key not in plain}
        codes = [(b"Z" if isinstance(each, bool) else b"F", key, "") for key, each in plain.items()]
        codes += [(b"L", key, "Ljava/lang/Object;") for key in others]
        self.parts.append(b"\x73")
        self._class(MODEL + value.kind, 2, codes)
        self._handles[id(value)] = self._count
        self._count += 1
        for each in plain.values():
            self.parts.append(struct.pack(">?" if isinstance(each, bool) else ">f", each))
        for each in others.values():
            self.put(each)

    def _list(self, values: list[Any]) -> None:
        self.parts.append(b"\x73")
        self._class("java.util.ArrayList", 3, [(b"I", "size", "")])
        self._count += 1
        self.parts.append(struct.pack(">iBBi", len(values), 0x77, 4, len(values)))
        for each in values:
            self.put(each)
        self.parts.append(b"\x78")

    def _ring(self, points: tuple[tuple[float, float], ...]) -> None:
        self.parts.append(b"\x75")
        self._class("[[F", 2, [])
        self._count += 1
        self.parts.append(struct.pack(">i", len(points)))
        for point in points:
            self.parts.append(b"\x75")
            self._class("[F", 2, [])
            self._count += 1
            self.parts.append(struct.pack(">i2f", 2, *point))


def java_home(xml: str) -> bytes:
    """Return the home that ``Home.xml`` describes, as older versions wrote it."""
    root = ET.fromstring(xml)  # noqa: S314  # our own words
    walls = {each.get("id", ""): _thing(each, "Wall") for each in root.iter("wall")}
    for each in root.iter("wall"):
        for key in ("wallAtStart", "wallAtEnd"):
            walls[each.get("id", "")].fields[key] = walls.get(each.get(key, ""))  # type: ignore[index]
    pieces = [_thing(each, "HomePieceOfFurniture") for each in root.iter("pieceOfFurniture")]
    doors = [_thing(each, "HomeDoorOrWindow") for each in root.iter("doorOrWindow")]
    fields = {"wallHeight": float(root.get("wallHeight", "250")), "levels": [], "walls": list(walls.values())}
    rooms = [_thing(each, "Room") for each in root.iter("room")]
    found = {**fields, "furniture": pieces, "furnitureWithDoorsAndWindows": [*pieces, *doors], "rooms": rooms}
    stream = _Stream()
    stream.put(Thing("Home", found))
    return b"".join(stream.parts)


def _thing(element: ET.Element, kind: str) -> Thing:
    fields: dict[str, Any] = {}
    for key, text in element.items():
        if key in {"name", "catalogId"}:
            fields[key] = text
        elif key not in {"id", "wallAtStart", "wallAtEnd", "level"}:
            fields[key] = text == "true" if text in {"true", "false"} else float(text)
    if kind == "Room":
        fields["points"] = tuple((float(p.get("x", 0)), float(p.get("y", 0))) for p in element.iter("point"))
    if kind == "HomeDoorOrWindow":
        fields["sashes"] = [Thing("Sash", {"xAxis": 0.0}) for _ in element.iter("sash")]
    return Thing(kind, fields)


def _utf(text: str) -> bytes:
    data = text.encode()
    return struct.pack(">H", len(data)) + data
