"""German, English, French and Spanish room names to the 25 labels of the data set.

R1  Case, accents, umlauts spelled out (ue, oe, ae), numbers, punctuation and camel case make no difference.
R2  A whole name that the table holds decides; else each of its parts does: parts are divided by / + & , and the words
    for "and". A part is read from left to right for the longest names of the table, so "Master Bedroom" is a Bedroom.
R3  A word that ends in a name of the table (German compounds: Elternschlafzimmer) is that.
R4  "Room" is kept only where nothing more exact was found. An unknown name has no label; its word stays in the plan.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Final

from houseexpo.plan.categories import LABELS, canonical

_TABLE: Final[dict[str, str]] = {
    "Bedroom": "schlafen, schlafzimmer, schlafraum, eltern, elternzimmer, bed, master, sleeping, chambre, "
    "chambre à coucher, chambre parentale, suite parentale, dormitorio, habitación, alcoba, recámara, cuarto de dormir",
    "Bathroom": "bad, badezimmer, bath, shower, shower room, dusche, duschbad, ensuite, en suite, wet room, "
    "salle de bain, salle de bains, salle d'eau, sdb, douche, baño, cuarto de baño, ducha, aseo principal",
    "Toilet": "wc, gäste wc, gästetoilette, toilette, toiletten, toilettes, klo, restroom, washroom, lavatory, loo, "
    "powder room, half bath, cloakroom wc, water closet, cabinet de toilette, aseo, aseos, servicio, retrete, inodoro",
    "Kitchen": "küche, kochen, kochnische, wohnküche, kitchenette, cuisine, coin cuisine, cocina, office de cuisine",
    "Room": "zimmer, raum, pièce, salle, cuarto, sala, multipurpose room, hobbyraum, hobby, spare room, space",
    "Living_Room": "wohnen, wohn, wohnzimmer, wohnraum, wohnbereich, stube, living, lounge, sitting room, family room, "
    "family, great room, drawing room, parlour, den, salon, séjour, salle de séjour, pièce de vie, pièce à vivre, "
    "salón, sala de estar, estar, living comedor",
    "Office": "büro, arbeiten, arbeitszimmer, arbeitsraum, homeoffice, home office, study, library, bibliothek, "
    "bureau, cabinet de travail, bibliothèque, oficina, despacho, estudio, biblioteca",
    "Dining_Room": "essen, esszimmer, essbereich, essplatz, speisezimmer, dining, dinette, breakfast room, "
    "breakfast nook, salle à manger, coin repas, comedor",
    "Garage": "carport, tiefgarage, stellplatz, parking, car port, abri voiture, garaje, cochera",
    "Hallway": "flur, gang, korridor, corridor, hall way, passage, circulation, landing, couloir, dégagement, palier, "
    "pasillo, corredor, distribuidor",
    "Hall": "diele, halle, großer flur, grand hall, salle des pas perdus, recibidor, rellano",
    "Child_Room": "kind, kinder, kinderzimmer, jugendzimmer, child, children, children room, childrens room, kids, "
    "kids room, nursery, playroom, play room, spielzimmer, chambre enfant, chambre d'enfant, chambre enfants, "
    "chambre bébé, salle de jeux, cuarto de niños, habitación infantil, dormitorio infantil, sala de juegos",
    "Gym": "fitness, fitnessraum, sportraum, exercise room, workout room, salle de sport, gimnasio",
    "Storage": "abstellraum, abstellkammer, abstell, lager, lagerraum, speisekammer, vorratsraum, vorrat, kammer, "
    "keller, kellerraum, speicher, hauswirtschaftsraum, hauswirtschaft, hwr, waschküche, waschraum, store, store room, "
    "storeroom, cupboard, pantry, larder, cellar, basement, utility, utility room, laundry, laundry room, box room, "
    "débarras, cellier, cave, rangement, réserve, buanderie, garde manger, trastero, despensa, almacén, bodega, "
    "lavadero, lavandería",
    "Balcony": "balkon, balcon, balcón",
    "Wardrobe": "garderobe, ankleide, ankleidezimmer, schrankraum, closet, walk in closet, wic, dressing, "
    "dressing room, cloakroom, cloaks, penderie, placard, vestidor, armario, ropero, guardarropa",
    "Guest_Room": "gast, gäste, gästezimmer, guest, guest bedroom, guests, chambre d'ami, chambre d'amis, "
    "cuarto de invitados, habitación de invitados, dormitorio de invitados",
    "Lobby": "empfang, empfangshalle, reception, vestíbulo principal, hall d'accueil, accueil",
    "Entryway": "eingang, eingangsbereich, eingangshalle, windfang, vorraum, vorzimmer, entrance, entrance hall, "
    "entry, entry hall, foyer, vestibule, vestibül, mudroom, porch, entrée, hall d'entrée, sas d'entrée, sas, entrada, "
    "vestíbulo, zaguán",
    "Terrace": "terrasse, dachterrasse, patio, deck, veranda, véranda, terraza, azotea, porche",
    "Loggia": "laubengang, galería cubierta",
    "Boiler_room": "heizung, heizraum, heizungsraum, technik, technikraum, haustechnik, hausanschlussraum, boiler, "
    "plant room, mechanical, mechanical room, technical room, chaufferie, local technique, cuarto de calderas, "
    "sala de calderas, cuarto técnico",
    "Aeration": "schacht, lüftung, lüftungsschacht, luftraum, lichtschacht, shaft, vent, ventilation, air shaft, duct, "
    "gaine, gaine technique, ventilación, patinillo",
    "Passenger_elevator": "aufzug, fahrstuhl, lift, elevator, ascenseur, ascensor",
    "Freight_elevator": "lastenaufzug, goods lift, service elevator, monte charge, montacargas",
}
_ROOFS: Final = "dach, dachraum, roof, toit, toiture, cubierta, tejado, techo"
_AND: Final = frozenset({"und", "and", "et", "y", "mit", "with", "avec", "con"})
_LONGEST_NAME: Final = 4
_SHORTEST_SUFFIX: Final = 6


def labels_for(words: Iterable[str]) -> tuple[str, ...]:
    """Return the labels of a room that its source calls so, in the order of its words; empty for unknown names."""
    found = dict.fromkeys(label for word in words for label in _labels(word))
    if len(found) > 1:
        found.pop("Room", None)  # R4
    return tuple(found)


def is_outside_the_count(words: Iterable[str]) -> bool:
    """Tell whether one of a space's names says that it is the room under a roof, which is no room of a storey."""
    return any(" ".join(_tokens(word)) in _roofs() for word in words)


