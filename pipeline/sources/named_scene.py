"""Sort a mesh's faces into building, doors, furniture and rooms by its parts' names, and share them out among levels.

R1  A piece called door that is no door by its shape (6 m wide, a wall with a hole) stays with the walls.
R2  A part called floor is evidence for floors where it is flat; its faces stay with the walls, as those do that are
    called wall, ceiling, roof or nothing.
R3  Furniture, and what is left out, are dropped from the walls unless one piece of them is as large as the house. What
    is left out and reaches beyond the house is dropped all the same: a sky is much larger.
    Handles of doors stay where no door has a name: the stages find doors by them.
R4  Ground that ends with the house is its floor.
R5  Where dropping leaves hardly anything that stands, the names are wrong and nothing is dropped.
R6  A part called threshold, flat, on the floor and as narrow as a doorway (one called opening: of any width), is an
    opening where one can walk across it: nothing stands on it, and no wall within DEEPEST_WALL_M of its middle on both
    sides.
R7  A part that stands and is called a window or glass is a window where it is no deeper than a wall; it stays with the
    walls.

Faces are taken apart into connected pieces, and pieces that touch make things. Lengths are metres, z is up.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from pipeline.sources.meshes.scene import MeshScene, PartNames
from pipeline.sources.roles import (
    NamedRole,
    Role,
    labels_for,
    names_door_handle,
    names_window,
    part_room_words,
    role_from_part,
    split_words,
)
from pipeline.sources.storeys.surfaces import Surfaces, cut_at_height
from pipeline.sources.tolerances import (
    DEEPEST_WALL_M,
    DOOR_SHAPE,
    FILE_GRID_M,
    HORIZONTAL,
    HOUSE_M2,
    LOWEST_HEAD_M,
    MIN_DOORS,
    NAMED_DOOR_M,
    NARROWEST_DOOR_M,
    SCARCELY,
    SPACE_HEIGHT_M,
    TERRAIN_BEYOND,
    TINY,
    UPRIGHT_M2,
    WAIST_M,
    WIDEST_DOOR_BODY_M,
)
from pipeline.tolerances import (
    CRACK_M,
    FOOT_M,
    HAND_M,
    HARDLY,
    HEAD_M,
    KNEE_M,
    MM_M,
    MOST,
    NEARLY_ALL,
    PATCH_M2,
    SAME,
    SINGLE_DOOR_M,
    STAND_M,
    STUB_M,
)
from pipeline.values import Mesh, Opening, SourceObject, SourceRoom

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


def connected_pieces(mesh: Mesh, faces: Indices) -> list[Indices]:
    """Divide face numbers (k,) into connected pieces; corners closer than FILE_GRID_M are one."""
    if not len(faces):
        return []
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    corners = mesh.vertices[mesh.faces[faces]].reshape(-1, 3)
    cells = np.round((corners - corners.min(axis=0)) / FILE_GRID_M).astype(np.int64)
    _, point = np.unique(cells, axis=0, return_inverse=True)
    point = point.reshape(-1, 3)
    rows, columns = np.repeat(point[:, 0], 2), point[:, 1:].ravel()
    count = int(point.max()) + 1
    graph = coo_array((np.ones(len(rows), np.int8), (rows, columns)), shape=(count, count))
    label = connected_components(graph, directed=False)[1][point[:, 0]]
    return _divide_by_label(faces, label)


def unite_near_pieces(mesh: Mesh, found: list[Indices], apart_m: float) -> list[Indices]:
    """Unite pieces whose boxes come closer than ``apart_m``: a leaf and its handle, a table and its legs."""
    if len(found) < 2:
        return found
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    bounds = np.array([bounding_box(mesh, faces) for faces in found])
    flat = shapely.box(bounds[:, 0, 0], bounds[:, 0, 1], bounds[:, 1, 0], bounds[:, 1, 1])
    one, other = shapely.STRtree(flat).query(flat, predicate="dwithin", distance=apart_m)
    gap = np.maximum(bounds[one, 0, 2], bounds[other, 0, 2]) - np.minimum(bounds[one, 1, 2], bounds[other, 1, 2])
    near = gap <= apart_m
    count = len(found)
    graph = coo_array((np.ones(near.sum(), np.int8), (one[near], other[near])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    return [np.concatenate([found[i] for i in group]) for group in _divide_by_label(np.arange(count), label)]


def bounding_box(mesh: Mesh, faces: Indices) -> Floats:
    """Lowest and highest corner (2, 3) of some faces."""
    corners = mesh.vertices[mesh.faces[faces]].reshape(-1, 3)
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def take_faces(mesh: Mesh, faces: npt.NDArray[np.bool_] | Indices) -> Mesh:
    """Return the mesh of some faces, with only their own vertices."""
    used, packed = np.unique(mesh.faces[faces], return_inverse=True)
    return Mesh(mesh.vertices[used], packed.reshape(-1, 3).astype(np.int64))


def _divide_by_label(values: Indices, label: npt.NDArray[np.int32]) -> list[Indices]:
    order = np.argsort(label, kind="stable")
    return np.split(values[order], np.cumsum(np.bincount(label))[:-1])


def may_be_door(mesh: Mesh, faces: Indices, sure: bool) -> bool:
    """Tell whether a piece may be a door, or a part of one.

    ``sure`` is False where its name means other things too: then it must have a door's height and width itself.
    """
    low, high = bounding_box(mesh, faces)
    width, depth = plan_sides(mesh, faces)
    height = float(high[2] - low[2])
    if max(width, height) > NAMED_DOOR_M[1]:
        return False
    if not sure and not (NAMED_DOOR_M[0] <= height and width >= SINGLE_DOOR_M[0]):
        return False
    return depth > STUB_M or not _is_wall_with_hole(mesh, faces, low, height)


def is_floor(surfaces: Surfaces, faces: Indices) -> bool:
    """Tell whether most of a part lies level: what is called floor may be a storey."""
    flat = float(surfaces.area[faces][np.abs(surfaces.normal[faces, 2]) > HORIZONTAL].sum())
    # most of a floor lies level: what is called floor may be a storey
    return flat >= MOST * float(surfaces.area[faces].sum())


def is_room_high(mesh: Mesh, faces: Indices) -> bool:
    """Tell whether a body is as high as a room."""
    low, high = bounding_box(mesh, faces)
    return bool(SPACE_HEIGHT_M[0] <= high[2] - low[2] <= SPACE_HEIGHT_M[1])


def is_whole_house(mesh: Mesh, faces: Indices, low: npt.NDArray[np.float64], high: npt.NDArray[np.float64]) -> bool:
    """Tell whether a piece is as high as a storey and covers half of the plan box: that is a house, no piece of it."""
    lowest, highest = bounding_box(mesh, faces)
    area = float(np.prod((highest - lowest)[:2]))
    # it covers most of the plan box
    # what is as high as a room and fills the plan is the house
    return bool(highest[2] - lowest[2] > HEAD_M and area > MOST * float(np.prod((high - low)[:2])))


def plan_sides(mesh: Mesh, faces: Indices) -> tuple[float, float]:
    """Longer and shorter side of the tightest rectangle around the piece in plan."""
    points = np.unique(mesh.vertices[np.unique(mesh.faces[faces]), :2], axis=0)
    hull = shapely.convex_hull(shapely.multipoints(points))
    tight = shapely.minimum_rotated_rectangle(hull)
    if tight.geom_type != "Polygon":
        return float(tight.length), 0.0
    ring = shapely.get_coordinates(tight)
    sides = np.linalg.norm(np.diff(ring[:3], axis=0), axis=1)
    return float(sides.max()), float(sides.min())


def _is_wall_with_hole(mesh: Mesh, faces: Indices, low: npt.NDArray[np.float64], height: float) -> bool:
    """Tell whether a piece is a wall around a hole, looking at it at half of its height."""
    surfaces = Surfaces.of(Mesh(mesh.vertices, mesh.faces[faces]))
    segments = cut_at_height(surfaces, np.ones(len(faces), np.bool_), float(low[2]) + height / 2 + FILE_GRID_M)
    if not len(segments):
        return False
    points = segments.reshape(-1, 2)
    spread = points - points.mean(axis=0)
    along = np.linalg.svd(spread, full_matrices=False)[2][0]
    spans = np.sort((segments - points.mean(axis=0)) @ along, axis=1)
    spans = spans[np.argsort(spans[:, 0])]
    reached = np.maximum.accumulate(spans[:, 1])
    gaps = np.maximum(spans[1:, 0] - reached[:-1], 0.0)
    solid = float(reached[-1] - spans[0, 0] - gaps.sum())
    # a door's frame has less wall on both sides of its hole
    return bool(len(gaps) and gaps.max() >= SINGLE_DOOR_M[0] and solid >= STUB_M)


Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class NamedBody:
    """The body of a room (a space, a floor) with the source's words for it, empty where it has none."""

    words: tuple[str, ...]
    mesh: Mesh


