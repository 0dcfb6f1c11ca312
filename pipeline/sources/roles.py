"""Interpret the names in a file: the role of a part (wall, door, furniture, ...), and the room that is meant.

R1  The head noun decides: the last known word of a Germanic name (a floor lamp is a lamp), the first of a Romance one
    (a mesa de centro is a table). Words are compared whole: outdoor is no door.
R2  A name that holds both a wall and a door is the wall with the hole; glass and windows give way to any other word; a
    door of a cupboard is furniture, whichever word comes first, a door of a toilet a door.
R3  "Ground floor" names a storey, "bed room" a room; neither says anything of the thing.
R4  A part's own name comes first, then its mesh's, then those of the groups around it, then its material's. A group
    hands down no floor (it may be a storey), and no wall where the material knows better; a material that says door
    is heard inside what is called wall, and one that says anything but door, wall, floor or ceiling is not heard.
R5  A room's name beside the word for floor names the room.
R6  What is called threshold is the floor in a doorway, whatever else its name holds.

The tables of words are in English, German, French, Spanish, Italian, Portuguese, Dutch and pinyin. Words are plain
lower-case ASCII: umlauts are spelled out, other accents dropped. Plurals in -s, -es, -n and -en need no entry. What
parts and finishes a house has is also known in Nordic and Slavic languages, Turkish, Chinese, Japanese and Korean;
words in other scripts are turned into English first.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from typing import Final

from houseexpo.plan.room_labels import LABELS, canonical
from pipeline.sources.meshes.scene import PartNames


class Role(StrEnum):
    """What a name says a thing is."""

    WALL = "wall"  # wall, column, window, glass: what stands
    DOOR = "door"  # leaves and their frames
    FLOOR = "floor"
    CEILING = "ceiling"  # and roof
    FURNITURE = "furniture"
    SPACE = "space"  # the body of a room's air
    OPENING = "opening"  # the body that was taken out of a wall
    THRESHOLD = "threshold"  # the floor in a doorway
    TERRAIN = "terrain"  # ground, streets
    LEFT_OUT = "left_out"  # lamps, people, cars, trees, pictures, handles, the sky, what a game collides with


def _set(text: str) -> frozenset[str]:
    return frozenset(text.split())


GERMANIC: Final[Mapping[Role, frozenset[str]]] = {
    Role.WALL: _set("""
        wall column pillar pilaster window glazing glass mullion facade partition lintel parapet railing
        railings balustrade banister fence brickwork drywall bulkhead curtainwall wand waende mauer mauerwerk
        fenster fensterrahmen saeule pfeiler stuetze verglasung sturz gelaender bruestung trennwand
        zwischenwand muur raam kozijn kolom zuil pilaar leuning chimney kamin schornstein
    """),
    Role.DOOR: _set("""
        door doors doorway doorleaf doorframe doorpanel frontdoor backdoor maindoor sidedoor slidingdoor garagedoor
        roomdoor entrydoor glassdoor innerdoor tuer tueren tuerblatt tuerrahmen tuerfluegel zarge tuerzarge
        haustuer deur deuren voordeur achterdeur binnendeur deurblad deurkozijn
    """),
    Role.FLOOR: _set("""
        floor floors flooring floorplate parquet slab tiles rug carpet mat doormat fussboden boden bodenplatte
        estrich teppich vloer parket laminate tapijt
    """),
    Role.CEILING: _set("""
        ceiling ceil roof rooftop roofing soffit rafter beam truss decke zimmerdecke dach dachstuhl balken
        plafond plafonds dak gutter fascia
    """),
    Role.FURNITURE: _set("""
        furniture table desk chair sofa couch bed cabinet cupboard wardrobe shelf shelves shelving bookshelf
        bookcase dresser nightstand bench stool armchair seat ottoman counter countertop worktop tabletop
        tablecloth island sideboard sink basin washbasin toilet wc bathtub tub shower fridge refrigerator
        freezer stove oven cooker hob dishwasher microwave washer dryer tv television monitor computer laptop
        screen keyboard printer piano console rack drawer drawers locker crib cot mattress pillow cushion
        headboard vanity recliner chaise bookshelves barstool radiator fireplace aquarium appliance whiteboard
        blackboard moebel tisch schreibtisch stuhl bett schrank kleiderschrank schrankwand wohnwand regal
        kommode hocker sessel waschbecken waschtisch badewanne dusche duschwand duschkabine kuehlschrank herd
        ofen backofen spuele spuelmaschine waschmaschine fernseher toilette klo leinwand heizkoerper matratze
        kissen arbeitsplatte kuechenzeile meubel tafel stoel kast bureau koelkast fornuis wastafel ligbad
        boekenkast kledingkast nachtkastje kruk
    """),
    Role.SPACE: _set("""
        ifcspace
    """),
    Role.OPENING: _set("""
        ifcopening
    """),
    Role.THRESHOLD: _set("""
        threshold doorsill tuerschwelle schwelle drempel
    """),
    Role.TERRAIN: _set("""
        terrain ground landscape road street pavement sidewalk grass lawn asphalt driveway gelaende wiese
        strasse rasen terrein straat gras path pathway
    """),
    Role.LEFT_OUT: _set("""
        lamp lamps light lights lighting chandelier lantern bulb spotlight sconce downlight candle person
        people human humans man woman girl boy character avatar mannequin car cars vehicle truck bus van
        bicycle bike motorcycle tree trees plant plants bush hedge flower flowers flowerpot vase foliage
        camera sky skybox skydome sun cloud clouds picture painting poster art artwork photo curtain curtains
        blind blinds drape drapes towel handle knob doorknob doorhandle doorbell hinge clock mirror book books
        bottle cup bowl toy teddy socket switch outlet annotation text label icon dimension logo baseboard
        skirting cornice moulding molding tablecloth bird cat dog bin trashcan basket toothbrush lampe leuchte
        licht mensch fahrzeug baum pflanze blume vorhang gardine jalousie bild tischdecke bettdecke griff
        skysphere backdrop background himmel blocker collider collision hitbox navmesh trigger
        tuergriff klinke spiegel uhr buch steckdose schalter fussleiste mens gordijn schilderij
    """),
}
"""Languages whose head noun comes last: a floor lamp is a lamp."""

ROMANCE: Final[Mapping[Role, frozenset[str]]] = {
    Role.WALL: _set("""
        mur murs muro muri muros parete pareti pared paredes parede colonne colonna columna coluna pilier
        pilastro pilar fenetre fenetres finestra finestre ventana ventanas janela janelas vitre vitrage vetro
        vidrio vidro cloison tramezzo tabique poteau qiang qiangti qiangbi neiqiang waiqiang geqiang chuanghu
        boli zhuzi lizhu langan muqiang
    """),
    Role.DOOR: _set("""
        porte portes porta puerta puertas portas battente dormant menkuang menban fangmen damen mumen boliment
        tuilamen neimen ruhumen rumen chufangmen woshimen men
    """),
    Role.FLOOR: _set("""
        plancher pavimento pavimenti suelo piso soalho diban dimian louban dizhuan tapis tappeto alfombra
        tapete ditan
    """),
    Role.CEILING: _set("""
        plafond toit toiture soffitto tetto techo tejado teto telhado cubierta copertura poutre trave viga
        cieloraso cielorraso tianhuaban tianhua wuding diaoding wumian
    """),
    Role.FURNITURE: _set("""
        meuble meubles mobilier table chaise canape armoire placard etagere bureau fauteuil tabouret lavabo
        evier baignoire douche frigo refrigerateur mobili mobilia tavolo tavola sedia divano letto armadio
        scaffale scrivania poltrona sgabello lavandino vasca doccia frigorifero forno libreria comodino mueble
        muebles mesa silla sofa cama armario estante escritorio sillon taburete lavamanos fregadero banera
        ducha nevera horno inodoro movel moveis cadeira guardaroupa prateleira escrivaninha banheira geladeira
        fogao sanitario zhuozi canzhuo chaji yizi shafa dachuang chuangtou guizi yigui shugui shujia dianshi
        bingxiang matong xishoupen yugang zaotai chugui jiaju shuzhuo
    """),
    Role.THRESHOLD: _set("""
        seuil umbral soglia soleira
    """),
    Role.TERRAIN: _set("""
        terreno terrain prato cesped grama dixing caodi
    """),
    Role.LEFT_OUT: _set("""
        lampada lampara luminaria luminaire lustre lampadario voiture macchina coche carro arbre albero arbol
        arvore plante pianta planta rideau tenda cortina tableau quadro cuadro poignee maniglia manija
        macaneta miroir specchio espejo espelho personne persona pessoa ciel cielo ceu deng dengju diaodeng zhiwu huapen
        chuanglian guahua shexiangji
    """),
}
"""Languages whose head noun comes first: a mesa de centro is a table; pinyin is written without spaces."""

OTHERS: Final[Mapping[Role, frozenset[str]]] = {
    Role.WALL: _set("""
        vegg vaegg vaeg seinae ikkuna vindu vindue foenster sciana okno okna stena zed duvar pencere prozor
        perete fereastra ablak
    """),
    Role.DOOR: _set("""
        doerr doerrar doer doere ovi ovet drzwi dvere dver dveri kapi kapisi vrata ajto ajtaja
    """),
    Role.FLOOR: _set("""
        gulv golv lattia podloga podlaha zemin
    """),
    Role.CEILING: _set("""
        katto sufit strop tavan himling
    """),
}
"""Words for the parts of a house in other languages, whose names are mostly one word."""

SCRIPTS: Final[Mapping[str, str]] = {
    "door": "дверь двери двері ドア 扉 門 门 문",
    "window": "окно окна вікно 창문 窓 窗",
    "wall": "стена стены стіна перегородка 壁 墙 牆 벽",
    "column": "колонна колона 柱 기둥",
    "floor": "пол підлога 地板 床板 바닥",
    "ceiling": "потолок стеля 天花板 天井 천장",
    "roof": "крыша дах 屋顶 屋頂 屋根 지붕",
    "table": "стол стіл テーブル 桌",
    "chair": "стул стілець 椅子 椅 의자",
    "bed": "кровать ліжко ベッド 침대",
    "sofa": "диван ソファ 沙发 沙發 소파",
    "cabinet": "шкаф шкафа шкафу шкафы шкафов шкафчик шкафчика шафа шафи шафка 柜 櫃 棚 가구 옷장 食器棚",
    "fridge": "холодильник холодильника 冰箱 冷蔵庫 냉장고",
    "oven": "духовка духовки 烤箱 オーブン 오븐",
    "washer": "洗衣机 洗衣機 洗濯機 세탁기",
    "drawer": "комод комода 抽屉 抽屜 引き出し 서랍",
    "handle": "ручка 把手 取っ手 ノブ 손잡이",
}
"""Words in other scripts, by what they mean in English; those of more than one letter are looked for first."""

COMPOUNDS: Final[Mapping[str, Role]] = {
    "tuer": Role.DOOR,
    "tueren": Role.DOOR,
    "deur": Role.DOOR,
    "deuren": Role.DOOR,
    "wand": Role.WALL,
    "waende": Role.WALL,
    "mauer": Role.WALL,
    "fenster": Role.WALL,
    "saeule": Role.WALL,
    "muur": Role.WALL,
    "raam": Role.WALL,
    "boden": Role.FLOOR,
    "vloer": Role.FLOOR,
    "decke": Role.CEILING,
    "dach": Role.CEILING,
    "schrank": Role.FURNITURE,
    "tisch": Role.FURNITURE,
    "stuhl": Role.FURNITURE,
    "regal": Role.FURNITURE,
    "bett": Role.FURNITURE,
    "kast": Role.FURNITURE,
    "tafel": Role.FURNITURE,
    "stoel": Role.FURNITURE,
    "lampe": Role.LEFT_OUT,
    "leuchte": Role.LEFT_OUT,
    "teppich": Role.FLOOR,
}
"""Endings of German and Dutch compounds: a Zimmertuer is a Tuer."""

WALL_MATERIALS: Final = _set("""
    boli fenster glas glass glazing verglasung vetro vidrio vidro vitrage vitre window
