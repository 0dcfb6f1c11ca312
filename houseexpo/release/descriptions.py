"""Write the texts that several files of a release contain: description, origin, limits, biases, uses, citation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from houseexpo.release.check_releasable import PublisherTexts, ReleasableDataset
from houseexpo.release.splits import ReleaseSplits
from houseexpo.words import count_noun

KEYWORDS: Final = (
    "floor plans",
    "indoor navigation",
    "exploration",
    "mobile robots",
    "simulation",
    "mapping",
    "houses",
)
PAPER: Final = "HouseExpo: A Large-scale 2D Indoor Layout Dataset for Learning-based Algorithms on Mobile Robots (2019)"
PAPER_URL: Final = "https://github.com/TeaganLi/HouseExpo"
PAPER_AUTHORS: Final = (
    *(("Li", "Tingguang"), ("Ho", "Danny"), ("Li", "Chenming")),
    *(("Zhu", "Delong"), ("Wang", "Chaoqun"), ("Meng", "Max Q.-H.")),
)


@dataclass(frozen=True)
class ReleaseFacts:
    """The facts for the descriptions of a release; ``rows`` are counts by table and part, in order."""

    name: str
    about: PublisherTexts
    material: ReleasableDataset
    parts: ReleaseSplits
    rows: Mapping[str, Mapping[str, int]]

    @property
    def plans(self) -> int:
        """The number of plans."""
        return len(self.material.plans)

    @property
    def title(self) -> str:
        """The given title, or a generic one."""
        kind = "made houses" if self.material.manifest.is_made else "houses"
        return self.about.title or f"{count_noun(self.plans, 'floor plan')} of {kind}"

    @property
    def stats(self) -> Mapping[str, Any]:
        """The statistics of the plans in ``stats.json``."""
        found: Mapping[str, Any] = self.material.stats["plans"]
        return found

    @property
    def has_furniture(self) -> bool:
        """Whether any plan has furniture."""
        return "objects" in self.rows

    @property
    def description(self) -> str:
        """A paragraph that describes the data set."""
        rooms, area = sum(self.rows["rooms"].values()), self.stats["area_m2"]
        made = self.material.manifest.is_made
        furniture = " Some are furnished." if self.has_furniture else ""
        return (
            f"{count_noun(self.plans, 'floor plan')} of houses for robots that learn to explore and to navigate, with "
            f"{count_noun(rooms, 'room')}: outlines with holes, rooms with labels, doors, all as polygons in "
            f"metres. A plan has {rooms / self.plans:.1f} rooms and {area['mean']:.0f} m² on average.{furniture} "
            + ("The houses were made by a program; nobody lives in them." if made else f"{self.credit}")
        ).strip()

    @property
    def credit(self) -> str:
        """The credit for the houses that their manifest states."""
        return self.material.manifest.credit

    @property
    def collection(self) -> str:
        """A text on how the plans were made."""
        made = self.material.manifest.is_made
        source = (
            "A program makes 3D houses with known rooms from random numbers and a seed. "
            if made
            else "3D houses of the sources named were read. "
        )
        return (
            f"{source}A pipeline cuts the walls of each level, finds rooms and doors, joins parts that nothing joins, "
            "straightens walls and writes the level as polygons. Copies of an earlier plan are left out."
        )

    @property
    def limits(self) -> tuple[str, ...]:
        """The limitations of the data."""
        furniture = (
            "Furniture was placed by rules, in part of the plans."
            if self.has_furniture
            else "Furniture is not in the plans: free space is everything inside the walls."
        )
        made = self.material.manifest.is_made
        return (
            "Plans are flat: heights of walls, stairs and thresholds are not in them"
            + ("." if "windows" in self.rows else ", and windows neither."),
            furniture,
            *(("The houses are synthetic; results on them need a check on real ones.",) if made else ()),
            "Doors inside are open, doors to the outside are closed.",
        )

    @property
    def biases(self) -> tuple[str, ...]:
        """The biases of the data."""
        made = self.material.manifest.is_made
        return (
            *(("Layouts follow the rules of the program that made them and vary less than homes do.",) if made else ()),
            "There are 25 labels; a room of another kind is Unlabelled or has the nearest of them.",
            "Walls run mostly at right angles.",
        )

    @property
    def uses(self) -> tuple[str, ...]:
        """The intended uses of the data, and unsuitable ones."""
        return (
            "Training and testing of exploration, navigation, mapping and map prediction for mobile robots.",
            "Study of floor plans: rooms, doors, graphs.",
            "Not for building, for appraisal of real estate, or for conclusions about how people live.",
        )

    @property
    def personal(self) -> str:
        """A text on personal data in the data set."""
        if self.material.manifest.is_made:
            return "Nobody: the houses exist nowhere and belong to no one."
        return "No names, no addresses; file names of the sources stand in the provenance of plans."


def bibtex_entry(facts: ReleaseFacts) -> str:
    """Return the BibTeX entry of the release."""
    about = facts.about
    fields = {
        "title": f"{{{facts.title}}}",
        "author": " and ".join(f"{{{name}}}" for name in about.creators),
        "version": about.version,
        "year": about.year,
        "doi": about.doi,
        "url": about.url,
    }
    lines = [f"  {name} = {{{text}}}" for name, text in fields.items() if text]
    return "@misc{" + facts.name.replace("-", "_") + ",\n" + ",\n".join(lines) + "\n}"


# Make ``CITATION.cff`` and ``LICENSE``.


def citation_files(facts: ReleaseFacts) -> dict[str, bytes]:
    """Return the files by name."""
    return {"CITATION.cff": _citation(facts), "LICENSE": _licence(facts).encode()}


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


def _licence(facts: ReleaseFacts) -> str:
    licence, names = facts.material.licence, ", ".join(facts.about.creators)
    credit = f"\nThe houses that the plans were made from: {facts.credit}\n" if facts.credit else ""
    return (
        f"{facts.title}\n{names}\n\n"
        f"This data set is available under the licence {licence.title}.\n"
        f"SPDX-License-Identifier: {licence.spdx}\n"
        f"Its text: {licence.url}\n{credit}"
    )
