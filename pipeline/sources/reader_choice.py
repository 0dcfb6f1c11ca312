"""Tell which reader opens a file, by its name, suffix or content, and list what readers find in a file or folder.

The name ``procedural:COUNT`` is parsed here, too.

R1  Every file of a folder is looked at; what a reader knows is its own.
R2  A picture or an array is a robot's map only where the build names the side of its cells, or the file itself. The
    picture of a ``map.yaml`` is a part of it.
R3  The meshes in a Gazebo model's folder are parts of that model, and its models are parts of a world beside them: they
    are no houses by themselves.
R4  Of an indoor map (IMDF) in a folder, the file of its units is the plan; the other files are parts of it.
"""

from __future__ import annotations

import gzip
import json
import re
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import msgspec

from houseexpo.file_kinds import HEAD_BYTES, format_suffix, xml_root
from houseexpo.files import without_mark
from houseexpo.grids.robot_map import BAGS, WORLD, YAMLS, drop_map_pictures, is_map_file, is_map_yaml
from houseexpo.grids.stage_world import is_stage_world
from pipeline.sources.files import walk_source_files
from pipeline.sources.tolerances import LARGEST_BYTES
from pipeline.sources.vector_plans import is_vector_plan
from pipeline.sources.vector_plans.imdf import is_part_of_archive
from pipeline.values import Input

_MESHES = frozenset({".dae", ".glb", ".gltf", ".obj", ".off", ".stl"})
"""Suffixes that no family of drawn plans claims, so that none of them is asked."""

_GZIP, _ZIP = b"\x1f\x8b", b"PK\x03\x04"
_BLANK = b"\xef\xbb\xbf \t\r\n"
_BETWEEN = re.compile(r"[\s,]*")
_JSON = json.JSONDecoder()
_SKIPPED = frozenset({".mtl", ".png", ".jpg", ".jpeg", ".pgm", ".yaml", ".txt", ".md", ".toml", ".bin", ".ifc"})
_PCD = re.compile(rb"^FIELDS .*^DATA ", re.MULTILINE | re.DOTALL)
_BY_SUFFIX = {
    ".sh3d": "sweethome",
    ".sh3x": "sweethome",
    ".usdz": "roomplan",
    ".world": "gazebo",
    ".sdf": "gazebo",
    ".pcd": "points",
    ".xyz": "points",
    ".las": "points",
    ".laz": "points",
    ".e57": "points",
}
_ANY = msgspec.Raw(b"null")


class _Part(msgspec.Struct):
    """One wall, or one room, of a JSON document: which keys it has."""

    polygon: msgspec.Raw = _ANY
    floorPolygon: msgspec.Raw = _ANY  # noqa: N815 - the file's own key
    transform: msgspec.Raw = _ANY
    walls: msgspec.Raw = _ANY


class _Document(msgspec.Struct):
    """The keys by which a JSON house is known."""

    walls: list[_Part] | None = None
    rooms: list[_Part] | None = None
    mesh: list[Any] | None = None
    scene: dict[str, Any] | None = None


_DOCUMENT = msgspec.json.Decoder(_Document)


def reader_for_file(path: Path) -> str | None:
    """Return the name of the reader that opens a file, or None if no reader knows its content.

    A damaged file is what its suffix says, where that leaves no doubt: its reader then says what is wrong.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except OSError:
        return None
    suffix = format_suffix(path, head)
    if has_house_lines(path):
        return (_in_zip(path) if head.startswith(_ZIP) else None) or "procthor"
    if suffix not in _MESHES and is_vector_plan(path, head):
        return "vector_plans"
    if suffix in BAGS or (suffix in YAMLS and is_map_yaml(head)) or (suffix == WORLD and is_stage_world(head)):
        return "occupancy_map"
    if suffix in _SKIPPED:
        return None
    found = _by_content(path, head) or _BY_SUFFIX.get(suffix)
    return "procthor" if found is None and suffix == ".json" and not _is_json(path) else found


def has_house_lines(path: Path) -> bool:
    """Whether a file's name says that each line is a house, whatever some of them hold: a bad one costs itself."""
    return path.name.lower().removesuffix(".gz").endswith(".jsonl")


def _by_content(path: Path, head: bytes) -> str | None:
    text = head.lstrip(_BLANK)
    if head.startswith(_ZIP):
        return _in_zip(path)
    if head.startswith(_GZIP) or text[:1] in {b"{", b"["}:
        return reader_for_json(read_first_document(path))
    if text[:1] == b"<":
        return {b"sdf": "gazebo", b"home": "sweethome"}.get(xml_root(head)[1])
    return _points(head)