""")
"""Words of walls that give way to any other: a glass door is a door."""

ROOMS: Final = _set("""
    bath bathtub bed dusche inodoro sanitario shower toilet toilette toilettes wc
""")
"""Furniture that also names a room: a door_toilet is a door."""

AMBIGUOUS: Final = _set("""
    damen men porta portes rumen
""")
"""Words for doors that mean other things too: a shape must bear them out."""

FURNITURE_DOORS: Final = _set("""
    armoire bookcase cabinet car cupboard dishwasher drawer dresser dryer fireplace freezer fridge furniture locker
    microwave oven refrigerator shelf shelves shower sideboard stove vanity wardrobe washer
    schrank schraenke schrankwand regal vitrine kommode backofen ofen geschirrspueler spuelmaschine waschmaschine
    trockner mikrowelle dusch kaminofen moebel
    kast kasten kastje koelkast vriezer vaatwasser wasmachine meubel
    placard meuble buffet etagere frigo congelateur
    armadio armadi armadietto pensile credenza vetrina mobili mobiletto scaffale frigorifero forno lavastoviglie
    lavatrice asciugatrice cassetto
    armario alacena ropero mueble muebles vitrina aparador nevera refrigerador frigorifico heladera horno
    lavavajillas lavaplatos lavadora secadora estanteria cajon casillero
    roupeiro roupa movel moveis gaveta geladeira estante comoda prateleira
    guizi yigui shugui chugui bingxiang
    skap skapet skab skabet garderobeskap kaappi kaapin vaatekaappi vaatekaapin jaakaapin
    szafa szafy szafka szafki szafek szafie lodowka lodowki piekarnik piekarnika zmywarka zmywarki komoda komody kredens
    kredensu skrin skrine skrini skrinka skrinky skrina lednice lednicka chladnicka chladnicky trouba trouby mycka mycky
    ormar ormara ormari ormaric ormarica ormarici plakar plakara omara omare omari omarica frizider frizidera hladnjak
    hladnjaka hladilnik hladilnika pecnica pecnice
    szekreny szekrenyek konyhaszekreny huto hutoszekreny dulap dulapului dolap dolabi gardirop gardirobu buzdolabi
