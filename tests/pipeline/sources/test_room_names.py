import pytest

from houseexpo.plan.categories import LABELS
from pipeline.sources.roles import _TABLE, is_outside_the_count, labels_for


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
    assert is_outside_the_count([word]) is outside
