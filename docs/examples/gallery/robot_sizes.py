"""Where robots of three sizes can be: what is dark cannot hold the middle of the robot."""

from matplotlib import pyplot as plt

import houseexpo

plan = houseexpo.open_dataset("plans/demo").select(rooms=(4, 12)).sort("area", descending=True)[0]
distance = plan.distance_field(25)

figure, axes = plt.subplots(1, 3, figsize=(9, 3), layout="constrained")
for ax, radius in zip(axes, (0.1, 0.3, 0.5), strict=True):
    found = plan.navigability(radius)
    ax.imshow(distance >= radius, origin="lower", cmap="cividis")
    ax.set(title=f"{radius} m: {found.components} parts, {found.largest_share:.0%} in one", xticks=[], yticks=[])
figure.savefig("robot_sizes.png", dpi=90)
