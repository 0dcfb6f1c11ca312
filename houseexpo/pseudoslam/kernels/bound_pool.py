"""Bind a pool of episodes with all that its steps need, so that calls of kernels need not convert it each time.

At each call numba converts the arrays and numbers that it is given, some hundred for a pool and its parameters, in
3 us. A ``BoundPool`` holds them converted; it takes 6 us to make, once for an episode, and 0.5 us to hand over.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import is_not
from typing import Any, ClassVar, NamedTuple, TypeAlias

from numba import njit, types
from numba.core import config
from numba.experimental import structref

from houseexpo.pseudoslam.kernels.compiling import compiled_function
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.kernels.types import Counts, Scratch


class PlainPool(NamedTuple):
    """The parts of a ``BoundPool``, which it has as attributes in kernels; they stand for it if numba is disabled."""

    pool: Episode
    """N episodes."""
    sizes: Counts
    """(N, 2), rows and columns of each one's rasters."""
    params: StepParams
    scratch: Scratch
    """Working memory that no other thread uses."""


BoundPool: TypeAlias = Any
"""A pool that ``bind_pool`` has bound: a ``_BoundPool``, or a ``PlainPool`` if numba is disabled."""


class _BoundPool(structref.StructRefProxy):
    """A pool of episodes in the form of compiled code. It keeps its arrays in memory, and cannot be pickled."""

    __slots__ = ()


@structref.register
class _BoundPoolType(types.StructRef):
    """The type of a ``_BoundPool`` for the compiler, without constants."""

    def preprocess_fields(self, fields: Any) -> Any:
        """Return the names and types of the parts."""
        return tuple((name, types.unliteral(part)) for name, part in fields)  # type: ignore[no-untyped-call]


structref.define_proxy(_BoundPool, _BoundPoolType, list(PlainPool._fields))  # type: ignore[no-untyped-call]
_make: Any = PlainPool if config.DISABLE_JIT else _BoundPool  # type: ignore[attr-defined]  # it is made at run time


@njit(cache=True)
def bind_pool(pool: Episode, sizes: Counts, params: StepParams, scratch: Scratch) -> BoundPool:
    """Return a pool of episodes, which share the arrays, bound with what its steps need; see ``PlainPool``."""
    return _make(pool, sizes, params, scratch)


class PoolBinding:
    """Binds a pool, and keeps it bound until it or something that goes with it is another object."""

    _compiled: ClassVar[Callable[..., BoundPool] | None] = None
    """``bind_pool`` for its arguments, whose types are always the same."""

    def __init__(self) -> None:
        self._of: tuple[Any, ...] = (None,) * len(PlainPool._fields)
        self._bound: BoundPool = None

    def bind(self, pool: Episode, sizes: Counts, params: StepParams, scratch: Scratch) -> BoundPool:
        """Return the bound pool; see ``PlainPool``."""
        of = pool, sizes, params, scratch
        if any(map(is_not, of, self._of)):
            if PoolBinding._compiled is None:
                PoolBinding._compiled = compiled_function(bind_pool, *of)
            self._bound, self._of = PoolBinding._compiled(*of), of
        return self._bound

    def __reduce__(self) -> tuple[type[PoolBinding], tuple[()]]:
        """Pickle and copy nothing, since the copy is of other arrays."""
        return PoolBinding, ()