""")
"""Furniture that has doors, as a name holds it beside the word for a door: these doors are parts of it (R2)."""

CASES: Final = _set("""
    schrank schraenke kast skap skab kaappi kaapin szekreny
""")
"""Endings of compounds that are such furniture: a Kleiderschrank is a Schrank."""

STOREYS: Final = _set("""
    1st 2nd 3rd 4th first fourth ground level lower nd plan rd second st th third top upper
""")
"""Before "floor", these name a storey, not a surface."""


CYRILLIC: Final = re.compile(r"[\u0400-\u04ff]")
_SPELLED: Final = {
    "ä": "ae",
    "ö": "oe",
    "ü": "ue",
    "ß": "ss",
    "Ä": "Ae",
    "Ö": "Oe",
    "Ü": "Ue",
    "æ": "ae",
    "ø": "oe",
    "Æ": "Ae",
    "Ø": "Oe",
    "ł": "l",
    "Ł": "L",
    "\u0131": "i",
}


@cache
def _english() -> Mapping[str, str]:
    """Return what each word in another script means in English."""
    return {word: english for english, words in SCRIPTS.items() for word in words.split()}


@cache
def _other_scripts() -> re.Pattern[str]:
    """Return a pattern of the words in other scripts; only Cyrillic words are parted by spaces."""
    words = sorted(_english(), key=lambda word: (-len(word), word))
    whole = [rf"(?<!\w){word}(?!\w)" if CYRILLIC.match(word) else word for word in words]
    return re.compile("|".join(whole), re.IGNORECASE)


def split_words(name: str) -> list[str]:
    """Plain words of a name: camel case parted, digits dropped, umlauts spelled out, other accents dropped."""
    parted = re.sub(r"(?<=[a-z\xdf-\xff])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    for letter, spelled in _SPELLED.items():
        parted = parted.replace(letter, spelled)
    if not parted.isascii():
        parted = _other_scripts().sub(lambda found: f" {_english()[found[0].lower()]} ", parted)
    plain = unicodedata.normalize("NFKD", parted).encode("ascii", "ignore").decode().lower()
    words = " ".join(re.findall(r"[a-z]+", plain))
    return re.sub(
        r"\b(ifc (?=space|opening)|back (?=drop)|cielo (?=raso\b))", lambda found: found[0].strip(), words
    ).split()


def names_window(name: str) -> bool:
    """Return whether a name of something that stands holds the word for a window or its glass."""
    return not WALL_MATERIALS.isdisjoint(split_words(name))


def word_role(word: str) -> Role | None:
    """Return what a Germanic or any other listed word means by itself, or None if it is not known."""
    return _germanic().get(word) or _romance().get(word) or _others().get(word)


def is_romance_word(word: str) -> bool:
    """Tell whether a word is known, and only in a language whose head noun comes first."""
    return word in _romance() and word not in _germanic()


@cache
def _germanic() -> Mapping[str, Role]:
    return _table(GERMANIC)


@cache
def _romance() -> Mapping[str, Role]:
    return _table(ROMANCE)


@cache
def _others() -> Mapping[str, Role]:
    return {word: role for role, group in OTHERS.items() for word in sorted(group)}


def _table(words: Mapping[Role, frozenset[str]]) -> Mapping[str, Role]:
    exact = {word: role for role, group in words.items() for word in sorted(group)}
    plural = {f"{word}{end}": role for word, role in exact.items() for end in ("s", "es", "n", "en") if len(word) > 2}
    return {**plural, **exact}


HANDLES: Final = _set("handle handles knob knobs griff griffe klinke klinken")
HANDLES_OF_DOORS: Final = _set("doorknob doorknobs doorhandle doorhandles tuergriff tuergriffe tuerklinke tuerklinken")
SHORTEST_REST = 3  # letters before the ending of a compound
SAID_BY_MATERIALS = frozenset({Role.DOOR, Role.WALL, Role.FLOOR, Role.CEILING})
HANDED_DOWN = frozenset({Role.DOOR, Role.FURNITURE, Role.SPACE, Role.OPENING, Role.LEFT_OUT})


@dataclass(frozen=True)
class NamedRole:
    """A role and the name that gave it; ``sure`` is False where the word means other things too."""

    role: Role
    words: str
    sure: bool = True


def role_from_name(name: str) -> NamedRole | None:
    """Return what one name says, or None if it says nothing."""
    words = _without_places(split_words(name))
    known = [(word, role) for word in words if (role := _meaning(word))]
    if not known:
        return None
    roles = {role for _, role in known}
    for role in (Role.SPACE, Role.OPENING, Role.THRESHOLD):
        if role in roles:
            return NamedRole(role, name)
    solid = [pair for pair in known if pair[0] not in WALL_MATERIALS] or known  # R2
    if any(role is Role.DOOR for _, role in solid):
        if any(role is Role.WALL for _, role in solid):
            return NamedRole(Role.WALL, name)
        if any(map(_has_doors, words)):
            return NamedRole(Role.FURNITURE, name)
        solid = [pair for pair in solid if pair[0] not in ROOMS]
    word, role = solid[0] if is_romance_word(solid[0][0]) else solid[-1]  # R1
    return NamedRole(role, name, word not in AMBIGUOUS)


def names_furniture_with_doors(name: str) -> bool:
    """Return whether a name holds the word for a piece of furniture that has doors: a door of this name is its part."""
    return any(map(_has_doors, split_words(name)))


def names_door_handle(name: str) -> bool:
    """Return whether a name is of the handle or the knob of a door of a room."""
    words = split_words(name)
    if any(map(_has_doors, words)):
        return False
    return any(word in HANDLES_OF_DOORS for word in words) or (
        any(word in HANDLES for word in words) and any(_meaning(word) is Role.DOOR for word in words)
    )


def role_from_part(part: PartNames) -> NamedRole | None:
    """Return what a part's names say together."""
    own = _first([*part.groups[-1:], part.mesh])
    material = role_from_name(part.material)
    if material and material.role not in SAID_BY_MATERIALS:
        material = None
    if own and own.role is Role.WALL and material and material.role is Role.DOOR:
        return NamedRole(Role.DOOR, part.material, sure=False)
    if own:
        return own
    around = [named for name in reversed(part.groups[:-1]) if (named := role_from_name(name))]
    handed = next((named for named in around if named.role in HANDED_DOWN), None)
    return handed or material or next((named for named in around if named.role is not Role.FLOOR), None)


