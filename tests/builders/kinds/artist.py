"""Kinds ``artist_named`` and ``artist_unnamed``: a furnished house as artists publish it, with or without plain names.

R1  Named: nodes and materials in one of eight languages, numbered as programs number copies. Unnamed:
    ``Cube.042``, ``mesh_17``, materials ``Material.003``.
R2  Walls are solids of any style or one body; floors a slab or one face a room; ceilings are rare.
R3  Doors are closed, ajar or open leaves, mostly with frames.
R4  Every eighth named house was an IFC file: its nodes have the classes as names, and its rooms are bodies too.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from numpy.random import Generator

from tests.builders.kinds.homes import Style, random_storeys
from tests.builders.kinds.parts.furnishing import furnished
from tests.builders.kinds.parts.joinery import Joinery, fitted
from tests.builders.kinds.parts.sheets import facade, jambs, sheet_ring, zone_areas
from tests.builders.kinds.parts.slabs import flight, floor_slab
from tests.builders.kinds.parts.solids3d import box, flat, joined, moved, prism
from tests.builders.kinds.parts.wall_bodies import STYLES, wall_bodies
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import Member, Part, Storey
from tests.builders.kinds.writers import UP_OF, write

_KEYS = """
wall floor ceiling ground skirting door frame handle window bed sofa chair dining_table coffee_table desk
wardrobe shelf kitchen dresser tv bathtub toilet basin shower plant rug floor_lamp lamp wall_shelf car curtain stairs
"""

_WORDS = {
    "english": """
Wall Floor Ceiling Ground Baseboard Door Frame Handle Window Bed Sofa Chair DiningTable CoffeeTable Desk
Wardrobe Bookshelf KitchenCounter Dresser TV Bathtub Toilet Sink Shower Plant Rug FloorLamp PendantLamp
WallShelf Car Curtain Stairs
""",
    "german": """
Wand Boden Decke Gelaende Sockelleiste Tür Rahmen Griff Fenster Bett Sofa Stuhl Esstisch Couchtisch Schreibtisch
Kleiderschrank Regal Küchenzeile Kommode Fernseher Badewanne WC Waschbecken Dusche Pflanze Teppich Stehlampe
Lampe Wandregal Auto Vorhang Treppe
""",
    "french": """
Mur Sol Plafond Terrain Plinthe Porte Cadre Poignee Fenetre Lit Canape Chaise Table TableBasse Bureau Armoire
Etagere Cuisine Commode Televiseur Baignoire Toilettes Lavabo Douche Plante Tapis Lampadaire Lampe Tablette
Voiture Rideau Escalier
""",
    "spanish": """
Pared Suelo Techo Terreno Zocalo Puerta Marco Manija Ventana Cama Sofa Silla Mesa Mesita Escritorio Armario
Estanteria Cocina Comoda Televisor Banera Inodoro Lavabo Ducha Planta Alfombra LamparaPie Lampara Estante Coche
Cortina Escalera
""",
    "italian": """
Parete Pavimento Soffitto Terreno Battiscopa Porta Telaio Maniglia Finestra Letto Divano Sedia Tavolo Tavolino
Scrivania Armadio Libreria Cucina Comò Televisore Vasca WC Lavandino Doccia Pianta Tappeto Piantana Lampada
Mensola Auto Tenda Scala
""",
    "portuguese": """
Parede Piso Teto Terreno Rodape Porta Batente Macaneta Janela Cama Sofa Cadeira Mesa MesaCentro Escrivaninha
GuardaRoupa Estante Cozinha Comoda Televisao Banheira VasoSanitario Pia Chuveiro Planta Tapete Luminaria Lampada
Prateleira Carro Cortina Escada
""",
    "dutch": """
Muur Vloer Plafond Terrein Plint Deur Kozijn Deurklink Raam Bed Bank Stoel Eettafel Salontafel Bureau
Kledingkast Boekenkast Keuken Ladekast Televisie Badkuip Toilet Wastafel Douche Plant Vloerkleed Vloerlamp
Hanglamp Wandplank Auto Gordijn Trap
""",
    "pinyin": """