def _labels(word: str) -> list[str]:
    label = canonical(word)
    if label:
        return [label]
    tokens = _tokens(word)
    whole = _names().get(" ".join(each for each in tokens if each != "/"))
    return [whole] if whole else list(_read(tokens))


def _read(tokens: list[str]) -> Iterator[str]:
    """R2, R3: yield labels from left to right."""
    at = 0
    while at < len(tokens):
        for length in range(min(_LONGEST_NAME, len(tokens) - at), 0, -1):
            label = _names().get(" ".join(tokens[at : at + length]))
            if label:
                yield label
                at += length - 1
                break
        else:
            label = _by_ending(tokens[at])
            if label:
                yield label
        at += 1


def _by_ending(token: str) -> str | None:
    endings = (token[start:] for start in range(1, len(token) - _SHORTEST_SUFFIX + 1))
    return next((_names()[ending] for ending in endings if ending in _names()), None)


def _tokens(word: str) -> list[str]:
    """R1: plain lower-case words; "/" stands between parts."""
    parted = re.sub(r"(?<=[a-zß-ÿ])(?=[A-Z])", " ", word)
    plain = unicodedata.normalize("NFKD", parted.replace("ß", "ss")).encode("ascii", "ignore").decode().lower()
    plain = re.sub(r"[/+&,;|]", " / ", plain)
    tokens = ["/" if token in _AND else token for token in re.findall(r"[a-z]+|/", plain)]
    return [re.sub(r"([aou])e", r"\1", token) for token in tokens]


@cache
def _names() -> dict[str, str]:
    """Return the table by normalised name; a label's own spelling is a name of it."""
    pairs = [(label.replace("_", " "), label) for label in LABELS]
    pairs += [(name, label) for label, names in _TABLE.items() for name in names.split(", ")]
    return {" ".join(_tokens(name)): label for name, label in pairs}


@cache
def _roofs() -> frozenset[str]:
    return frozenset(" ".join(_tokens(name)) for name in _ROOFS.split(", "))
