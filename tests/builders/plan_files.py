"""Small data sets in every packing that the library opens."""

from __future__ import annotations

import gzip
import io
import tarfile
import zipfile
from pathlib import Path

from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode

KINDS = ("folder", "nested", "tar.gz", "zip", "jsonl", "jsonl.gz")


def house(name: str, width: float = 4.0, rooms: int = 1, **more: object) -> FloorPlan:
    """Return a rectangle of the given width, 4 m deep, as a published plan."""
    x, y = round(0.1 + width, 2), 4.1
    return FloorPlan(name, [(0.1, 0.1), (0.1, y), (x, y), (x, 0.1)], rooms, {"Kitchen": [(0.1, 0.1, x, y)]}, **more)


def hexed(number: int) -> str:
    """Return a published kind of id."""
    return f"{number:032x}"


def pack(target: Path, kind: str, members: dict[str, bytes]) -> Path:
    """Write members, plans by their ids, in one of ``KINDS``; names with a dot are written as they are."""
    files = {name if "." in Path(name).name else f"json/{name}.json": data for name, data in members.items()}
    if kind in ("folder", "nested"):
        folder = target / "plans"
        for name, data in files.items():
            file = folder / (name if kind == "nested" else name.removeprefix("json/"))
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
        return folder
    path = target / f"plans.{kind}"
    if kind == "zip":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in files.items():
                archive.writestr(name, data)
    elif kind == "tar.gz":
        path.write_bytes(tar(files))
    else:
        lines = b"".join(data + b"\n" for data in members.values())
        path.write_bytes(gzip.compress(lines) if kind.endswith("gz") else lines)
    return path


def tar(files: dict[str, bytes], extra: tuple[tarfile.TarInfo, ...] = ()) -> bytes:
    """Return the bytes of a ``.tar.gz``; ``extra`` members have a header and no bytes."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as archive:
        for name, data in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
        for info in extra:
            archive.addfile(info)
    return stream.getvalue()


def houses(count: int) -> dict[str, bytes]:
    """Return ``count`` different published plans by id."""
    return {hexed(i): encode(house(hexed(i), 3 + i / 2, 1 + i)) for i in range(count)}