@dataclass(frozen=True, eq=False)
class NamedScene:
    """``solid`` is what may be wall, floor or ceiling, with masks over its faces; the rest are things of their own."""

    solid: Mesh
    floor: Bools
    ceiling: Bools
    leaves: tuple[SourceObject, ...] = ()
    furniture: tuple[SourceObject, ...] = ()
    floors: tuple[NamedBody, ...] = ()
    spaces: tuple[NamedBody, ...] = ()
    openings: tuple[Mesh, ...] = ()
    thresholds: tuple[NamedBody, ...] = ()
    windows: tuple[Mesh, ...] = ()
    """They are a part of ``solid``, too."""

    @classmethod
    def plain(cls, mesh: Mesh) -> NamedScene:
        """Return a mesh of which nothing is named."""
        none = np.zeros(len(mesh.faces), np.bool_)
        return cls(mesh, none, none)


def structural_mesh(scene: MeshScene) -> Mesh:
    """Return what the names alone leave as building, in the scene's own frame, for finding its axis and unit."""
    dropped = {Role.DOOR, Role.FURNITURE, Role.LEFT_OUT, Role.TERRAIN, Role.SPACE, Role.OPENING}
    keep = [not ((named := role_from_part(part)) and named.role in dropped) for part in scene.parts]
    chosen = np.array(keep, np.bool_)[scene.owner]
    if chosen.all() or not chosen.any():
        return scene.mesh
    return take_faces(scene.mesh, chosen) if _is_building(scene.mesh, chosen) else scene.mesh


