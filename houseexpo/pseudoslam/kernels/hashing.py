"""Return pseudo-random numbers, uniform or normal, as a pure function of a key and a counter; for noise and people.

Such noise needs no state: environments can be stepped together or one by one, on any thread, and get the same numbers.
The mixing step is the two-round multiply and shift hash of 32 bits of C. Wellons' hash prospector.
"""

from __future__ import annotations

import math

from numba import njit

_WORD = 0xFFFFFFFF


@njit(cache=True, nogil=True)
def uniform(key: int, counter: int) -> float:
    """Return a number in (0, 1) for a key and a counter, both at least 0 and below 2**62."""
    word = _mix(counter & _WORD) ^ (key & _WORD)
    word = _mix(word) ^ ((key >> 32) ^ (counter >> 32)) & _WORD
    return (_mix(word) + 0.5) / 4294967296.0


@njit(cache=True, nogil=True)
def normal(key: int, counter: int) -> float:
    """Return a draw of the standard normal distribution (Box and Muller, 1958)."""
    radius = math.sqrt(-2.0 * math.log(uniform(key, 2 * counter)))
    return radius * math.cos(2.0 * math.pi * uniform(key, 2 * counter + 1))


@njit(cache=True, nogil=True)
def _mix(word: int) -> int:
    """Return a word of 32 bits, each of which depends on all bits of the argument; products fit in 64 bits."""
    word = (word ^ word >> 16) * 0x21F0AAAD & _WORD
    word = (word ^ word >> 15) * 0x735A2D97 & _WORD
    return word ^ word >> 15