qiang diban tianhuaban dimian tijiaoxian men menkuang bashou chuang chuangpu shafa yizi canzhuo chaji shuzhuo
yigui shujia chugui doudugui dianshi yugang matong xishoupen linyu zhiwu ditan luodideng diaodeng geban qiche
chuanglian louti
""",
}

LANGUAGES = {name: dict(zip(_KEYS.split(), text.split(), strict=True)) for name, text in _WORDS.items()}
"""For each language, a word for each key."""


IFC_CLASSES = {
    "wall": "IfcWallStandardCase",
    "floor": "IfcSlab",
    "roof": "IfcRoof",
    "stair": "IfcStairFlight",
    "leaf": "IfcDoor",
    "frame": "IfcDoor",
    "window": "IfcWindow",
}


def make_named(rng: Generator, folder: Path, name: str) -> Member:
    """Write one house whose nodes say what they are."""
    return make(rng, folder, name, named=True)


def make_unnamed(rng: Generator, folder: Path, name: str, scale: float = 1.0) -> Member:
    """Write one house whose nodes say nothing; ``scale`` is what a unit of a model stands for (20 m at 1:20)."""
    return make(rng, folder, name, named=False, scale=scale)


def make(rng: Generator, folder: Path, name: str, named: bool, scale: float = 1.0) -> Member:
    """Write one furnished house."""
    count = int(rng.choice([1, 1, 1, 1, 2]))
    size = str(rng.choice(["small", "home", "home"])) if count == 1 else "home"
    storeys = random_storeys(rng, Style(size=size, height_m=(2.4, 3.1)), count)
    joinery = replace(Joinery.draw(rng), doors=str(rng.choice(["closed", "closed", "ajar", "open", "mixed", "none"])))
    language, slab = str(rng.choice(list(LANGUAGES))), 0.25
    words, parts, floors, z = LANGUAGES[language], [], [], 0.0
    for storey in storeys:
        made = building(storey, joinery, rng, words, slab if count > 1 else 0.0)
        for thing in furnished(storey, rng, float(rng.uniform(0.5, 1.0))):
            made.append(Part(words[thing.sort], thing.mesh, "furniture", words[thing.sort]))
        if z > 0:
            rise = z
            made.append(
                Part(words["stairs"], moved(joined(flight(storey, rise)), 0, 0, -rise), "stair", words["stairs"])
            )
        if rng.random() < 0.3:
            made += curtains(storey, words)
        parts += [replace(p, mesh=moved(p.mesh, 0, 0, z)) for p in made]
        floors.append(z)
        z += storey.height + slab
    parts = [parts[k] for k in rng.permutation(len(parts))]
    if named and rng.random() < 0.12:
        parts = as_ifc_nodes(parts, storeys, floors)
    else:
        parts = numbered(parts, rng) if named else nameless(parts, rng)
    suffix = str(rng.choice([".glb", ".glb", ".glb", ".obj", ".dae" if scale == 1.0 else ".obj"]))
    up = "y" if suffix == ".dae" and rng.random() < 0.4 else UP_OF[suffix]
    units = ("m",) if suffix == ".glb" or scale != 1.0 else ("m", "cm", "in")
    placing = random_placing(rng, up, units, turned=0.25, scale=scale)
    path = write(parts, folder / f"{name}{suffix}", placing)
    about = f"{count} storeys, {language}, doors {joinery.doors}, frames {joinery.frames}, {len(parts)} parts"
    truths = [truth_of(s, placing, "furnished", f"{name}_{k}", floors[k]) for k, s in enumerate(storeys)]
    return Member(path, tuple(truths), about, placing.up, placing.unit_m)


def building(storey: Storey, joinery: Joinery, rng: Generator, words: dict[str, str], slab: float) -> list[Part]:
    """R2, R3: the house itself; ``slab`` is the floor's thickness where storeys stand over one another."""
    walls = wall_bodies(storey, str(rng.choice(STYLES))) if slab or rng.random() < 0.85 else sheets(storey)
    one = rng.random() < 0.5
    parts = [Part(words["wall"], mesh, "wall", words["wall"]) for mesh in ([joined(walls)] if one else walls)]
    pick = 0.0 if slab else rng.random()
    if pick < 0.4:
        parts.append(Part(words["floor"], floor_slab(storey, slab or 0.2), "floor", words["floor"]))
    elif pick < 0.8:
        parts += [Part(words["floor"], flat(r, 0.0), "floor", words["floor"]) for r in storey.rooms]
        parts.append(Part(words["floor"], flat(storey.footprint, -0.02), "floor", words["floor"]))
    if rng.random() < 0.2:
        parts.append(
            Part(words["ceiling"], prism(storey.footprint, storey.height, storey.height + 0.15), "roof", "roof")
        )
    if not slab and rng.random() < 0.15:
        x1, y1, x2, y2 = storey.footprint.bounds
        parts.append(Part(words["ground"], box(x1 - 4, y1 - 4, -0.4, x2 + 4, y2 + 4, -0.25), "ground", words["ground"]))
    skirting = storey.wall_area.buffer(0.015, join_style="mitre").difference(storey.wall_area)
    if rng.random() < 0.3:
        gaps = [storey.gap(o, 0.1) for o in storey.openings if o.sill == 0]
        inside = skirting.intersection(storey.footprint)
        for gap in gaps:
            inside = inside.difference(gap)
        parts.append(Part(words["skirting"], prism(inside, 0.0, 0.08), "wall", words["skirting"]))
    return parts + fitted(storey, joinery, rng, words)