def _is_building(mesh: Mesh, chosen: Bools) -> bool:
    """Return whether faces, axis and unit unknown, are most of a mesh: terrain and trees have more faces than walls."""
    if chosen.sum() >= SCARCELY * len(chosen):  # so much names leave standing, at least
        return True
    surfaces = Surfaces.of(mesh)
    upright = [surfaces.walls(axis) for axis in (1, 2)]
    # names that leave hardly any wall standing are wrong
    return any(0 < HARDLY * surfaces.area[each].sum() <= surfaces.area[each & chosen].sum() for each in upright)


@dataclass(frozen=True)
class DoorHeight:
    """How high the doors are that a file names, in its own unit; ``is_sure``: there are several."""

    height: float
    is_sure: bool = True


def named_door_heights(scene: MeshScene) -> dict[str, DoorHeight]:
    """Return the middle height of the doors that names alone tell, by up axis.

    Only those count that stand upright on the axis: 1.5 to 4.5 times as high as wide.
    """
    named = (role_from_part(part) for part in scene.parts)
    doors = np.array([each is not None and each.role is Role.DOOR and each.sure for each in named], np.bool_)
    sizes = scene.part_sizes[doors]
    sizes = sizes[np.isfinite(sizes).all(axis=1)]  # a reader may have left out all faces of one
    found = {}
    for axis, number in (("y", 1), ("z", 2)):
        upright = [
            size[number]
            for size in sizes
            if DOOR_SHAPE[0] <= size[number] / max(*np.delete(size, number), TINY) <= DOOR_SHAPE[1]
        ]
        if upright:
            found[axis] = DoorHeight(float(np.median(upright)), is_sure=len(upright) >= MIN_DOORS)
    return found


def drop_default_cube(scene: MeshScene) -> MeshScene:
    """Drop the cube of side 2 about the origin with which Blender begins, where it was left among many parts."""
    for index, part in enumerate(scene.parts):
        if len(scene.parts) < 5 or "Cube" not in {part.mesh, *part.groups[-1:]}:
            continue
        faces = scene.owner == index
        corners = scene.mesh.vertices[scene.mesh.faces[faces]]
        if faces.sum() == 12 and np.allclose(np.abs(corners), 1.0, atol=SAME):
            return MeshScene(
                Mesh(scene.mesh.vertices, scene.mesh.faces[~faces]), scene.owner[~faces], scene.parts, scene.left_out
            )
    return scene


def sort_faces_by_role(scene: MeshScene) -> NamedScene:
    """Sort an upright scene in metres by role."""
    roles = [role_from_part(part) for part in scene.parts]
    if not any(roles):
        return NamedScene.plain(scene.mesh)
    found = _Sorter(scene, roles).sort_by_role()
    surfaces = Surfaces.of(found.solid)
    walls = surfaces.walls()
    whole = Surfaces.of(scene.mesh)
    before = float(whole.area[whole.walls()].sum())
    if float(surfaces.area[walls].sum()) < min(HARDLY * before, HOUSE_M2):  # R5
        return NamedScene.plain(scene.mesh)
    return found


