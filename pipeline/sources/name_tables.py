"""The words by which files call things, in English, German, French, Spanish, Italian, Portuguese, Dutch and pinyin.

Words are plain lower-case ASCII: umlauts spelled out, other accents dropped; plurals in -s, -es, -n and -en are known
by themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final


class Role(StrEnum):
    """What a name says a thing is."""

    WALL = "wall"  # wall, column, window, glass: what stands
    DOOR = "door"  # leaves and their frames
    FLOOR = "floor"
    CEILING = "ceiling"  # and roof
    FURNITURE = "furniture"
    SPACE = "space"  # the body of a room's air
    OPENING = "opening"  # the body that was taken out of a wall
    TERRAIN = "terrain"  # ground, streets
    LEFT_OUT = "left_out"  # lamps, people, cars, trees, pictures, handles


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
        door doors doorleaf doorframe doorpanel frontdoor backdoor maindoor sidedoor slidingdoor garagedoor
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
        tianhuaban tianhua wuding diaoding wumian
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
    Role.TERRAIN: _set("""
        terreno terrain prato cesped grama dixing caodi
    """),
    Role.LEFT_OUT: _set("""
        lampada lampara luminaria luminaire lustre lampadario voiture macchina coche carro arbre albero arbol
        arvore plante pianta planta rideau tenda cortina tableau quadro cuadro poignee maniglia manija
        macaneta miroir specchio espejo espelho personne persona pessoa deng dengju diaodeng zhiwu huapen
        chuanglian guahua shexiangji
    """),
}
"""Languages whose head noun comes first: a mesa de centro is a table; pinyin is written without spaces."""

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
    armadio armario armoire cabinet car cupboard dishwasher drawer dryer freezer fridge frigo furniture kast
    koelkast kuehlschrank locker microwave oven refrigerator schrank schrankwand shelf shower stove wardrobe
    washer
""")
"""A door of one of these is a part of it."""

STOREYS: Final = _set("""
    1st 2nd 3rd 4th first fourth ground level lower nd plan rd second st th third top upper
""")
"""Before "floor", these name a storey, not a surface."""
