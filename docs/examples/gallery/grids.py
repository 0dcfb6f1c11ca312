"""One plan as the grids that networks and planners take."""

from matplotlib import pyplot as plt

import houseexpo

plans = houseexpo.open_dataset("plans/demo").select(rooms=(4, 12)).sort("area")
plan = plans[len(plans) // 3]
grids = {"free or not": plan.grid(25), "rooms": plan.room_grid(25), "metres to the wall": plan.distance_field(25)}

figure, axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
for ax, (title, grid) in zip(axes, grids.items(), strict=True):
    ax.imshow(grid, origin="lower")
    ax.set(title=title, xticks=[], yticks=[])
figure.savefig("grids.png", dpi=90)
