"""The name ``houseexpo.pseudoslam.sb3.SB3VecEnv``; the class is defined in ``houseexpo.pseudoslam.envs.sb3``."""

from houseexpo.pseudoslam.envs.sb3 import SB3VecEnv

__all__ = ["SB3VecEnv"]