class _Sorter:
    """Goes through the nodes of a scene; what it takes out of the walls is marked in ``out``."""

    def __init__(self, scene: MeshScene, roles: list[NamedRole | None]) -> None:
        self.mesh, self.parts = scene.mesh, scene.parts
        self.surfaces = Surfaces.of(scene.mesh)
        self.out = np.zeros(len(scene.mesh.faces), np.bool_)
        self.floor, self.ceiling = self.out.copy(), self.out.copy()
        self.nodes = _by_node(scene, roles)
        plain = [faces for named, _, faces in self.nodes if named is None or named.role is Role.WALL]
        rest = np.concatenate(plain) if plain else np.arange(len(scene.mesh.faces))
        self.low, self.high = bounding_box(self.mesh, rest)

    def sort_by_role(self) -> NamedScene:
        leaves, furniture = [*self._doors()], [*self._furniture()]
        openings = tuple(take_faces(self.mesh, faces) for _, faces in self._each(Role.OPENING))
        self._drop(Role.OPENING)
        self._drop(Role.LEFT_OUT, but_handles=not leaves)
        self._terrain()
        spaces, floors, thresholds = tuple(self._spaces()), tuple(self._floors()), tuple(self._thresholds())
        for _, faces in self._each(Role.CEILING):
            self.ceiling[faces] = True
        keep = ~self.out
        return NamedScene(
            take_faces(self.mesh, keep),
            self.floor[keep],
            self.ceiling[keep],
            tuple(leaves),
            tuple(furniture),
            floors,
            spaces,
            openings,
            thresholds,
            tuple(self._windows()),
        )

    def _each(self, role: Role) -> Iterator[tuple[PartNames, Indices]]:
        for named, part, faces in self.nodes:
            if named is not None and named.role is role:
                yield part, faces

    def _doors(self) -> Iterator[SourceObject]:
        """Yield what is called and shaped like a door; anything else of that name stays with the walls."""
        for named, _, faces in self.nodes:
            if named is None or named.role is not Role.DOOR:
                continue
            doors = [piece for piece in connected_pieces(self.mesh, faces) if may_be_door(self.mesh, piece, named.sure)]
            for thing in unite_near_pieces(self.mesh, doors, STAND_M):  # pieces of doors that are closer are one door
                self.out[thing] = True
                yield SourceObject((named.words,), take_faces(self.mesh, thing))

    def _furniture(self) -> Iterator[SourceObject]:
        """Yield the furniture, and drop it from the walls unless one piece is as large as the house."""
        for named, _, faces in self.nodes:
            if named is None or named.role is not Role.FURNITURE:
                continue
            found = connected_pieces(self.mesh, faces)
            if any(self._fills(piece) for piece in found):
                continue
            # pieces of furniture that are closer are one object
            for thing in unite_near_pieces(self.mesh, found, HAND_M):
                self.out[thing] = True
                yield SourceObject((named.words,), take_faces(self.mesh, thing))

    def _drop(self, role: Role, *, but_handles: bool = False) -> None:
        """Drop the parts of a role from the walls; handles of doors stay where no door has a name."""
        for named, _, faces in self.nodes:
            if named is None or named.role is not role or (but_handles and names_door_handle(named.words)):
                continue
            if self._reaches_beyond(faces) or not any(
                self._fills(piece) for piece in connected_pieces(self.mesh, faces)
            ):
                self.out[faces] = True

    def _terrain(self) -> None:
        """Drop the ground, unless it ends with the house: then it is the floor."""
        for _, faces in self._each(Role.TERRAIN):
            if self._reaches_beyond(faces):
                self.out[faces] = True
            elif is_floor(self.surfaces, faces):
                self.floor[faces] = True

    def _floors(self) -> Iterator[NamedBody]:
        """Yield the flat parts that are called floor; their faces stay with the walls."""
        for part, faces in self._each(Role.FLOOR):
            if is_floor(self.surfaces, faces):
                self.floor[faces] = True
                yield NamedBody(part_room_words(part), take_faces(self.mesh, faces))

    def _thresholds(self) -> Iterator[NamedBody]:
        """Yield what is flat, with the words that its name is of; it is a piece of the floor."""
        for part, faces in self._each(Role.THRESHOLD):
            if is_floor(self.surfaces, faces):
                self.floor[faces] = True
                yield NamedBody(
                    tuple(split_words("_".join(part.groups[-1:]) or part.mesh)), take_faces(self.mesh, faces)
                )

    def _windows(self) -> Iterator[Mesh]:
        """Yield the frames and panes of each window together."""
        named = [faces for name, _, faces in self.nodes if name and name.role is Role.WALL and names_window(name.words)]
        pieces = [piece for faces in named for piece in connected_pieces(self.mesh, faces)]
        for window in unite_near_pieces(self.mesh, pieces, CRACK_M):
            yield take_faces(self.mesh, window)

    def _spaces(self) -> Iterator[NamedBody]:
        for part, faces in self._each(Role.SPACE):
            self.out[faces] = True
            if is_room_high(self.mesh, faces):
                yield NamedBody(part_room_words(part), take_faces(self.mesh, faces))

    def _reaches_beyond(self, faces: Indices) -> bool:
        low, high = bounding_box(self.mesh, faces)
        return bool(((high - low)[:2] > TERRAIN_BEYOND * (self.high - self.low)[:2]).any())

    def _fills(self, faces: Indices) -> bool:
        return is_whole_house(self.mesh, faces, self.low, self.high)


