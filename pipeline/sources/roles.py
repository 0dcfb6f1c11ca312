"""What the names in a file say of each part, before anybody looks at its shape.

R1  The head noun decides: the last known word of a Germanic name (a floor lamp is a lamp), the first of a Romance one
    (a mesa de centro is a table). Words are compared whole: outdoor is no door.
R2  A name that holds both a wall and a door is the wall with the hole; glass and windows give way to any other word; a
    door of a cupboard is furniture, a door of a toilet a door.
R3  "Ground floor" names a storey, "bed room" a room; neither says anything of the thing.
R4  A part's own name comes first, then its mesh's, then those of the groups around it, then its material's. A group
    hands down no floor (it may be a storey), and no wall where the material knows better; a material that says door
    is heard inside what is called wall, and one that says anything but door, wall, floor or ceiling is not heard.
R5  A room's name beside the word for floor names the room.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from pipeline.sources.name_tables import (
    AMBIGUOUS,
    COMPOUNDS,
    FURNITURE_DOORS,
    ROOMS,
    STOREYS,
    WALL_MATERIALS,
    Role,
)
from pipeline.sources.name_words import is_romance, meaning, tokens
from pipeline.sources.room_names import labels_for
from pipeline.sources.scene import Part

SHORTEST_REST = 3  # letters before the ending of a compound
SAID_BY_MATERIALS = frozenset({Role.DOOR, Role.WALL, Role.FLOOR, Role.CEILING})
HANDED_DOWN = frozenset({Role.DOOR, Role.FURNITURE, Role.SPACE, Role.OPENING, Role.LEFT_OUT})


@dataclass(frozen=True)
class Named:
    """A role and the name that gave it; ``sure`` is False where the word means other things too."""

    role: Role
    words: str
    sure: bool = True


def role_of(name: str) -> Named | None:
    """Return what one name says, or None if it says nothing."""
    known = [(word, role) for word in _without_places(tokens(name)) if (role := _meaning(word))]
    if not known:
        return None
    roles = {role for _, role in known}
    for role in (Role.SPACE, Role.OPENING):
        if role in roles:
            return Named(role, name)
    solid = [pair for pair in known if pair[0] not in WALL_MATERIALS] or known  # R2
    words = {word for word, _ in solid}
    if any(role is Role.DOOR for _, role in solid):
        if any(role is Role.WALL for _, role in solid):
            return Named(Role.WALL, name)
        if words & FURNITURE_DOORS:
            return Named(Role.FURNITURE, name)
        solid = [pair for pair in solid if pair[0] not in ROOMS]
    word, role = solid[0] if is_romance(solid[0][0]) else solid[-1]  # R1
    return Named(role, name, word not in AMBIGUOUS)


def role_of_part(part: Part) -> Named | None:
    """R4: return what a part's names say together."""
    own = _first([*part.groups[-1:], part.mesh])
    material = role_of(part.material)
    if material and material.role not in SAID_BY_MATERIALS:
        material = None
    if own and own.role is Role.WALL and material and material.role is Role.DOOR:
        return Named(Role.DOOR, part.material, sure=False)
    if own:
        return own
    around = [named for name in reversed(part.groups[:-1]) if (named := role_of(name))]
    handed = next((named for named in around if named.role in HANDED_DOWN), None)
    return handed or material or next((named for named in around if named.role is not Role.FLOOR), None)


def room_words(part: Part) -> tuple[str, ...]:
    """R5: return the source's own words for the room of a floor or a space; empty where it has none."""
    for name in (*part.groups[-1:], part.mesh):
        rest = [word for word in tokens(name) if _meaning(word) not in {Role.FLOOR, Role.SPACE}]
        words = " ".join(word for word in rest if word not in {"space", "ifcspace", "mesh", "other", "transition"})
        if words and labels_for([words]):
            return (words.title(),)
    return ()


def _first(names: Iterable[str]) -> Named | None:
    return next((named for name in names if (named := role_of(name))), None)


def _meaning(word: str) -> Role | None:
    role = meaning(word)
    if role is None:
        for ending, compound in COMPOUNDS.items():
            if word.endswith(ending) and len(word) >= len(ending) + SHORTEST_REST:
                first = word.removesuffix(ending)
                inside = compound is Role.DOOR and any(first.startswith(each) for each in FURNITURE_DOORS)
                return Role.FURNITURE if inside else compound
    return role


def _without_places(words: list[str]) -> list[str]:
    """R3: drop the names of storeys and rooms."""
    kept = list(words)
    for i in range(len(words) - 1):
        storey = words[i] in STOREYS and words[i + 1] in {"floor", "floors"}
        if storey or words[i + 1] in {"room", "zimmer", "kamer"}:
            kept[i] = kept[i + 1] = ""
    return kept