def sheets(storey: Storey) -> list[trimesh.Trimesh]:
    """Walls as the faces of their bodies, jambs and tops among them, each room's and the outside's by itself."""
    areas = [(p, False) for p in facade(storey)] + [(r, True) for r in zone_areas(storey)]
    made = [joined(sheet_ring(storey, p, storey.openings, 0.0, storey.height, inward)) for p, inward in areas]
    made += [jambs(storey, o, storey.height) for o in storey.openings]
    return [*made, flat(storey.wall_area, storey.height)]


def curtains(storey: Storey, words: dict[str, str]) -> list[Part]:
    """Curtains beside windows, to the floor."""
    parts = []
    for o in storey.openings:
        if o.kind != "window" or o.width < 1.0:
            continue
        wall = storey.walls[o.wall]
        side = 1 if wall.sides[0] >= 0 else -1
        for a in (o.start - 0.15, o.end - 0.1):
            area = wall.strip(a, a + 0.25, 0.06, side * (wall.thickness / 2 + 0.07))
            parts.append(Part(words["curtain"], prism(area, 0.03, o.head + 0.1), "furniture", words["curtain"]))
    return parts


def numbered(parts: list[Part], rng: Generator) -> list[Part]:
    """R1: names as programs write them: ``Door``, ``Door.001``, ``door_12``."""
    style, seen, made = int(rng.integers(3)), dict[str, int](), []
    for part in parts:
        base = part.name.rstrip("0123456789_")
        count = seen[base] = seen.get(base, 0) + 1
        name = (base if count == 1 else f"{base}.{count - 1:03d}", f"{base}_{count}", f"{base.capitalize()} {count}")[
            style
        ]
        made.append(replace(part, name=name))
    return made


def as_ifc_nodes(parts: list[Part], storeys: list[Storey], floors: list[float]) -> list[Part]:
    """R4: nodes named by their IFC class, rooms among them as bodies of air."""
    made = [
        replace(p, name=f"{IFC_CLASSES.get(p.role, 'IfcFurnishingElement')}/{p.name}_{k}") for k, p in enumerate(parts)
    ]
    for storey, z in zip(storeys, floors, strict=True):
        for cell, room in zip(storey.cells, storey.rooms, strict=True):
            if cell.floor:
                body = prism(room, z, z + storey.height - 0.02)
                made.append(Part(f"IfcSpace/{cell.label}_{len(made)}", body, "space", "IfcSpace"))
    return made


def nameless(parts: list[Part], rng: Generator) -> list[Part]:
    """R1: names that say nothing."""
    style, numbers = int(rng.integers(3)), {m: k for k, m in enumerate(sorted({p.material for p in parts}))}
    bases = np.array(["Cube", "Plane", "Cylinder", "Circle"])
    made = []
    for k, part in enumerate(parts):
        name = (f"{rng.choice(bases)}.{k:03d}", f"mesh_{k}", f"Object_{2 * k}")[style]
        made.append(replace(part, name=name, material=f"Material.{numbers[part.material]:03d}"))
    return made
