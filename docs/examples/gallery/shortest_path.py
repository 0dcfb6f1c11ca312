"""The shortest path of a robot of 0.2 m radius between the two rooms that are farthest apart."""

import numpy as np

import houseexpo

plans = houseexpo.open_dataset("plans/demo").select(rooms=(5, 20), robot_radius=0.2).sort("area")
plan = plans[len(plans) // 2]
points = [plan.graph().nodes[room.id]["position"] for room in plan.rooms]
apart = np.linalg.norm(np.array(points)[:, None] - np.array(points), axis=2)
start, goal = np.unravel_index(apart.argmax(), apart.shape)
path = plan.shortest_path(points[start], points[goal], radius=0.2)

ax = plan.plot(figsize=(6, 5), title=f"{path.length:.1f} m")
ax.plot(*path.points.T, color="black", linewidth=2)
ax.plot(*path.points[[0, -1]].T, "o", color="black")
ax.figure.savefig("shortest_path.png", dpi=90, bbox_inches="tight")
