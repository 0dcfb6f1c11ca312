import pytest

from pipeline.sources.meshes.scene import Part
from pipeline.sources.roles import Role, role_of, role_of_part, room_words


def said(name: str) -> Role | None:
    named = role_of(name)
    return named and named.role


@pytest.mark.parametrize(
    "name",
    [
        "Cube.001",
        "Mesh_12",
        "Material.003",
        "outdoor",
        "indoor",
        "armatur",
        "Textur",
        "auto_3",
        "Ground floor",
        "Bed room",
    ],
)
def test_names_that_say_nothing(name):
    assert said(name) is None


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("floor lamp", Role.LEFT_OUT),
        ("wall cabinet", Role.FURNITURE),
        ("wall art", Role.LEFT_OUT),
        ("tabletop", Role.FURNITURE),
        ("doorbell", Role.LEFT_OUT),
        ("mesa de comedor", Role.FURNITURE),
        ("porte cuisine", Role.DOOR),
        ("Wall_right_brick", Role.WALL),
        ("Windows 10", Role.WALL),
    ],
)
def test_the_head_noun_decides(name, role):
    assert said(name) is role


@pytest.mark.parametrize(
    "name",
    [
        "SM_Door_01",
        "frontDoor",
        "IfcDoor/Door_31",
        "Haustür",
        "Zimmertuer_02",
        "porte",
        "puerta01",
        "porta",
        "voordeur",
        "slaapkamerdeur",
        "menkuang",
        "door_toilet",
        "glass_door",
        "Door_Glass",
        "door frame",
    ],
)
def test_doors_in_eight_languages(name):
    assert said(name) is Role.DOOR


@pytest.mark.parametrize("name", ["door_wall", "wallDoorway", "mur_porte", "Wall with door"])
def test_a_wall_with_a_door_is_the_wall(name):
    assert said(name) is Role.WALL


@pytest.mark.parametrize("name", ["cabinet door", "Schranktür", "fridge_door_L", "kastdeur"])
def test_a_cupboards_door_is_furniture(name):
    assert said(name) is Role.FURNITURE


@pytest.mark.parametrize(("name", "role"), [("IfcSpace/Space_4", Role.SPACE), ("IfcOpeningElement/O_1", Role.OPENING)])
def test_bodies_of_an_ifc_that_are_not_solid(name, role):
    assert said(name) is role


def test_a_part_is_called_by_its_own_name_before_its_group_and_material():
    assert role_of_part(Part(("Doors", "Wall_3"))).role is Role.WALL
    assert role_of_part(Part(("Doors", "Cube.003"))).role is Role.DOOR
    assert role_of_part(Part(("TV Console",), "", "Green Door")).role is Role.FURNITURE
    assert role_of_part(Part(("Cube.003",), "", "Green Door")).role is Role.DOOR
    assert role_of_part(Part(("Walls",), "", "door_wood")).role is Role.DOOR


def test_a_group_hands_down_no_floor_and_a_material_no_furniture():
    assert role_of_part(Part(("Floor_2", "Cube.003"))) is None
    assert role_of_part(Part(("Cube.003",), "", "Leather chair")) is None


def test_a_word_that_means_other_things_too_is_not_sure():
    assert not role_of("men_03").sure
    assert role_of("door_03").sure


@pytest.mark.parametrize(
    ("name", "words"), [("floor_Bedroom", ("Bedroom",)), ("floor_Other", ()), ("Küche_Boden", ("Kueche",))]
)
def test_a_floor_may_name_its_room(name, words):
    assert room_words(Part((name,))) == words
