"""``houseexpo.pseudoslam.sb3.SB3VecEnv``, as the guide names it; it lives in ``houseexpo.pseudoslam.envs.sb3``."""

from houseexpo.pseudoslam.envs.sb3 import SB3VecEnv

__all__ = ["SB3VecEnv"]
