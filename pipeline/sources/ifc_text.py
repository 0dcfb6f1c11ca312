"""An IFC file opened by ifcopenshell; where its schema or its characters ask for it, by way of a temporary copy.

R1  ifcopenshell knows one edition of each schema family by its exact name. Other editions of the same family (IFC2X,
    IFC2X2, addenda, candidates of IFC4X3) describe storeys, walls, doors, spaces and their bodies with the same
    attributes in the same order, so they are read as the edition that is known; entities that it does not have are
    passed over. Other families (IFC 1.5, 2.0, CIS/2, AP214) are refused as what they are.
R2  The format is ASCII and the parser drops other bytes, yet exporters write UTF-8 or Windows-1252: such characters
    are written as the escapes that the standard has for them.
R3  A file without the line that ends it was cut short: the parser would silently return what is there.
"""

from __future__ import annotations

import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from houseexpo.errors import installing
from pipeline.rejection import Reason, Rejection
from pipeline.sources.naming import check_file

HEADER_CHARACTERS = 65_536
TAIL_CHARACTERS = 4_096
SCHEMA = re.compile(r"FILE_SCHEMA\s*\(\s*\(\s*'([^']*)'", re.IGNORECASE)
FAMILIES = (  # R1
    (re.compile(r"IFC4X3"), "IFC4X3_ADD2"),
    (re.compile(r"IFC4($|[^0-9])"), "IFC4"),  # addenda, IFC4X1, IFC4X2
    (re.compile(r"IFC2X($|_|[23]($|[^0-9]))"), "IFC2X3"),
)
BEYOND_ASCII = re.compile(r"[^\x00-\x7f]+")


def open_model(path: Path) -> tuple[Any, str]:
    """Return ifcopenshell's model of a file, and the schema that the file names.

    Raises
    ------
    Rejection
        MISSING_FILE, EMPTY or UNREADABLE (no IFC, cut short, an unknown schema, ifcopenshell not installed).
    """
    check_file(path)
    try:
        import ifcopenshell
    except ImportError as error:
        detail = f"{path.name} needs ifcopenshell, which is not installed"
        raise Rejection("source", Reason.UNREADABLE, detail, installing("ifc")) from error
    text = _text(path)
    found = _schema(text, path)
    edition = _edition(found.group(1), path)
    if found.group(1).upper() == edition and text.isascii():
        return ifcopenshell.open(path), edition
    text = f"{text[: found.start(1)]}{edition}{text[found.end(1) :]}"
    with TemporaryDirectory() as folder:  # the parser of strings spoils memory in ifcopenshell 0.9
        copy = Path(folder) / "copy.ifc"
        copy.write_text(BEYOND_ASCII.sub(_escaped, text), encoding="ascii")
        return ifcopenshell.open(copy), found.group(1).upper()


def _text(path: Path) -> str:
    """Read the whole file as text; R2, R3."""
    content = path.read_bytes()
    if b"ISO-10303-21" not in content[:TAIL_CHARACTERS]:
        raise Rejection("source", Reason.UNREADABLE, f"{path.name} is no IFC step file", "export it as .ifc")
    if b"END-ISO-10303-21" not in content[-TAIL_CHARACTERS:]:
        detail = f"{path.name} breaks off before END-ISO-10303-21"
        raise Rejection("source", Reason.UNREADABLE, detail, "the file is truncated: copy or export it again")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _schema(text: str, path: Path) -> re.Match[str]:
    found = SCHEMA.search(text, 0, HEADER_CHARACTERS)
    if not found:
        detail = f"{path.name} names no schema in its header (FILE_SCHEMA)"
        raise Rejection("source", Reason.UNREADABLE, detail, "export the file again")
    return found


def _edition(schema: str, path: Path) -> str:
    """Return the name of the edition that a schema is read as; R1."""
    name = schema.strip().upper()
    edition = next((known for pattern, known in FAMILIES if pattern.match(name)), None)
    if edition is None:
        detail = f"{path.name} is of schema {schema[:40] or '(empty)'}; IFC2X, IFC2X2, IFC2X3, IFC4 and IFC4X3 are read"
        raise Rejection("source", Reason.UNREADABLE, detail, "export it as IFC4 or IFC2X3")
    return edition


def _escaped(found: re.Match[str]) -> str:
    r"""Characters as ISO 10303-21 writes them in ASCII: \X4\ and eight hex digits each, then \X0\."""
    return rf"\X4\{found.group().encode('utf-32-be').hex().upper()}\X0\\"[:-1]
