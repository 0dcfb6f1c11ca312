"""Plan -> format -> plan, for every format that the project both writes and reads.

Drawn formats, meshes and worlds have all of a plan. Maps have its shape alone: no labels, and entrances are closed.
``tests/benchmarks/test_bench_round_trips.py`` prints what comes back.
"""

from pathlib import Path

import pytest
import shapely

from houseexpo import FloorPlan
from houseexpo.dataset import open_dataset
from houseexpo.exports import FORMATS, export
from houseexpo.plan import Door, Room
from pipeline.cli_build import from_python
from tests.builders.batch import labels, likeness, plans_of, through

SHAPES = ("glb", "obj", "sdf")
FORMS = {"dxf": "", "geojson": "", "ifc": "", "mjcf": "", "rmf": ".building.yaml", "svg": "", "usd": ""}
FORMS |= {form: f".{form}" for form in SHAPES}
NEEDS = {"dxf": "ezdxf", "ifc": "ifcopenshell", "usd": "pxr"}
"""The formats, and how the name of the file ends that is read."""
MAPS = {"ros": (".yaml", {}), "png": (".png", {"resolution": "0.02"})}
"""How the name of the file ends that is read, and the options of the build."""
FINE_M = 0.02
"""The side of a cell; a cell of the export's usual 0.05 m is 1% of a room by itself."""
SOUND = 0.67
UNREAD = {"coco", "graphml", "irsim", "json", "npz", "pol", "stage"}
"""Formats that no reader of the pipeline opens; ``json`` is a data set's."""
QUICK, MANY = 3, 30


def made(source, folder, seed):
    from_python([source], str(folder), config=None, overrides=None, workers=1, others="refuse", seed=seed)
    data = open_dataset(folder)
    return [data[name] for name in data.ids]


@pytest.fixture(scope="session")
def homes(tmp_path_factory):
    """Homes that the project makes like the published plans."""
    return made(f"procedural:{QUICK}?style=published", tmp_path_factory.mktemp("published") / "plans", 2019)


@pytest.fixture(scope="session")
def storeys(tmp_path_factory):
    """A house of two storeys, and others: with windows, the upper ones with a stair from below."""
    plans = made("procedural:3", tmp_path_factory.mktemp("sound") / "plans", 5)
    assert any(plan.stairwells for plan in plans)
    return plans


def check(plans, form, folder: Path):
    if form in NEEDS:
        pytest.importorskip(NEEDS[form])
    for plan in sound(plans) if form in SHAPES else plans:
        found = through(plan, form, folder / plan.id, FORMS[form])
        assert likeness(plan, found) >= 0.99, plan.id
        assert len(found.rooms) == len(plan.rooms), plan.id
        assert len(found.doors) == len(plan.doors), plan.id
        assert labels(found) == labels(plan), plan.id
        if form != "rmf":
            areas = [[thing.polygon.area for thing in each.stairwells] for each in (found, plan)]
            assert areas[0] == pytest.approx(areas[1], abs=0.01), plan.id
        if form not in {"sdf", "rmf"}:
            assert len(found.windows) == len(plan.windows), plan.id


def check_shape(plan, found, least):
    assert likeness(plan, found) >= least, plan.id
    assert len(found.rooms) == len(plan.rooms), plan.id
    inner = [door for door in plan.doors if door.kind != "entrance"]
    assert len(found.doors) == len(inner), plan.id
    widths, expected = (sorted(door.width for door in each) for each in (found.doors, inner))
    assert widths == pytest.approx(expected, abs=2.5 * FINE_M), plan.id


def sound(plans):
    """The plans of which the pipeline is sure: it mends others on their way back."""
    return [plan for plan in plans if plan.quality.score > SOUND]


def check_maps(plans, form, folder: Path):
    suffix, options = MAPS[form]
    for plan in sound(plans):
        (file,) = [each for each in export(plan, form, folder / plan.id, resolution=FINE_M) if each.suffix == suffix]
        check_shape(plan, max(plans_of(file, **options), key=lambda each: each.area), 0.99)


def test_each_format_that_is_written_is_read_here_or_never():
    assert sorted(FORMATS) == sorted({*FORMS, *MAPS, *UNREAD})


@pytest.mark.parametrize("form", sorted(MAPS))
def test_the_shape_of_a_plan_comes_back_from_maps(homes, form, tmp_path):
    check_maps(homes, form, tmp_path)


@pytest.mark.parametrize("form", sorted(FORMS))
def test_a_plan_without_rooms_comes_back(form, tmp_path):
    """A published plan is an outline; formats that draw its walls alone give the rooms that the build finds."""
    if form in NEEDS:
        pytest.importorskip(NEEDS[form])
    rooms = [(0, 0, 5, 4), (5.2, 0, 11, 4.4), (0, 4.2, 4, 8), (4.2, 4.6, 11, 9)]
    doors = [(4.9, 1, 5.3, 1.9), (1, 3.9, 1.9, 4.3), (8, 4.3, 8.9, 4.7)]
    space = shapely.union_all([shapely.box(*corners) for corners in rooms + doors])
    plan = FloorPlan("outline", (shapely.get_coordinates(space)[:-1] + 0.1).round(2), 4, {})
    found = through(plan, form, tmp_path, FORMS[form])
    assert likeness(plan, found) >= 0.99
    assert len(found.rooms) in {1, len(rooms)}


