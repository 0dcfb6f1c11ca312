"""Describe the files and columns of a release in Croissant 1.0 (``croissant.json``), with terms for responsible AI."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import pyarrow as pa

from houseexpo.dataset.store.folders import ARCHIVE
from houseexpo.files import sha256_of
from houseexpo.release.descriptions import KEYWORDS, ReleaseFacts, bibtex_entry
from houseexpo.release.tables import IMAGE, ReleaseTable, TableColumn

_VERSION: Final = "http://mlcommons.org/croissant/1.0"
_RAI_VERSION: Final = "http://mlcommons.org/croissant/RAI/1.0"
_CONTEXT: Final[dict[str, Any]] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
_TYPES: Final = {pa.string(): "sc:Text", pa.binary(): "sc:Text", pa.int32(): "sc:Integer", pa.float64(): "sc:Float"}


def describe_in_croissant(facts: ReleaseFacts, tables: Iterable[ReleaseTable], folder: Path) -> dict[str, Any]:
    """Return the description of a release's files and of the columns of its tables; this hashes the files."""
    about, tables = facts.about, tuple(tables)
    files = [f"{table.name}/{part}.parquet" for table in tables for part in facts.parts.lists]
    given = {"datePublished": about.published, "url": about.url, "identifier": about.doi and f"doi:{about.doi}"}
    return {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": [_VERSION, _RAI_VERSION],
        "name": facts.name,
        "alternateName": facts.title,
        "description": facts.description,
        "license": facts.material.licence.url,
        "creator": [{"@type": "sc:Organization", "name": name} for name in about.creators],
        "version": about.version,
        "keywords": list(KEYWORDS),
        "citeAs": bibtex_entry(facts),
        **{name: text for name, text in given.items() if text},
        **_responsible(facts),
        "distribution": [
            _file(folder, ARCHIVE, "application/gzip", "The JSON of every plan."),
            *(_file(folder, name, "application/x-parquet", "") for name in files),
            *(_set(table) for table in tables),
        ],
        "recordSet": [_records(table) for table in tables],
    }


def _responsible(facts: ReleaseFacts) -> dict[str, Any]:
    made = facts.material.manifest.is_made
    kind = ["Software Collection"] if made else ["Secondary Data Analysis"]
    return {
        "rai:dataCollection": facts.collection,
        "rai:dataCollectionType": kind,
        "rai:dataCollectionRawData": "3D houses: walls, floors and openings as meshes, with the rooms they name.",
        "rai:dataCollectionMissingData": "Houses of which no plan could be made, and copies of plans, are left out.",
        "rai:dataPreprocessingProtocol": [
            "Walls are cut at two heights above the floor; doors are where the cuts differ.",
            "Coordinates are rounded to 1 cm; rings are valid and simple.",
        ],
        "rai:dataAnnotationProtocol": ["Labels of rooms are the words of the source, brought to 25 labels."],
        "rai:machineAnnotationTools": ["houseexpo"],
        "rai:dataBiases": list(facts.biases),
        "rai:dataLimitations": list(facts.limits),
        "rai:dataUseCases": list(facts.uses),
        "rai:dataSocialImpact": "Robots that find their way at home; they may help people, and may also watch them.",
        "rai:personalSensitiveInformation": [facts.personal],
        "rai:dataReleaseMaintenancePlan": "A release does not change. Corrections come as a new version.",
    }


def _file(folder: Path, name: str, kind: str, about: str) -> dict[str, Any]:
    file = folder / name
    return {
        "@type": "cr:FileObject",
        "@id": name,
        "name": name,
        **({"description": about} if about else {}),
        "contentUrl": name,
        "contentSize": f"{file.stat().st_size} B",
        "encodingFormat": kind,
        "sha256": sha256_of(file),
    }


def _set(table: ReleaseTable) -> dict[str, Any]:
    return {
        "@type": "cr:FileSet",
        "@id": f"{table.name}-files",
        "name": f"{table.name}-files",
        "description": f"The parts of the table {table.name}, a file each.",
        "encodingFormat": "application/x-parquet",
        "includes": f"{table.name}/*.parquet",
    }


def _records(table: ReleaseTable) -> dict[str, Any]:
    return {
        "@type": "cr:RecordSet",
        "@id": table.name,
        "name": table.name,
        "description": table.about,
        "field": [_field(table, column) for column in table.columns],
    }


def _field(table: ReleaseTable, column: TableColumn) -> dict[str, Any]:
    is_image, is_list = column.type == IMAGE, pa.types.is_list(column.type)
    source: dict[str, Any] = {"fileSet": {"@id": f"{table.name}-files"}, "extract": {"column": column.name}}
    if is_image:
        source["transform"] = {"jsonPath": "bytes"}
    return {
        "@type": "cr:Field",
        "@id": f"{table.name}/{column.name}",
        "name": column.name,
        "description": column.about,
        "dataType": "sc:ImageObject" if is_image else "sc:Text" if is_list else _TYPES[column.type],
        **({"repeated": True} if is_list else {}),
        "source": source,
    }
