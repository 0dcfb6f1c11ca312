"""Open an IFC file with ifcopenshell. Where its schema or its characters ask for it, a temporary copy is read.

T1  ifcopenshell knows one edition of each schema family by its exact name. Other editions of the same family (IFC2X,
    IFC2X2, addenda, candidates of IFC4X3) describe storeys, walls, doors, spaces and their bodies with the same
    attributes in the same order, so they are read as the edition that is known; entities that it does not have are
    passed over. Of several names, the first known one counts. Other families (IFC 1.5, 2.0, CIS/2, AP214) are refused
    as what they are.
T2  The format is ASCII and the parser drops other bytes, yet exporters write UTF-8 or Windows-1252: such characters
    are written as the escapes that the standard has for them.
T3  A file without the line that ends it was cut short: the parser would silently return what is there.
T4  A line break means nothing in the format. Exporters break lines within strings, some within an escape, which the
    parser refuses.
T5  A byte order mark, and a file in UTF-16, are read as text; the parser takes neither.
T6  The parser refuses a whole file for one token that it cannot read. Only such a file is mended: zero bytes, and bytes
    before the file's first line, are removed. An invalid number loses the dots at its end (``3000.0.``) or counts as
    not given (``1.#INF``), and so does a reference without a number. A backslash that begins no escape stands for
    itself (paths).
"""

from __future__ import annotations

import codecs
import re
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from houseexpo.errors import install_command
from houseexpo.file_kinds import HEAD_BYTES
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import check_file

TAIL_CHARACTERS = 4_096
SCHEMA = re.compile(r"FILE_SCHEMA\s*\(\s*\(\s*'([^()]*)'", re.IGNORECASE)
FAMILIES = (  # T1
    (re.compile(r"IFC4X3"), "IFC4X3_ADD2"),
    (re.compile(r"IFC4($|[^0-9])"), "IFC4"),  # addenda, IFC4X1, IFC4X2
    (re.compile(r"IFC2X($|_|[23]($|[^0-9]))"), "IFC2X3"),
)
_UTF16: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
BEYOND_ASCII = re.compile(r"[^\x00-\x7f]+")
COMMENT_OR_STRING = re.compile(r"/\*.*?\*/|'[^']*'", re.DOTALL)
COMMENT_STRING_OR_VALUE = re.compile(
    rf"{COMMENT_OR_STRING.pattern}|(?<=[(,])\s*(?:[+-]?\d[^,()'/]*|#\s*)(?=[,)])", re.DOTALL
)
FALSE_ESCAPE = re.compile(
    r"(\\(?:\\|S\\.|P[A-I]\\|X\\[0-9A-F]{2}|X2\\(?:[0-9A-F]{4})+\\X0\\|X4\\(?:[0-9A-F]{8})+\\X0\\))|\\"
)
NUMBER = re.compile(r"[+-]?\s*\d+(\.\d*)?([eE][+-]?\d+)?")


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
        raise Rejection("source", Reason.UNREADABLE, detail, install_command("ifc")) from error
    text = _text(path)
    found = _schema(text, path)
    edition = _edition(found.group(1), path)
    broken = any(line.count("'") % 2 for line in text.splitlines())  # T4
    if found.group(1).upper() == edition and text.isascii() and not broken and not _is_marked(path):
        with suppress(ifcopenshell.Error):  # T6
            return ifcopenshell.open(path), edition
    named = found.group(1).replace("'", "").upper()
    text = f"{text[: found.start(1)]}{edition}{text[found.end(1) :]}"
    if broken:
        text = COMMENT_OR_STRING.sub(_in_one_line, text)
    try:
        return _open_copy(text), named
    except ifcopenshell.Error:  # T6
        return _open_copy(_mend(text)), named


def _open_copy(text: str) -> Any:
    import ifcopenshell

    with TemporaryDirectory() as folder:  # the parser of strings spoils memory in ifcopenshell 0.9
        copy = Path(folder) / "copy.ifc"
        copy.write_text(BEYOND_ASCII.sub(_unescape, text), encoding="ascii")
        return ifcopenshell.open(copy)


def _is_marked(path: Path) -> bool:
    """T5."""
    with path.open("rb") as file:
        return file.read(3).startswith((codecs.BOM_UTF8, *_UTF16))


def _text(path: Path) -> str:
    """Read the whole file as text; T2, T3, T5."""
    content = path.read_bytes()
    if content.startswith(_UTF16):
        content = content.decode("utf-16", errors="replace").encode()
    content = content.removeprefix(codecs.BOM_UTF8)
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
    found = SCHEMA.search(text, 0, HEAD_BYTES)
    if not found:
        detail = f"{path.name} names no schema in its header (FILE_SCHEMA)"
        raise Rejection("source", Reason.UNREADABLE, detail, "export the file again")
    return found


def _edition(schema: str, path: Path) -> str:
    """Return the name of the edition that the first known of a header's schemas is read as; T1."""
    names = [name.strip(" \t\r\n'").upper() for name in schema.split(",")]
    edition = next((known for name in names for pattern, known in FAMILIES if pattern.match(name)), None)
    if edition is None:
        detail = f"{path.name} is of schema {schema[:40] or '(empty)'}; IFC2X, IFC2X2, IFC2X3, IFC4 and IFC4X3 are read"
        raise Rejection("source", Reason.UNREADABLE, detail, "export it as IFC4 or IFC2X3")
    return edition


def _in_one_line(found: re.Match[str]) -> str:
    """T4; a comment stays as it is."""
    return found.group().replace("\r", "").replace("\n", "") if found.group().startswith("'") else found.group()


def _mend(text: str) -> str:
    """T6."""
    bare = text[text.index("ISO-10303-21") :].replace("\0", "")
    return COMMENT_STRING_OR_VALUE.sub(_mend_token, bare)


def _mend_token(found: re.Match[str]) -> str:
    """T6: mend one token; a number, a comment or a string without a false escape stays as it is."""
    token = found.group()
    if token.startswith("'"):
        return FALSE_ESCAPE.sub(lambda each: each.group(1) or r"\\", token)
    if token.startswith("/") or NUMBER.fullmatch(token.strip()):
        return token
    number = token.strip().rstrip(".")
    return number if NUMBER.fullmatch(number) else "$"


def _unescape(found: re.Match[str]) -> str:
    r"""Characters as ISO 10303-21 writes them in ASCII: \X4\ and eight hex digits each, then \X0\."""
    return rf"\X4\{found.group().encode('utf-32-be').hex().upper()}\X0\\"[:-1]
