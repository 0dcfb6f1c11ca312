"""XML without its dangers: no entity is expanded, no other file opened, no tree too deep for those who walk it."""

from __future__ import annotations

from xml.etree import ElementTree as ET
from xml.parsers import expat

from pipeline.rejection import Reason, Rejection

Element = ET.Element
DEEPEST = 100
LARGEST_BYTES = 1 << 28


def parse_xml(data: bytes, name: str) -> Element:
    """Return the root of a document.

    Raises
    ------
    Rejection
        EMPTY, TOO_LARGE, or UNREADABLE (no XML, an entity of its own, nested too deep).
    """
    if not data.strip():
        raise Rejection("source", Reason.EMPTY, f"{name} is empty", "copy it again")
    if len(data) > LARGEST_BYTES:
        raise Rejection("source", Reason.TOO_LARGE, f"{name} has {len(data) >> 20} MB of XML", "leave parts of it out")
    builder = ET.TreeBuilder()
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise _broken(name, f"is nested more than {DEEPEST} deep")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def entity(*_: object) -> None:
        raise _broken(name, "declares an entity")

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = entity
    parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
    try:
        parser.Parse(data, True)
        return builder.close()
    except (expat.ExpatError, UnicodeError, LookupError, ValueError) as error:
        raise _broken(name, f"is no XML: {error}") from None


def _broken(name: str, what: str) -> Rejection:
    return Rejection("source", Reason.UNREADABLE, f"{name} {what}", "copy it again, or write it without")
