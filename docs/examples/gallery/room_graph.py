"""The graph of rooms and doors, over the plan."""

import networkx

import houseexpo

plan = houseexpo.open_dataset("plans/demo").select(rooms=(4, 10)).sort("rooms", descending=True)[0]
graph = plan.graph()
places = networkx.get_node_attributes(graph, "position")

ax = plan.plot(figsize=(6, 5), labels=False, title=f"{len(graph)} rooms, {graph.number_of_edges()} doors")
networkx.draw_networkx(graph, places, ax=ax, node_color="white", edgecolors="black", width=2)
ax.figure.savefig("room_graph.png", dpi=90, bbox_inches="tight")
