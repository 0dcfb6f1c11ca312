"""Levels from names: roles of parts, names of rooms."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from houseexpo.plan.room_labels import LABELS
from pipeline.sources import mesh_file
from pipeline.sources.meshes.scene import PartNames
from pipeline.sources.roles import (
    _TABLE,
    Role,
    is_attic_space,
    labels_for,
    names_door_handle,
    part_room_words,
    role_from_name,
    role_from_part,
)
from pipeline.values import Level
from tests.builders.meshes import L_FLOOR, box, slab, storey

WALLS = storey(0.0, 2.5)
LEAF = (3.0, 3.08, 4.8, 3.12)  # would close the gap of the inner wall
TABLE = (1.0, 1.0, 3.0, 2.0)


def write(path: Path, nodes: dict[str, list[trimesh.Trimesh]]) -> Path:
    """Write named nodes as GLB, which is y-up."""
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0))
    for name, parts in nodes.items():
        scene.add_geometry(
            trimesh.util.concatenate(parts), node_name=name, geom_name=f"geometry {len(scene.graph.nodes)}"
        )
    scene.apply_transform(turn)
    scene.export(path)
    return path


def only_level(path: Path) -> Level:
    (level,) = (level for item in mesh_file.find(str(path)) for level in mesh_file.read(item))
    return level


def area_of(level: Level) -> float:
    return float(trimesh.Trimesh(level.walls.vertices, level.walls.faces, process=False).area)


def test_leaves_and_furniture_are_things_of_their_own(tmp_path):
    nodes = {
        "Wall": WALLS,
        "Floor": slab(-0.2, 0.0),
        "Door_1": [box(LEAF, 0.0, 2.0)],
        "Dining Table": [box(TABLE, 0, 0.7)],
    }
    level = only_level(write(tmp_path / "house.glb", nodes))
    bare = only_level(write(tmp_path / "bare.glb", {"Wall": WALLS, "Floor": slab(-0.2, 0.0)}))
    assert [leaf.words for leaf in level.leaves] == [("Door_1",)]
    assert level.leaves[0].mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert [thing.words for thing in level.furniture] == [("Dining Table",)]
    assert area_of(level) == pytest.approx(area_of(bare))


def test_what_nobody_names_stays_with_the_walls(tmp_path):
    nodes = {"Cube.001": WALLS, "Cube.002": slab(-0.2, 0.0), "Cube.003": [box(LEAF, 0.0, 2.0)]}
    level = only_level(write(tmp_path / "house.glb", nodes))
    assert not level.leaves
    assert len(level.walls.faces) == 12 * (len(WALLS) + len(L_FLOOR) + 1)


@pytest.mark.parametrize(
    "name",
    ["Door_1", "Wall_2", "Floor_2", "Ceiling", "Window", "Table", "Terrain", "Sky", "Stairs", "Space", "Threshold"],
)
def test_a_name_without_a_face_says_nothing(tmp_path, name):
    nothing = trimesh.Trimesh(np.full((3, 3), 1e31), [[0, 1, 2]], process=False)
    nodes = {"Wall": WALLS, "Floor": slab(-0.2, 0.0), name: [nothing]}
    level = only_level(write(tmp_path / "house.glb", nodes))
    assert not level.leaves
    assert not level.furniture


def test_one_node_of_two_doors_is_two_leaves(tmp_path):
    doors = [box(LEAF, 0.0, 2.0), box((2.0, 0.05, 2.9, 0.1), 0.0, 2.0)]
    level = only_level(write(tmp_path / "house.glb", {"Wall": WALLS, "Floor": slab(-0.2, 0.0), "Doors": doors}))
    assert len(level.leaves) == 2


@pytest.mark.parametrize(("name", "kept"), [("Door Handle003", 1), ("doorknob", 1), ("Handle", 0), ("Door Lamp", 0)])
def test_the_handle_of_a_door_stays_where_no_door_has_a_name(tmp_path, name, kept):
    nodes = {
        "Wall": WALLS,
        "Floor": slab(-0.2, 0.0),
        "Box": [box(LEAF, 0.0, 2.0)],
        name: [box((4.6, 3.0, 4.64, 3.2), 1, 1.1)],
    }
    named = {("Door_1" if key == "Box" else key): parts for key, parts in nodes.items()}
    bare = 12 * (len(WALLS) + len(L_FLOOR))
    assert len(only_level(write(tmp_path / "house.glb", nodes)).walls.faces) == bare + 12 + 12 * kept
    assert len(only_level(write(tmp_path / "named.glb", named)).walls.faces) == bare


@pytest.mark.parametrize(
    "absurd",
    [
        [box((0.0, 6.0, 6.0, 6.2), 0.0, 2.5)],
        [box((3.0, 3.0, 3.3, 3.2), 0.0, 2.4), box((4.4, 3.0, 4.8, 3.2), 0.0, 2.4), box((3.0, 3.0, 4.8, 3.2), 2.4, 2.5)],
    ],
    ids=["six metres wide", "a wall with a hole"],
)
def test_a_name_that_the_shape_belies_is_not_believed(tmp_path, absurd):
    whole = [trimesh.boolean.union(absurd, engine="manifold")]
    level = only_level(write(tmp_path / "house.glb", {"Cube": WALLS, "Floor": slab(-0.2, 0.0), "Door": whole}))
    assert not level.leaves


def test_a_frame_with_its_leaf_open_is_a_door(tmp_path):
    frame = [
        box((3.0, 3.0, 3.06, 3.2), 0, 2.1),
        box((4.0, 3.0, 4.06, 3.2), 0, 2.1),
        box((3.0, 3.0, 4.06, 3.2), 2.05, 2.1),
    ]
    leaf = box((3.06, 3.2, 3.1, 4.1), 0.0, 2.05)
    nodes = {"Wall": WALLS, "Floor": slab(-0.2, 0.0), "Door": [trimesh.boolean.union(frame, engine="manifold"), leaf]}
    assert len(only_level(write(tmp_path / "house.glb", nodes)).leaves) == 1


def test_a_house_called_floor_is_a_house(tmp_path):
    level = only_level(
        write(tmp_path / "house.glb", {"Floor_1": [*WALLS, *slab(-0.2, 0.0)], "Plant": [box(TABLE, 0, 1)]})
    )
    assert len(level.walls.faces) == 12 * (len(WALLS) + len(L_FLOOR))


def test_a_house_called_table_is_a_house(tmp_path):
    level = only_level(write(tmp_path / "house.glb", {"table_scene": [*WALLS, *slab(-0.2, 0.0)]}))
    assert len(level.walls.faces) == 12 * (len(WALLS) + len(L_FLOOR))


def test_floors_name_rooms_and_give_the_floors_area(tmp_path):
    rooms = {
        "floor_Bedroom": [box((0.2, 0.2, 7.8, 2.8), -0.1, 0.0)],
        "Kitchen_floor": [box((0.2, 3.2, 4.8, 5.8), -0.1, 0.0)],
    }
    level = only_level(write(tmp_path / "house.glb", {"Wall": WALLS, **rooms}))
    assert {room.labels: round(room.polygon.area, 2) for room in level.rooms} == {
        ("Bedroom",): 19.76,
        ("Kitchen",): 11.96,
    }
    assert level.floor.area == pytest.approx(19.76 + 11.96)
    assert level.room_count is None


def threshold(
    low: float = -0.1, high: float = 0.0, *, plan: tuple[float, float, float, float] = LEAF
) -> dict[str, list[trimesh.Trimesh]]:
    x1, y1, x2, y2 = plan
    return {
        "Wall": WALLS,
        "Floor": slab(-0.2, -0.1),
        "door_threshold_1": [box((x1, y1 - 0.08, x2, y2 + 0.08), low, high)],
    }


def test_a_threshold_is_the_opening_over_it(tmp_path):
    (opening,) = only_level(write(tmp_path / "door.glb", threshold())).openings
    assert opening.polygon.bounds == pytest.approx((3.0, 3.0, 4.8, 3.2), abs=1e-6)
    assert opening.has_door
    nodes = threshold()
    nodes["opening_threshold"] = nodes.pop("door_threshold_1")
    (opening,) = only_level(write(tmp_path / "opening.glb", nodes)).openings
    assert not opening.has_door


@pytest.mark.parametrize(
    "nodes",
    [
        threshold(0.0, 1.0),
        threshold(plan=(0.5, 3.08, 2.0, 3.12)),
        threshold(plan=(0.5, 0.5, 5.0, 2.5)),
        threshold() | {"Box": [box(LEAF, 0.0, 2.0)]},
    ],
    ids=["an upright thing", "in a wall that goes on", "as large as a room", "something stands on it"],
)
def test_a_threshold_that_nobody_crosses_is_none(tmp_path, nodes):
    assert not only_level(write(tmp_path / "house.glb", nodes)).openings


def test_spaces_are_rooms_and_never_solid(tmp_path):
    spaces = {"IfcSpace/Bedroom": [box((0.2, 0.2, 7.8, 2.8), 0.0, 2.5)]}
    level = only_level(
        write(tmp_path / "house.glb", {"IfcWall/Wall": WALLS, "IfcSlab/Floor": slab(-0.2, 0.0), **spaces})
    )
    assert [(room.words, round(room.polygon.area, 2)) for room in level.rooms] == [(("Bedroom",), 19.76)]
    assert level.room_count == 1
    assert len(level.walls.faces) == 12 * (len(WALLS) + len(L_FLOOR))


def test_ground_beyond_the_house_is_left_out_and_a_ground_plate_is_its_floor(tmp_path):
    plate = only_level(write(tmp_path / "plate.glb", {"Wall": WALLS, "Ground": slab(-0.2, 0.0)}))
    assert plate.floor.area == pytest.approx(39.0, abs=0.01)
    wide = {"Wall": WALLS, "Ground": [box((-30, -30, 30, 30), -0.3, -0.2)], "Floor": slab(-0.2, 0.0)}
    assert only_level(write(tmp_path / "wide.glb", wide)).walls.vertices[:, 0].min() == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["Sky_dome", "BackDrop", "back_drop", "Himmel", "cielo", "Scene_background"])
def test_a_sky_around_the_house_is_left_out(tmp_path, name):
    dome = trimesh.creation.icosphere(subdivisions=2, radius=40.0)
    nodes = {"Cube": WALLS, "Floor": slab(-0.2, 0.0), name: [dome]}
    assert only_level(write(tmp_path / "house.glb", nodes)).walls.vertices[:, 0].max() == pytest.approx(8.0)


def test_what_a_game_collides_with_is_left_out(tmp_path):
    nodes = {"Cube": WALLS, "Floor": slab(-0.2, 0.0), "stairs_collider": [box((1.0, 1.0, 3.0, 2.0), 0.0, 2.5)]}
    assert len(only_level(write(tmp_path / "house.glb", nodes)).walls.faces) == 12 * (len(WALLS) + len(L_FLOOR))


def test_trees_are_left_out_however_many_leaves_they_have(tmp_path):
    rng = np.random.default_rng(0)
    leaves = rng.uniform((-30, 15, 5), (30, 40, 9), (9000, 3)).repeat(3, axis=0) + rng.normal(0.0, 0.8, (27000, 3))
    tree = trimesh.Trimesh(leaves, np.arange(27000).reshape(-1, 3), process=False)
    level = only_level(write(tmp_path / "house.glb", {"Wall": WALLS, "Floor": slab(-0.2, 0.0), "Tree": [tree]}))
    assert level.walls.vertices[:, 1].max() == pytest.approx(6.0)


def test_the_cube_that_an_editor_begins_with_is_dropped(tmp_path):
    nodes = {f"Wall_{i}": [wall] for i, wall in enumerate(WALLS)}
    cube = {"Cube": [box((-1, -1, 1, 1), -1, 1)]}
    level = only_level(write(tmp_path / "house.glb", {**nodes, "Floor": slab(-0.2, 0.0), **cube}))
    assert len(level.walls.faces) == 12 * (len(WALLS) + len(L_FLOOR))


def said(name: str) -> Role | None:
    named = role_from_name(name)
    return named and named.role


ROLES = [
    ("the word for ceiling holds that for sky", Role.CEILING, "cielo_raso; Cielo Raso 02; CieloRaso; cielorraso"),
    (
        "says nothing",
        None,
        "Cube.001; Mesh_12; Material.003; outdoor; indoor; armatur; Textur; auto_3; Ground floor; Bed room",
    ),
    ("the head noun decides", Role.LEFT_OUT, "floor lamp; wall art; doorbell"),
    ("the head noun decides", Role.FURNITURE, "wall cabinet; tabletop; mesa de comedor"),
    ("the head noun decides", Role.DOOR, "porte cuisine"),
    ("the head noun decides", Role.WALL, "Wall_right_brick; Windows 10"),
    (
        "doors in eight languages",
        Role.DOOR,
        "SM_Door_01; frontDoor; IfcDoor/Door_31; Haustür; Zimmertuer_02; porte; puerta01; porta; voordeur; menkuang",
    ),
    ("doors with a second word", Role.DOOR, "slaapkamerdeur; door_toilet; glass_door; Door_Glass; door frame"),
    (
        "doors of rooms that sound like furniture",
        Role.DOOR,
        "Schrankraumtuer; carportdeur; porte bureau; closet door; puerta del baño; porta camera da letto; door bed",
    ),
    (
        "other languages and scripts",
        Role.DOOR,
        "Дверь 90; внутренняя дверь; 室内門; スチールドア; 卧室门; 방문; Ovi 9x21; Dörr; dør; drzwi",
    ),
    ("other languages and scripts", Role.WALL, "창문; стена; okno"),
    ("other languages and scripts", Role.FLOOR, "пол"),
    ("other languages and scripts", Role.LEFT_OUT, "门把手"),
    ("other languages and scripts", Role.FURNITURE, "柜门"),
    ("a word within a Russian word", None, "полка; Полтава; стенд"),
    ("a wall with a door", Role.WALL, "door_wall; wallDoorway; mur_porte; Wall with door"),
    ("a cupboard's door", Role.FURNITURE, "cabinet door; Schranktür; fridge_door_L; kastdeur"),
    ("a threshold is no door", Role.THRESHOLD, "threshold; door_threshold_3; Türschwelle; seuil de porte"),
    ("bodies of an IFC that are not solid", Role.SPACE, "IfcSpace/Space_4"),
    ("bodies of an IFC that are not solid", Role.OPENING, "IfcOpeningElement/O_1"),
]
"""A rule, the role, and the names that have it by this rule."""


@pytest.mark.parametrize(
    ("name", "role"),
    [pytest.param(name, role, id=f"{rule}: {name}") for rule, role, names in ROLES for name in names.split("; ")],
)
def test_a_name_says_the_role_of_a_part(name, role):
    assert said(name) is role


DOORS_OF_FURNITURE = (
    "cupboard door; Door_Cabinet_02; Door of the fridge; Porte de placard; porte armoire; "
    "Portes_meuble_cuisine; Schranktür; Kleiderschranktür 2; Tür Einbauschrank; Backofentuer; Anta armadio; "
    "Porta dell'armadio; porta frigorifero; Puerta de armario; puerta_alacena; Porta de armário; Porta do "
    "guarda-roupa; kastdeur; Deur keukenkast; Dveře skříně; Drzwi szafy; drzwi od szafki; Vrata ormara; Vrata "
    "ormarića; Vrata omare; Dør til skap; kaapin ovi; szekrény ajtó; dolap kap\u0131s\u0131; Дверь шкафа; дверь "
    "холодильника; 冰箱门; 衣柜门"
)


@pytest.mark.parametrize("name", DOORS_OF_FURNITURE.split("; "))
def test_doors_of_furniture_are_parts_of_it_in_any_language(name):
    assert said(name) is Role.FURNITURE
    assert not names_door_handle(f"{name} handle")


def test_a_part_is_called_by_its_own_name_before_its_group_and_material():
    assert role_from_part(PartNames(("Doors", "Wall_3"))).role is Role.WALL
    assert role_from_part(PartNames(("Doors", "Cube.003"))).role is Role.DOOR
    assert role_from_part(PartNames(("TV Console",), "", "Green Door")).role is Role.FURNITURE
    assert role_from_part(PartNames(("Cube.003",), "", "Green Door")).role is Role.DOOR
    assert role_from_part(PartNames(("Walls",), "", "door_wood")).role is Role.DOOR
    assert role_from_part(PartNames(("doorway",), "Cube.012")).role is Role.DOOR
    assert role_from_part(PartNames(("Wall_Doorway",), "Cube.012")).role is Role.WALL


def test_a_group_hands_down_no_floor_and_a_material_no_furniture():
    assert role_from_part(PartNames(("Floor_2", "Cube.003"))) is None
    assert role_from_part(PartNames(("Cube.003",), "", "Leather chair")) is None


def test_a_word_that_means_other_things_too_is_not_sure():
    assert not role_from_name("men_03").sure
    assert role_from_name("door_03").sure


@pytest.mark.parametrize(
    ("name", "words"), [("floor_Bedroom", ("Bedroom",)), ("floor_Other", ()), ("Küche_Boden", ("Kueche",))]
)
def test_a_floor_may_name_its_room(name, words):
    assert part_room_words(PartNames((name,))) == words


@pytest.mark.parametrize(
    ("word", "labels"),
    [
        ("LivingRoom", ["Living_Room"]),
        ("living_room", ["Living_Room"]),
        ("Bedroom #1", ["Bedroom"]),
        ("Master Bedroom", ["Bedroom"]),
        ("Bathroom 1", ["Bathroom"]),
        ("Entrance hall", ["Entryway"]),
        ("1 - Living room", ["Living_Room"]),
        ("Room", ["Room"]),
        ("Flur", ["Hallway"]),
        ("Diele", ["Hall"]),
        ("Küche", ["Kitchen"]),
        ("Kueche", ["Kitchen"]),
        ("KÜCHE 02", ["Kitchen"]),
        ("Ku\u0308che", ["Kitchen"]),
        ("Buero", ["Office"]),
        ("Büro", ["Office"]),
        ("Wohnen", ["Living_Room"]),
        ("Wohn-/Esszimmer", ["Living_Room", "Dining_Room"]),
        ("Wohnen und Essen", ["Living_Room", "Dining_Room"]),
        ("Bad/WC", ["Bathroom", "Toilet"]),
        ("Schlafzimmer 2", ["Bedroom"]),
        ("Elternschlafzimmer", ["Bedroom"]),
        ("Gäste-WC", ["Toilet"]),
        ("Abstellraum", ["Storage"]),
        ("Heizungsraum", ["Boiler_room"]),
        ("Großer Flur", ["Hall"]),
        ("Salle de bain", ["Bathroom"]),
        ("Chambre 3", ["Bedroom"]),
        ("Chambre d'enfant", ["Child_Room"]),
        ("Séjour", ["Living_Room"]),
        ("Séjour et cuisine", ["Living_Room", "Kitchen"]),
        ("Dégagement", ["Hallway"]),
        ("Pièce", ["Room"]),
        ("Cocina", ["Kitchen"]),
        ("Baño 2", ["Bathroom"]),
        ("Dormitorio principal", ["Bedroom"]),
        ("Salón-comedor", ["Living_Room", "Dining_Room"]),
        ("Pasillo", ["Hallway"]),
        ("Ascensor", ["Passenger_elevator"]),
        ("Monte-charge", ["Freight_elevator"]),
        ("Kitchen & Dining", ["Kitchen", "Dining_Room"]),
        ("Walk-in closet", ["Wardrobe"]),
        ("Garage", ["Garage"]),
        ("SOGGIORNO", ["Living_Room"]),
        ("Bagno 2", ["Bathroom"]),
        ("Cozinha", ["Kitchen"]),
        ("Slaapkamer 1", ["Bedroom"]),
        ("Køkken", ["Kitchen"]),
        ("Кухня", ["Kitchen"]),
        ("Санузел 3", ["Bathroom"]),
        ("客厅", ["Living_Room"]),
        ("主卧室", ["Bedroom"]),
        ("주방", ["Kitchen"]),
        ("トイレ", ["Toilet"]),
    ],
)
def test_known_names(word, labels):
    assert labels_for([word]) == tuple(labels)


@pytest.mark.parametrize("word", ["A102", "7", "", "Galerie", "Stair", "Zone X", "日本", "---"])
def test_an_unknown_name_has_no_label(word):
    assert labels_for([word]) == ()


def test_several_words_give_their_labels_once_and_the_exact_ones_first():
    assert labels_for(["Kitchen", "Küche", "A103"]) == ("Kitchen",)
    assert labels_for(["Room", "Office"]) == ("Office",)
    assert labels_for([]) == ()


def test_the_table_knows_only_published_labels_and_each_name_once():
    names = [name for names in _TABLE.values() for name in names.split(", ")]
    assert set(_TABLE) == set(LABELS)
    assert len(names) == len(set(names))
    assert len(names) > 150
    for label, listed in _TABLE.items():
        for name in listed.split(", "):
            assert labels_for([name]) == (label,), name


@pytest.mark.parametrize(
    ("word", "outside"), [("Roof", True), ("4 - Roof", True), ("Dach", True), ("Dachterrasse", False)]
)
def test_the_room_under_the_roof_is_not_counted(word, outside):
    assert is_attic_space([word]) is outside