def reader_for_json(data: bytes) -> str | None:
    """Tell ProcTHOR, 3D-FRONT and RoomPlan apart by the keys that only they have; a list holds ProcTHOR's houses."""
    if is_list(data):
        first = next(objects_in_list(data), None)
        found = None if first is None else reader_for_json(data[first[0] : sum(first)])
        return found if found == "procthor" else None
    try:
        document = _DOCUMENT.decode(without_mark(data))
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return _by_words(data[:HEAD_BYTES])
    if document.mesh is not None and document.scene is not None:
        return "front3d"
    walls, rooms = document.walls or [], document.rooms or []
    if any(room.floorPolygon != _ANY for room in rooms) or any(wall.polygon != _ANY for wall in walls):
        return "procthor"
    if any(wall.transform != _ANY for wall in walls) or any(room.walls != _ANY for room in rooms):
        return "roomplan"
    return None


def _is_json(path: Path) -> bool:
    """Return whether a file holds JSON. If not, it may be a damaged house, which a reader has to report."""
    try:
        msgspec.json.decode(without_mark(read_first_document(path)))
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return False
    return True


def read_first_document(path: Path) -> bytes:
    """Return the whole of a JSON file, or the first line of a file that has one house a line; gzip is unpacked."""
    try:
        with open_unpacked(path) as stream:
            line = bytes(stream.readline(LARGEST_BYTES))
            while line and not line.strip():
                line = bytes(stream.readline(LARGEST_BYTES))
            return line if _is_whole(line) else line + bytes(stream.read(LARGEST_BYTES - len(line)))
    except (OSError, EOFError, zlib.error):
        return b""


def begins_with_list(path: Path) -> bool:
    """Whether the JSON of a file, which may be packed by gzip, is a list."""
    with open_unpacked(path) as stream:
        return is_list(stream.read(HEAD_BYTES))


def is_list(data: bytes) -> bool:
    """Whether JSON, of which this is the beginning, is a list."""
    return data.lstrip(_BLANK)[:1] == b"["