def part_room_words(part: PartNames) -> tuple[str, ...]:
    """Return the source's own words for the room of a floor or a space; empty where it has none."""
    for name in (*part.groups[-1:], part.mesh):
        rest = [word for word in split_words(name) if _meaning(word) not in {Role.FLOOR, Role.SPACE}]
        words = " ".join(word for word in rest if word not in {"space", "ifcspace", "mesh", "other", "transition"})
        if words and labels_for([words]):
            return (words.title(),)
    return ()


def _first(names: Iterable[str]) -> NamedRole | None:
    return next((named for name in names if (named := role_from_name(name))), None)


def _meaning(word: str) -> Role | None:
    role = word_role(word)
    if role is None:
        for ending, compound in COMPOUNDS.items():
            if word.endswith(ending) and len(word) >= len(ending) + SHORTEST_REST:
                first = word.removesuffix(ending)
                inside = compound is Role.DOOR and (_has_doors(first) or _has_doors(first.removesuffix("s")))
                return Role.FURNITURE if inside else compound
    return role


def _has_doors(word: str) -> bool:
    """Tell whether a word is for furniture that has doors."""
    plain = {word, *(word.removesuffix(end) for end in ("s", "es", "n", "en") if len(word) > len(end) + SHORTEST_REST)}
    if not plain.isdisjoint(FURNITURE_DOORS):
        return True
    return any(each.endswith(case) and len(each) >= len(case) + SHORTEST_REST for each in plain for case in CASES)