def plan_around_a_court(turn_deg: float, names: list[tuple[str, str]]) -> FloorPlan:
    """A room with a slanted wall, two more, and one round a court; doors, an opening, an entrance deeper than walls."""

    def placed(shape):
        return shapely.affinity.translate(shapely.affinity.rotate(shape, turn_deg, origin=(0, 0)), 6.1, 0.1)

    def ring(line):
        return shapely.get_coordinates(placed(line))[:-1].round(2).tolist()

    slanted = shapely.Polygon([(0, 0), (5, 0), (5, 4), (1.5, 4), (0, 2.5)])
    around = shapely.box(0, 4.2, 13, 12).difference(shapely.box(4, 6.2, 8, 10.2))
    shapes = [slanted, shapely.box(5.2, 0, 9, 4), shapely.box(9.2, 0, 13, 4), around]
    ways = [
        ("door", (5, 1, 5.2, 1.9), [(5.1, 1), (5.1, 1.9)], (0, 1)),
        ("opening", (9, 1, 9.2, 2.2), [(9.1, 1), (9.1, 2.2)], (1, 2)),
        ("door", (2.5, 4, 3.3, 4.2), [(2.5, 4.1), (3.3, 4.1)], (0, 3)),
        ("door", (10, 4, 10.9, 4.2), [(10, 4.1), (10.9, 4.1)], (2, 3)),
        ("entrance", (13, 8, 13.2, 9), [(13.1, 8), (13.1, 9)], (3, None)),
    ]
    inside = [shapely.box(*corners) for kind, corners, _, _ in ways if kind != "entrance"]
    space = shapely.union_all([*shapes, *inside])
    rooms = [
        Room(i, label, ring(each.exterior), [ring(line) for line in each.interiors], (word,) if word else ())
        for i, (each, (label, word)) in enumerate(zip(shapes, names, strict=True))
    ]
    doors = [
        Door(
            i,
            kind,
            shapely.get_coordinates(placed(shapely.LineString(segment))),
            shapely.LineString(segment).length,
            ring(shapely.box(*corners).exterior),
            joined,
        )
        for i, (kind, corners, segment, joined) in enumerate(ways)
    ]
    holes = [ring(line) for line in space.interiors]
    return FloorPlan("court", ring(space.exterior), len(rooms), {}, holes=holes, rooms=rooms, doors=doors)


TWO_ALIKE = [("Kitchen", "Küche 厨房"), ("Bedroom", "Schlafzimmer"), ("Bedroom", ""), ("Unlabelled", "")]


UNNAMED = [("Unlabelled", "")] * 4


@pytest.mark.parametrize(
    ("turn_deg", "names"),
    [
        pytest.param(20, TWO_ALIKE, id="named-20"),
        pytest.param(0, UNNAMED, id="unnamed", marks=pytest.mark.slow),
        pytest.param(0, TWO_ALIKE, id="named", marks=pytest.mark.slow),
        pytest.param(20, UNNAMED, id="unnamed-20", marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("form", sorted(FORMS))
def test_courts_slanted_walls_and_rooms_alike_come_back(form, turn_deg, names, tmp_path):
    if form in NEEDS:
        pytest.importorskip(NEEDS[form])
    plan = plan_around_a_court(turn_deg, names)
    found = through(plan, form, tmp_path, FORMS[form])
    assert likeness(plan, found) >= 0.99
    assert labels(found) == labels(plan)
    assert sorted(door.kind for door in found.doors) == sorted(door.kind for door in plan.doors)
    assert len(found.holes) == len(plan.holes)


@pytest.mark.parametrize("wide", [3, 6])
@pytest.mark.parametrize("form", SHAPES)
def test_an_opening_as_wide_as_its_room_comes_back(form, wide, tmp_path):
    def corners(*sides):
        return shapely.get_coordinates(shapely.box(*sides, ccw=False))[:-1].round(2)

    rooms = [Room(k, "Room", corners(x, 0.1, x + 4, 0.1 + wide), (), ("Room",)) for k, x in enumerate((0.1, 4.2))]
    middle = ((4.15, 0.1), (4.15, 0.1 + wide))
    doors = [
        Door(0, "opening", middle, float(wide), corners(4.1, 0.1, 4.2, 0.1 + wide), (0, 1)),
        Door(1, "entrance", ((0.05, 1.0), (0.05, 1.9)), 0.9, corners(0, 1.0, 0.1, 1.9), (0, None)),
    ]
    plan = FloorPlan("open", corners(0.1, 0.1, 8.2, 0.1 + wide), 2, {}, rooms=rooms, doors=doors)
    found = through(plan, form, tmp_path, FORMS[form])
    assert sorted((door.kind, round(door.width, 1)) for door in found.doors) == [("entrance", 0.9), ("opening", wide)]


@pytest.mark.parametrize("form", sorted(FORMS))
@pytest.mark.parametrize("kind", ["homes", "storeys"])
def test_a_plan_comes_back(request, kind, form, tmp_path):
    assert form in FORMATS
    check(request.getfixturevalue(kind), form, tmp_path)


@pytest.mark.parametrize("form", SHAPES)
def test_walls_that_lean_by_a_centimetre_come_back_as_thick_as_they_were(form, tmp_path):
    """Published outlines lean so. A world writes such a wall as many convex pieces, some of them a centimetre wide."""
    rooms = [[(0.01, 0), (5, 0.01), (5.01, 4), (0, 4.01)], [(5.12, 0.02), (8, 0), (8.01, 4), (5.11, 4)]]
    space = shapely.union_all([*map(shapely.Polygon, rooms), shapely.box(4.9, 1.5, 5.2, 2.4)])
    plan = FloorPlan("leaning", (shapely.get_coordinates(space)[:-1] + 0.1).round(2), 2, {})
    found = through(plan, form, tmp_path, FORMS[form])
    assert likeness(plan, found) >= 0.99
    assert len(found.rooms) == len(rooms)
