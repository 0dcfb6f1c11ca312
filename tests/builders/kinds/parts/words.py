"""Words for the parts of a house in the languages in which people name them."""

from __future__ import annotations

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
