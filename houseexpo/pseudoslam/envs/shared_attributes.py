"""What gymnasium's vector environments say of the environments in them, where those are one."""

from __future__ import annotations

from typing import Any

from houseexpo.errors import ConfigError


class SharedAttributes:
    """``call``, ``get_attr`` and ``set_attr``."""

    num_envs: int

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return a method's results for each environment; it takes the environment's number first, as ``state`` does.

        Of what is no method, as ``get_attr``.
        """
        found = getattr(self, name)
        if not callable(found):
            return (found,) * self.num_envs
        return tuple(found(i, *args, **kwargs) for i in range(self.num_envs))

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute for each environment: they share it."""
        return (getattr(self, name),) * self.num_envs

    def set_attr(self, name: str, values: Any) -> None:  # noqa: ARG002  # gymnasium's signature
        """Refuse, with ConfigError: the environments are one, made with what they are."""
        raise ConfigError(f"{name}: the environments are one, and made with what they are; make new ones")
