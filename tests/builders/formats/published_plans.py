"""Two rooms with a door between, as CubiCasa5k writes them: to the letter of its keys, no file of theirs.

The rooms are 4 x 4 m, a wall of 0.1 m between them from x = 4 to 4.1; the door is 0.9 m wide, from y = 1.5 to 2.4.
"""

from __future__ import annotations

from typing import Any

from shapely import box

KITCHEN, BEDROOM, DOOR = box(0, 0, 4, 4), box(4.1, 0, 8.1, 4), box(4, 1.5, 4.1, 2.4)
AREA_M2 = 32.0 + 0.09


def cubicasa() -> str:
    """Walls, doors and spaces as groups with polygons, 100 pixels a metre; y down."""

    def polygon(shape: Any) -> str:
        corners = " ".join(f"{100 * x:g},{400 - 100 * y:g}" for x, y in shape.exterior.coords[:-1])
        return f'<polygon points="{corners}"/>'

    walls = [
        box(-0.1, -0.1, 8.2, 0),
        box(-0.1, 4, 8.2, 4.1),
        box(-0.1, 0, 0, 4),
        box(8.1, 0, 8.2, 4),
        box(4, 0, 4.1, 4),
    ]
    groups = [f'<g id="Wall" class="Wall External" >{polygon(wall)}</g>' for wall in walls[:4]]
    door = f'<g id="Door" class="Door Swing Beside">{polygon(DOOR)}<path d="M1,1L2,2"/></g>'
    groups.append(f'<g id="Wall" class="Wall">{polygon(walls[4])}{door}</g>')
    groups += [
        f'<g class="Space {n}">{polygon(s)}<text>x</text></g>' for n, s in (("Kitchen", KITCHEN), ("Bedroom", BEDROOM))
    ]
    body = f'<g id="Model" class="Model v1-1"><g class="Floorplan Floor-1">{"".join(groups)}</g></g>'
    return f'<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" width="900" height="500">{body}</svg>'
