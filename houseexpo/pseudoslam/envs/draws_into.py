"""Draw maps into the caller's memory, so that learners with their own buffers need no copy."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.envs.batch import Batch
from houseexpo.pseudoslam.envs.one_at_a_time import one_at_a_time
from houseexpo.pseudoslam.envs.pictures import Pictures, channels_of, side_of
from houseexpo.pseudoslam.envs.spec import EnvSpec


class DrawsInto:
    """A vector environment's ``draw_into``."""

    num_envs: int
    _copy: bool
    _env_spec: EnvSpec
    _pictures: Pictures | None
    _batch: Batch

    @one_at_a_time
    def draw_into(self, maps: npt.NDArray[np.uint8]) -> None:
        """Draw maps into an array of the caller from now on; each reset and step overwrites it.

        Parameters
        ----------
        maps
            (N, channels, side, side) uint8, C-contiguous, like "map" of the observations with ``layout="CHW"``.

        Raises
        ------
        ConfigError
            The array has another shape, type or layout, or the environments were made without ``copy=False``.
        """
        config, several = self._env_spec.config, self._env_spec.kind == "scales"
        shape = self.num_envs, channels_of(config, several=several), side_of(config), side_of(config)
        if self._copy or self._env_spec.layout != "CHW":
            raise ConfigError('draw_into: expected environments made with copy=False and layout="CHW"')
        if maps.shape != shape or maps.dtype != np.uint8 or not (maps.flags.c_contiguous and maps.flags.writeable):
            raise ConfigError(
                f"draw_into: expected a C-contiguous uint8 array of shape {shape} that can be written to, "
                f"found {maps.dtype} {maps.shape}"
            )
        if self._pictures:
            self._pictures.shown = maps
        else:
            self._batch.draw_into(maps[:, 0])
