"""Make the files for citing and depositing a release (``CITATION.cff``, Zenodo, DataCite), and ``LICENSE``."""

from __future__ import annotations

from html import escape
from typing import Any

from houseexpo.files import encode_json
from houseexpo.release.descriptions import KEYWORDS, PAPER, PAPER_AUTHORS, PAPER_URL, ReleaseFacts


def citation_files(facts: ReleaseFacts) -> dict[str, bytes]:
    """Return the files by name; ``datacite.json`` is made only if a date is given, since DataCite needs a year."""
    found = {
        "CITATION.cff": _citation(facts),
        ".zenodo.json": encode_json(_zenodo(facts)),
        "LICENSE": _licence(facts).encode(),
    }
    return found | ({"datacite.json": encode_json(_datacite(facts))} if facts.about.year else {})


def _citation(facts: ReleaseFacts) -> bytes:
    import yaml

    about = facts.about
    authors = [{"family-names": family, "given-names": given} for family, given in PAPER_AUTHORS]
    said = {
        "cff-version": "1.2.0",
        "message": "If you use this data set, please cite it.",
        "type": "dataset",
        "title": facts.title,
        "abstract": facts.description,
        "version": about.version,
        "license": facts.material.licence.spdx,
        "authors": [{"name": name} for name in about.creators],
        "date-released": about.published,
        "doi": about.doi,
        "url": about.url,
        "keywords": list(KEYWORDS),
        "references": [{"type": "article", "title": PAPER, "url": PAPER_URL, "authors": authors}],
    }
    known = {name: value for name, value in said.items() if value}
    text: str = yaml.safe_dump(known, sort_keys=False, allow_unicode=True, width=100)
    return text.encode()


def _zenodo(facts: ReleaseFacts) -> dict[str, Any]:
    about = facts.about
    given = {"publication_date": about.published, "doi": about.doi, "notes": escape(facts.credit)}
    return {
        "upload_type": "dataset",
        "title": facts.title,
        "description": f"<p>{escape(facts.description)}</p>",
        "creators": [{"name": name} for name in about.creators],
        "access_right": "open",
        "license": facts.material.licence.spdx.lower(),
        "version": about.version,
        "keywords": list(KEYWORDS),
        "related_identifiers": [{"identifier": PAPER_URL, "relation": "references", "scheme": "url"}],
        **{name: text for name, text in given.items() if text},
    }


def _datacite(facts: ReleaseFacts) -> dict[str, Any]:
    """Return the properties of DataCite's schema 4.5."""
    about, licence = facts.about, facts.material.licence
    return {
        **({"doi": about.doi} if about.doi else {}),
        **({"url": about.url} if about.url else {}),
        "schemaVersion": "http://datacite.org/schema/kernel-4",
        "creators": [{"name": name, "nameType": "Organizational"} for name in about.creators],
        "titles": [{"title": facts.title}],
        "publisher": {"name": about.creators[0]},
        "publicationYear": int(about.year),
        "types": {"resourceTypeGeneral": "Dataset", "resourceType": "Floor plans"},
        "dates": [{"date": about.published, "dateType": "Issued"}],
        "version": about.version,
        "language": "en",
        "subjects": [{"subject": word} for word in KEYWORDS],
        "rightsList": [
            {
                "rights": licence.title,
                "rightsUri": licence.url,
                "rightsIdentifier": licence.spdx,
                "rightsIdentifierScheme": "SPDX",
                "schemeUri": "https://spdx.org/licenses/",
            }
        ],
        "descriptions": [{"description": facts.description, "descriptionType": "Abstract"}],
        "relatedIdentifiers": [
            {"relatedIdentifier": PAPER_URL, "relatedIdentifierType": "URL", "relationType": "References"}
        ],
    }


def _licence(facts: ReleaseFacts) -> str:
    licence, names = facts.material.licence, ", ".join(facts.about.creators)
    credit = f"\nThe houses that the plans were made from: {facts.credit}\n" if facts.credit else ""
    return (
        f"{facts.title}\n{names}\n\n"
        f"This data set is available under the licence {licence.title}.\n"
        f"SPDX-License-Identifier: {licence.spdx}\n"
        f"Its text: {licence.url}\n{credit}"
    )