def _by_node(scene: MeshScene, roles: list[NamedRole | None]) -> list[tuple[NamedRole | None, PartNames, Indices]]:
    """Faces of each node and role: the materials of one node that say the same are one."""
    order = np.argsort(scene.owner, kind="stable")
    counts = np.bincount(scene.owner, minlength=len(scene.parts))
    each = np.split(order, np.cumsum(counts)[:-1]) if len(counts) else []
    groups: dict[tuple[object, ...], list[int]] = defaultdict(list)
    for index, part in enumerate(scene.parts):
        named = roles[index]
        groups[(part.groups, part.mesh, named and (named.role, named.words))].append(index)
    return [
        (roles[indices[0]], scene.parts[indices[0]], np.concatenate([each[i] for i in indices]))
        for indices in groups.values()
        if sum(len(each[i]) for i in indices)
    ]


# What a mesh file names, given to the levels it stands on: leaves, furniture, rooms, openings.


@dataclass(frozen=True, eq=False)
class LevelParts:
    """One level's share, in the level frame; ``room_count`` is None if the source has no spaces."""

    leaves: tuple[SourceObject, ...] = ()
    furniture: tuple[SourceObject, ...] = ()
    rooms: tuple[SourceRoom, ...] = ()
    room_count: int | None = None
    openings: tuple[Opening, ...] = ()
    windows: tuple[Opening, ...] = ()
    over_thresholds: tuple[Opening, ...] = ()
    """Openings over thresholds; there may be others, of which nothing is named."""


def divide_among_levels(named: NamedScene, floors_z: Sequence[float]) -> list[LevelParts]:
    """Give each level what stands between its floor and the next one's."""
    # the feet of things may lie so far under their floor
    ends = [-np.inf, *(z - FOOT_M for z in floors_z[1:]), np.inf]
    return [_share(named, z, low, high) for z, (low, high) in zip(floors_z, pairwise(ends), strict=True)]


def _share(named: NamedScene, z: float, low: float, high: float) -> LevelParts:
    def here(mesh: Mesh) -> bool:
        middle = (mesh.vertices[:, 2].min() + mesh.vertices[:, 2].max()) / 2
        return bool(low <= middle < high)

    leaves = tuple(_lower(each, z) for each in named.leaves if here(each.mesh))
    spaces = [room for body in named.spaces if here(body.mesh) for room in _rooms(body)]
    floors = [room for body in named.floors if body.words and here(body.mesh) for room in _rooms(body)]
    return LevelParts(
        leaves,
        tuple(_lower(each, z) for each in named.furniture if here(each.mesh)),
        tuple(_distinct(spaces or floors)),
        len(_distinct(spaces)) or None,
        tuple(_opening(mesh, leaves) for mesh in named.openings if here(mesh) and _is_walked(mesh, z)),
        tuple(window for mesh in named.windows if here(mesh) and (window := _window(mesh, z))),
        tuple(_over_thresholds([each for each in named.thresholds if here(each.mesh)], named.solid, z)),
    )


def _lower(thing: SourceObject, z: float) -> SourceObject:
    return SourceObject(thing.words, Mesh(thing.mesh.vertices - (0.0, 0.0, z), thing.mesh.faces))


