"""Walls as shapes: the share of a house that is wall."""

from matplotlib import pyplot as plt

import houseexpo

plans = houseexpo.open_dataset("plans/demo")
walls = plans.to_geopandas("walls").groupby("plan_id")["area"].sum()
floors = plans.to_pandas()["area"]
share = walls / (walls + floors)

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.5), layout="constrained")
plan = plans[share.sub(share.median()).abs().idxmin()]
plan.to_geopandas("walls").plot(ax=left, color="black")
left.set(title=f"{share[plan.id]:.0%} is wall", xticks=[], yticks=[])
share.plot.hist(ax=right, bins=20, xlabel="share of walls (0.1 m thick)")
figure.savefig("walls.png", dpi=90)
