"""Tell of which format a file is by its first bytes, and by its name only where these do not say.

A format is named by its usual suffix (".glb"). Text formats without a mark of their own, such as YAML and CSV, are
known by name.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Final

HEAD_BYTES: Final = 1 << 16
"""How much of a file's start is read to tell what the file is, or what it holds."""

STATES_WAYS: Final = "states_ways"
"""Our drawings say by this word that they have each way between rooms: where they have none, nobody walks."""

PICTURES: Final = (".png", ".pgm", ".ppm", ".bmp", ".gif", ".jpg", ".jpeg", ".tif", ".tiff", ".webp")

_MARKS: Final[tuple[tuple[bytes, tuple[str, ...]], ...]] = (
    (b"glTF", (".glb",)),
    (b"ply\n", (".ply",)),
    (b"ply\r", (".ply",)),
    (b"ISO-10303-21", (".ifc",)),
    (b"LASF", (".las", ".laz")),
    (b"ASTM-E57", (".e57",)),
    (b"#usda", (".usda", ".usd")),
    (b"PXR-USDC", (".usdc", ".usd")),
    (b"AutoCAD Binary DXF", (".dxf",)),
    (b"#VRML_SIM", (".wbt",)),
    (b"\x93NUMPY", (".npy",)),
    (b"SQLite format 3\0", (".db3",)),
    (b"\x89MCAP0\r\n", (".mcap",)),
    (b"\x89PNG\r\n\x1a\n", PICTURES),
    *((b"P%d%c" % (kind, end), (".pgm", *PICTURES)) for kind in (2, 5) for end in b"\n\r"),
    (b"\xff\xd8\xff", (".jpg", *PICTURES)),
    (b"GIF8", (".gif", *PICTURES)),
    (b"II*\0", (".tif", *PICTURES)),
    (b"MM\0*", (".tif", *PICTURES)),
)
"""How formats begin, and their suffixes, the usual one first. The suffix of a picture does not matter."""

_ROOTS: Final[dict[bytes, tuple[str, ...]]] = {
    b"COLLADA": (".dae",),
    b"svg": (".svg",),
    b"mujoco": (".mjcf", ".xml"),
    b"sdf": (".sdf", ".world"),
}
"""The root elements of XML formats, without a prefix."""

_STARTS: Final = (
    (re.compile(rb"(?:\s*999\r?\n[^\n]*\n)*\s*0\r?\n\s*SECTION\s"), (".dxf",)),
    (re.compile(rb"\s*(?:ST)?C?N?OFF\s"), (".off",)),
    (re.compile(rb"\s*solid\b[^\n]*\n\s*facet\b"), (".stl",)),
)
"""How other text formats begin."""
_BLANK: Final = b"\xef\xbb\xbf \t\r\n"
_COMMENT_OR_ROOT: Final = re.compile(rb"<!--.*?(?:-->|\Z)|<([A-Za-z_][\w.-]*)(?::([\w.-]+))?", re.DOTALL)
_GLTF: Final = re.compile(rb'"asset"\s*:\s*\{[^{}]{0,400}"version"\s*:\s*"[12]\.')
_OBJ: Final = frozenset({b"mtllib", b"usemtl", b"o", b"g", b"s"})
_STL_HEAD, _STL_FACE = 84, 50


def format_suffix(path: Path, head: bytes | None = None) -> str:
    """Return the suffix of a file's format in lower case; it is that of its name unless its first bytes say another.

    ``head`` are its first ``HEAD_BYTES``, if they were read already. What cannot be read has the suffix of its name.
    """
    named = path.suffix.lower()
    try:
        if head is None:
            with path.open("rb") as stream:
                head = stream.read(HEAD_BYTES)
        known = _suffixes(head) or _binary_stl(head, path)
    except OSError:
        return named
    return named if not known or named in known else known[0]


def format_note(path: Path) -> str:
    """Return a sentence about a file whose name says another format than its first bytes, or ""."""
    found = format_suffix(path)
    return "" if found == path.suffix.lower() else f"{path.name} is read as {found}, by its content"


def xml_root(head: bytes) -> tuple[bytes, bytes]:
    """Return the prefix and the name of an XML document's root element; both are empty for what is no XML."""
    text = head.lstrip(_BLANK)
    found = next((each for each in _COMMENT_OR_ROOT.finditer(text) if each[1]), None) if text.startswith(b"<") else None
    if found is None:
        return b"", b""
    return (found[1], found[2]) if found[2] else (b"", found[1])


def _suffixes(head: bytes) -> tuple[str, ...]:
    for mark, suffixes in _MARKS:
        if head.startswith(mark):
            return suffixes
    text = head.lstrip(_BLANK)
    if text.startswith(b"<"):
        return _ROOTS.get(xml_root(head)[1], ())
    if text.startswith(b"{"):
        return (".gltf",) if _GLTF.search(text) else ()
    return next((suffixes for start, suffixes in _STARTS if start.match(text)), (".obj",) if _is_obj(text) else ())


def _is_obj(text: bytes) -> bool:
    """Whether the first line that says anything of a shape is a vertex of Wavefront's."""
    for line in text.splitlines():
        words = line.split()
        if words and not words[0].startswith(b"#") and words[0] not in _OBJ:
            return words[0] == b"v" and len(words) in {4, 5, 7, 8}
    return False


def _binary_stl(head: bytes, path: Path) -> tuple[str, ...]:
    """Return the suffix of binary STL, if a file has the size that the number of faces in it asks for."""
    if len(head) <= _STL_HEAD:
        return ()
    (count,) = struct.unpack_from("<I", head, _STL_HEAD - 4)
    return (".stl",) if path.stat().st_size == _STL_HEAD + _STL_FACE * count else ()