def _rooms(body: NamedBody) -> list[SourceRoom]:
    """Rooms of a body, one for each part of its plan."""
    corners = body.mesh.vertices[body.mesh.faces][:, :, :2]
    triangles = shapely.polygons(corners)
    area = shapely.union_all(triangles[shapely.area(triangles) > UPRIGHT_M2], grid_size=MM_M)
    parts = [
        # a smaller named area is no room
        part
        for part in shapely.get_parts(area)
        if isinstance(part, Polygon) and part.area >= PATCH_M2
    ]
    return [SourceRoom(body.words, labels_for(body.words), part) for part in parts]


def _distinct(rooms: list[SourceRoom]) -> list[SourceRoom]:
    """Rooms without those that cover an earlier one: a floor may have an upper and an under side of its own."""
    kept: list[SourceRoom] = []
    for room in rooms:
        # two named rooms that share nearly all are one
        if not any(_share_of_both(room.polygon, other.polygon) > NEARLY_ALL for other in kept):
            kept.append(room)
    return kept


def _share_of_both(one: Polygon | None, other: Polygon | None) -> float:
    if one is None or other is None or not one.intersects(other):
        return 0.0
    shared = float(one.intersection(other).area)
    return shared / float(one.area + other.area - shared)


def _is_walked(mesh: Mesh, z: float) -> bool:
    low, high = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    # people walk through an opening that starts at the floor and is as high as a passage
    return bool(low - z <= FOOT_M and high - low >= LOWEST_HEAD_M)


def _opening(mesh: Mesh, leaves: Sequence[SourceObject]) -> Opening:
    hull = _hull(mesh)
    return Opening.named(hull, any(hull.intersects(_hull(leaf.mesh)) for leaf in leaves))


def _window(mesh: Mesh, z: float) -> Opening | None:
    """Return the window that a body is in a level at height z; None where it is as deep as no wall, or lies level."""
    low, high = mesh.vertices[:, 2].min() - z, mesh.vertices[:, 2].max() - z
    window = Opening.window(_hull(mesh), (float(low), float(high)))
    return window if window.depth <= DEEPEST_WALL_M and high - low >= HAND_M else None


def _hull(mesh: Mesh) -> Polygon:
    """Plan hull, given a millimetre of width where the mesh is a sheet."""
    return shapely.multipoints(mesh.vertices[:, :2]).convex_hull.buffer(MM_M, join_style="mitre")


def _over_thresholds(bodies: Sequence[NamedBody], solid: Mesh, z: float) -> Iterator[Opening]:
    """Yield the openings over the thresholds of a floor at height z."""
    if not bodies:
        return
    surfaces = Surfaces.of(solid)
    cut = cut_at_height(surfaces, np.ones(len(solid.faces), np.bool_), z + WAIST_M)
    standing = shapely.STRtree(shapely.linestrings(cut))
    for body in bodies:
        on_floor = abs(float(body.mesh.vertices[:, 2].max()) - z) <= KNEE_M
        wide, deep = plan_sides(body.mesh, np.arange(len(body.mesh.faces)))
        has_door = "opening" not in body.words
        widest = WIDEST_DOOR_BODY_M if has_door else np.inf
        if on_floor and NARROWEST_DOOR_M <= wide <= widest and deep <= min(DEEPEST_WALL_M, wide):
            box_ = shapely.minimum_rotated_rectangle(shapely.multipoints(body.mesh.vertices[:, :2]))
            if isinstance(box_, Polygon) and _is_crossed(box_, standing):
                yield Opening.named(box_, has_door=has_door)


def _is_crossed(threshold: Polygon, standing: shapely.STRtree) -> bool:
    """Tell whether one can walk across a rectangle, with the segments that stand at the height of a waist."""
    corners = shapely.get_coordinates(threshold)[:4]
    sides = np.roll(corners, -1, axis=0) - corners
    k = int(np.argmin(np.hypot(*sides[:2].T)))
    along, across = sides[1 - k], sides[k] / max(float(np.hypot(*sides[k])), TINY)
    for at in (-0.25, 0.0, 0.25):
        middle = corners.mean(axis=0) + at * along
        ways = [shapely.LineString([middle, middle + way * DEEPEST_WALL_M * across]) for way in (-1, 1)]
        on_it = shapely.LineString([middle - sides[k] / 2, middle + sides[k] / 2])
        if len(standing.query(on_it, "intersects")) or all(len(standing.query(way, "intersects")) for way in ways):
            return False
    return True
