"""Robots as agents of PufferLib, which take actions at random: python docs/examples/puffer.py --steps 1000.

PufferLib keeps the buffers; the simulator draws maps into them.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import pufferlib.vector

from houseexpo.pseudoslam.envs.puffer import PseudoSlamPufferEnv


def main() -> None:
    """Step, and say what came of the episodes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dataset", default="plans/demo")
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=1000)
    given = parser.parse_args()
    env = pufferlib.vector.make(
        PseudoSlamPufferEnv, env_kwargs={"num_envs": given.num_envs, "dataset": given.dataset, "max_episode_steps": 200}
    )
    env.reset(seed=0)
    rng, coverage, start = np.random.default_rng(0), [], time.perf_counter()
    for _ in range(given.steps):
        *_, infos = env.step(rng.integers(0, 3, given.num_envs))
        coverage += [info["coverage"] for info in infos]
    seconds = time.perf_counter() - start
    print(f"{given.num_envs * given.steps / seconds:,.0f} steps a second")  # noqa: T201
    if coverage:
        print(f"{len(coverage)} episodes, {100 * np.mean(coverage):.1f}% seen")  # noqa: T201
    env.close()


if __name__ == "__main__":
    main()
