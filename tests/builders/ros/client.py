"""A client of real rclpy that asks ``/houseexpo/load_map`` for houses, and prints what came as JSON.

``python -m tests.builders.ros.client HOUSE...``, with ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE set. Of the
services of ``houseexpo ros``, this is the one whose type rclpy's wheels bring.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

from tests.builders.ros.judge import surroundings


def answers(houses: Sequence[str], *, limit_s: float = 110.0) -> dict[str, Any]:
    """Run ``ask`` in a process of its own, and return what it found."""
    words = [sys.executable, "-m", "tests.builders.ros.client", *houses]
    done = subprocess.run(words, env=surroundings(), capture_output=True, text=True, timeout=limit_s, check=False)
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def ask(houses: Sequence[str]) -> dict[str, Any]:
    """Ask for each house; return the answers (result, width, height, occupied cells) and how long each took."""
    import rclpy
    from nav_msgs.srv import LoadMap

    rclpy.init()
    node = rclpy.create_node("client")
    client = node.create_client(LoadMap, "/houseexpo/load_map")
    found: dict[str, Any] = {"is_there": client.wait_for_service(60.0), "answers": [], "late_ms": []}
    found["services"] = dict(node.get_service_names_and_types())
    for house in houses:
        began = time.monotonic()
        future = client.call_async(LoadMap.Request(map_url=house))
        rclpy.spin_until_future_complete(node, future, timeout_sec=20.0)
        answer = future.result()
        found["late_ms"].append((time.monotonic() - began) * 1e3)
        info = None if answer is None else answer.map.info
        found["answers"].append(
            info and [answer.result, info.width, info.height, sum(v == 100 for v in answer.map.data)]
        )
    return found


if __name__ == "__main__":
    sys.stdout.write(json.dumps(ask(sys.argv[1:])) + "\n")