def objects_in_list(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield start and length of each object of a JSON list, up to the first other value; the last may break off."""
    text = data.decode("latin-1")  # a character a byte
    end = text.index("[") + 1
    while True:
        between = _BETWEEN.match(text, end)
        start = between.end() if between else end
        if not text.startswith("{", start):
            return
        try:
            end = _JSON.raw_decode(text, start)[1]
        except (ValueError, RecursionError):
            yield start, len(text) - start
            return
        yield start, end - start


def open_unpacked(path: Path) -> Any:
    """Open a file that may be packed by gzip; the caller closes it."""
    with path.open("rb") as stream:
        packed = stream.read(2) == _GZIP
    return gzip.open(path) if packed else path.open("rb")


def _is_whole(line: bytes) -> bool:
    return line.rstrip().endswith(b"}") and line.lstrip().startswith(b"{") and line.count(b"{") == line.count(b"}")


def _by_words(head: bytes) -> str | None:
    """A document that breaks off is still what its first keys say, so that its own reader says what is wrong."""
    if b'"floorPolygon"' in head or b'"holePolygon"' in head or b'"proceduralParameters"' in head:
        return "procthor"
    if b'"design_version"' in head or b'"WallInner"' in head:
        return "front3d"
    if b'"dimensions"' in head and b'"transform"' in head:
        return "roomplan"
    return None


def _in_zip(path: Path) -> str | None:
    """A zip with a Sweet Home 3D home, or with a USD scene."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (OSError, zipfile.BadZipFile, ValueError, NotImplementedError, UnicodeDecodeError):
        return None
    if "Home" in names or "Home.xml" in names:
        return "sweethome"
    return "roomplan" if any(name.lower().endswith((".usd", ".usda", ".usdc")) for name in names) else None


def _points(head: bytes) -> str | None:
    if head.startswith(b"ply"):
        faces = next((line.split()[-1] for line in head.split(b"\n") if line.startswith(b"element face")), b"0")
        return "points" if faces.strip() == b"0" and b"end_header" in head else None
    return "points" if head.startswith((b"LASF", b"ASTM-E57")) or _PCD.search(head) else None


# Files of design programs that no reader opens, and what to do about them.


_PACKED = frozenset((".zip", ".7z", ".rar", ".tar", ".tgz", ".gz"))
_EXPORTS = {
    ".dxf": frozenset((".dwg",)),
    ".ifc": frozenset((".rvt", ".pln")),
    ".glb or .ifc": frozenset((".skp", ".3dm", ".step", ".stp", ".iges", ".igs")),
    ".glb": frozenset((".fbx", ".blend", ".3ds", ".max", ".ma", ".mb", ".x3d")),
}
"""What to export files of design programs as, by what their programs write."""


def how_to_export(suffixes: Iterable[str]) -> str:
    """Say how files with these endings can be converted and built; nothing if no ending is known."""
    said = {suffix.lower() for suffix in suffixes}
    if packed := sorted(_PACKED & said):
        return f"; unpack {', '.join(packed)}" + how_to_export(said - _PACKED)
    ways = [f"{', '.join(sorted(known))} as {form}" for form, these in _EXPORTS.items() if (known := these & said)]
    return f"; export {' and '.join(ways)} from the program that made it" if ways else ""


# The names of sources that are made: ``procedural:COUNT``, and ``procedural:COUNT?style=STYLE``.


SOUND, PUBLISHED, TEST = "sound", "published", "test"
STYLES = {SOUND: SOUND, PUBLISHED: PUBLISHED, TEST: TEST, "home": PUBLISHED, "plain": TEST}
"""The styles by the names that a source may give them; "home" and "plain" are earlier names. TEST is no longer made."""

_NAME = re.compile(r"procedural:(\d+)(?:\?style=(\w+))?", re.ASCII)


@dataclass(frozen=True)
class MadeHouses:
    """How many houses, of which style: sound homes, homes like the published plans, or test houses."""

    count: int
    style: str

    @property
    def name(self) -> str:
        """The source's full name, which states the style."""
        return f"procedural:{self.count}?style={self.style}"


def parse_made_houses(source: str) -> MadeHouses | None:
    """Return what such a name asks for, or None for any other name."""
    found = _NAME.fullmatch(source)
    style = STYLES.get(found[2] or SOUND) if found else None
    return MadeHouses(int(found[1]), style) if found and style else None


_READER_OPTIONS: dict[str, tuple[str, ...]] = {
    "procthor": (),
    "front3d": (),
    "gazebo": ("model_path", "root"),
    "sweethome": (),
    "roomplan": (),
    "points": ("up", "units"),
    "vector_plans": (),
    "occupancy_map": ("resolution",),
}
"""The readers that are chosen by the file, and the options that each takes; ``root`` is the folder of the source."""

_MODEL = "model.config"


def find(path: str, **options: str) -> Iterator[Input]:
    """List what the file holds, or the files of the folder, sorted by their names."""
    root = Path(path)
    options["root"] = str((root if root.is_dir() else root.parent).absolute())
    if not root.is_dir():
        kind = "occupancy_map" if is_map_file(root) else reader_for_file(root)
        yield from _inputs(root, kind, f"{root.absolute().parent.name}/{root.name}".lstrip("/"), options)
        return
    files = sorted(walk_source_files(root))
    houses = [file for file in files if not is_part_of_archive(file)]  # R4
    kinds = {file: kind for file in houses if (kind := reader_for_file(file))}
    if options.get("resolution"):  # R2
        maps = drop_map_pictures(file for file in files if is_map_file(file))
        kinds = dict(sorted((kinds | dict.fromkeys(maps, "occupancy_map")).items()))
    has_world = any(kind == "gazebo" and not _in_model(file, root) for file, kind in kinds.items())
    for file, kind in kinds.items():
        if not (kind == "gazebo" and has_world and _in_model(file, root)):  # R3
            yield from _inputs(file, kind, file.relative_to(root).as_posix(), options)


def belongs_to_another_file(file: Path, root: Path) -> bool:
    """Return whether a mesh file of a folder is no house by itself: another reader's, or a part of a model (R3)."""
    return root.is_dir() and (_in_model(file, root) or reader_for_file(file) is not None)


def _inputs(file: Path, kind: str | None, name: str, options: dict[str, str]) -> Iterator[Input]:
    if kind is not None:
        chosen = {key: value for key, value in options.items() if key in _READER_OPTIONS[kind]}
        yield from import_module(f"pipeline.sources.{kind}").find(str(file), **chosen, file=name)


def _in_model(file: Path, root: Path) -> bool:
    """Return whether a file lies in the folder of a Gazebo model."""
    folders = [folder for folder in file.parents if folder == root or root in folder.parents]
    return any((folder / _MODEL).is_file() for folder in folders)