def _without_places(words: list[str]) -> list[str]:
    """Drop the names of storeys and rooms."""
    kept = list(words)
    for i in range(len(words) - 1):
        storey = words[i] in STOREYS and words[i + 1] in {"floor", "floors"}
        if storey or words[i + 1] in {"room", "zimmer", "kamer"}:
            kept[i] = kept[i + 1] = ""
    return kept


# Room names of some languages to the 25 labels of the data set.
#
# R1  Case, accents, umlauts spelled out (ue, oe, ae), numbers, punctuation and camel case make no difference.
# R2  A whole name that the table holds decides; else each of its parts does: parts are divided by / + & , and the words
#     for "and". A part is read from left to right for the longest names of the table, so "Master Bedroom" is a Bedroom.
# R3  A word that ends in a name of the table (German compounds: Elternschlafzimmer) is that.
# R4  "Room" is kept only where nothing more exact was found. An unknown name has no label; its word stays in the plan.


_TABLE: Final[dict[str, str]] = {
    "Bedroom": "schlafen, schlafzimmer, schlafraum, eltern, elternzimmer, bed, master, sleeping, chambre, "
    "chambre à coucher, chambre parentale, suite parentale, dormitorio, habitación, alcoba, recámara, "
    "cuarto de dormir, camera da letto, camera matrimoniale, camera singola, dormitório, quarto, slaapkamer, "
    "soveværelse, soverom, sovrum, спальня, 卧室, 主卧, 主卧室, 次卧, 次卧室, 寝室, 침실",
    "Bathroom": "bad, badezimmer, bath, shower, shower room, dusche, duschbad, ensuite, en suite, wet room, "
    "salle de bain, salle de bains, salle d'eau, sdb, douche, baño, cuarto de baño, ducha, aseo principal, "
    "bagno, banheiro, casa de banho, badkamer, badeværelse, badrum, ванная, ванная комната, "
    "санузел, 浴室, 卫浴, 욕실",
    "Toilet": "wc, gäste wc, gästetoilette, toilette, toiletten, toilettes, klo, restroom, washroom, lavatory, loo, "
    "powder room, half bath, cloakroom wc, water closet, cabinet de toilette, aseo, aseos, servicio, retrete, inodoro, "
    "туалет, уборная, 卫生间, 洗手间, 厕所, トイレ, 화장실",
    "Kitchen": "küche, kochen, kochnische, wohnküche, kitchenette, cuisine, coin cuisine, cocina, office de cuisine, "
    "cucina, angolo cottura, cozinha, keuken, bijkeuken, køkken, kjøkken, kök, кухня, 厨房, キッチン, 주방",
    "Room": "zimmer, raum, pièce, salle, cuarto, sala, multipurpose room, hobbyraum, hobby, spare room, space",
    "Living_Room": "wohnen, wohn, wohnzimmer, wohnraum, wohnbereich, stube, living, lounge, sitting room, family room, "
    "family, great room, drawing room, parlour, den, salon, séjour, salle de séjour, pièce de vie, pièce à vivre, "
    "salón, sala de estar, estar, living comedor, "
    "soggiorno, salotto, zona giorno, woonkamer, vardagsrum, opholdsstue, гостиная, 客厅, 起居室, リビング, 거실",
    "Office": "büro, arbeiten, arbeitszimmer, arbeitsraum, homeoffice, home office, study, library, bibliothek, "
    "bureau, cabinet de travail, bibliothèque, oficina, despacho, estudio, biblioteca, "
    "ufficio, escritório, kantoor, kontor, кабинет, офис, 书房, 办公室, 사무실",
    "Dining_Room": "essen, esszimmer, essbereich, essplatz, speisezimmer, dining, dinette, breakfast room, "
    "breakfast nook, salle à manger, coin repas, comedor, "
    "sala da pranzo, pranzo, sala de jantar, eetkamer, spisestue, столовая, 餐厅, ダイニング",
    "Garage": "carport, tiefgarage, stellplatz, parking, car port, abri voiture, garaje, cochera, "
    "autorimessa, garagem, гараж, 车库",
    "Hallway": "flur, gang, korridor, corridor, hall way, passage, circulation, landing, couloir, dégagement, palier, "
    "pasillo, corredor, distribuidor, "
    "corridoio, disimpegno, overloop, коридор, 走廊, 过道, 走道, 廊下, 복도",
    "Hall": "diele, halle, großer flur, grand hall, salle des pas perdus, recibidor, rellano",
    "Child_Room": "kind, kinder, kinderzimmer, jugendzimmer, child, children, children room, childrens room, kids, "
    "kids room, nursery, playroom, play room, spielzimmer, chambre enfant, chambre d'enfant, chambre enfants, "
    "chambre bébé, salle de jeux, cuarto de niños, habitación infantil, dormitorio infantil, sala de juegos",
    "Gym": "fitness, fitnessraum, sportraum, exercise room, workout room, salle de sport, gimnasio",
    "Storage": "abstellraum, abstellkammer, abstell, lager, lagerraum, speisekammer, vorratsraum, vorrat, kammer, "
    "keller, kellerraum, speicher, hauswirtschaftsraum, hauswirtschaft, hwr, waschküche, waschraum, store, store room, "
    "storeroom, cupboard, pantry, larder, cellar, basement, utility, utility room, laundry, laundry room, box room, "
    "débarras, cellier, cave, rangement, réserve, buanderie, garde manger, trastero, despensa, almacén, bodega, "
    "lavadero, lavandería, "
    "ripostiglio, cantina, lavanderia, área de serviço, lavandaria, berging, кладовая, 储藏室, 储物间, 仓库, 창고",
    "Balcony": "balkon, balcon, balcón, balcone, varanda, балкон, лоджия, 阳台, バルコニー, 발코니",
    "Wardrobe": "garderobe, ankleide, ankleidezimmer, schrankraum, closet, walk in closet, wic, dressing, "
    "dressing room, cloakroom, cloaks, penderie, placard, vestidor, armario, ropero, guardarropa",
    "Guest_Room": "gast, gäste, gästezimmer, guest, guest bedroom, guests, chambre d'ami, chambre d'amis, "
    "cuarto de invitados, habitación de invitados, dormitorio de invitados",
    "Lobby": "empfang, empfangshalle, reception, vestíbulo principal, hall d'accueil, accueil, 大堂, 大厅, 로비",
    "Entryway": "eingang, eingangsbereich, eingangshalle, windfang, vorraum, vorzimmer, entrance, entrance hall, "
    "entry, entry hall, foyer, vestibule, vestibül, mudroom, porch, entrée, hall d'entrée, sas d'entrée, sas, entrada, "
    "vestíbulo, zaguán, "
    "ingresso, hall de entrada, прихожая, тамбур, 玄关, 门厅, 현관",
    "Terrace": "terrasse, dachterrasse, patio, deck, veranda, véranda, terraza, azotea, porche, "
    "terrazza, терраса, 露台",
    "Loggia": "laubengang, galería cubierta",
    "Boiler_room": "heizung, heizraum, heizungsraum, technik, technikraum, haustechnik, hausanschlussraum, boiler, "
    "plant room, mechanical, mechanical room, technical room, chaufferie, local technique, cuarto de calderas, "
    "sala de calderas, cuarto técnico",
    "Aeration": "schacht, lüftung, lüftungsschacht, luftraum, lichtschacht, shaft, vent, ventilation, air shaft, duct, "
    "gaine, gaine technique, ventilación, patinillo",
    "Passenger_elevator": "aufzug, fahrstuhl, lift, elevator, ascenseur, ascensor, ascensore, elevador, лифт, 电梯",
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


def is_attic_space(words: Iterable[str]) -> bool:
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
    """Yield the labels in a name from left to right; names of storeys say nothing of the thing."""
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
    """Plain lower-case words; "/" stands between parts."""
    parted = re.sub(r"(?<=[a-zß-ÿ])(?=[A-Z])", " ", word)
    parts = unicodedata.normalize("NFKD", parted.replace("ß", "ss"))
    plain = "".join(each for each in parts if not unicodedata.combining(each)).lower()
    plain = re.sub(r"[/+&,;|]", " / ", plain)
    tokens = ["/" if token in _AND else token for token in re.findall(r"[^\W\d_]+|/", plain)]
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
