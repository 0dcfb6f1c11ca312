"""A contact sheet of made homes and published plans, mixed, without labels; prints which ones were made.

    python -m research.home_sheet plans_33717.jsonl.gz sheet.png [SEED]

Published plans are not passed on: this sheet is for one's own eyes. ``make pictures`` draws the made ones for the docs.
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from houseexpo.drawing.draw import contact_sheet, draw_plan
from houseexpo.floorplan import FloorPlan, decode
from research.home_comparison import made_plans

OF_EACH, COLUMNS, SIZE = 24, 8, 220


def bare(plan: FloorPlan) -> FloorPlan:
    """Return the outline alone."""
    return FloorPlan(plan.id, plan.verts, room_num=plan.room_num, room_category={})


def main() -> None:
    """Draw the sheet and print the places of the made ones, numbered from 1."""
    path, out, seed = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 1
    rng = np.random.default_rng(seed)
    with gzip.open(path) as stream:
        lines = stream.readlines()
    theirs = [decode(lines[k]) for k in rng.choice(len(lines), OF_EACH, replace=False)]
    plans = [*made_plans(OF_EACH, seed), *theirs]
    order = rng.permutation(len(plans)).tolist()
    images = [draw_plan(bare(plans[k]), size=SIZE) for k in order]
    sheet = contact_sheet(images, COLUMNS, [str(place + 1) for place in range(len(order))])
    Image.fromarray(sheet).save(out)
    made = " ".join(str(place + 1) for place, k in enumerate(order) if k < OF_EACH)
    sys.stdout.write(f"made: {made}\n")


if __name__ == "__main__":
    main()
