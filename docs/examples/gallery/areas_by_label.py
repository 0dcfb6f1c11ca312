"""How large rooms of each label are."""

from matplotlib import pyplot as plt

import houseexpo

rooms = houseexpo.open_dataset("plans/demo").to_geopandas("rooms")
labels = rooms["label"].value_counts().index[:8]

figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.boxplot([rooms.loc[rooms["label"] == label, "area"] for label in labels], orientation="horizontal")
ax.set_yticks(range(1, len(labels) + 1), [label.replace("_", " ") for label in labels])
ax.set(xlabel="area (m²)", xscale="log")
figure.savefig("areas_by_label.png", dpi=90)
