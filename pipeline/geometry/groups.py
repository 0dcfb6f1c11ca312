"""Put numbers into groups: those that pairs connect, directly or through others."""

from __future__ import annotations

from collections.abc import Iterable


class Groups:
    """The numbers 0 to ``count`` - 1 in groups. Each is alone at first; ``join`` unites the groups of two."""

    def __init__(self, count: int) -> None:
        self._towards = list(range(count))

    def of(self, number: int) -> int:
        """Return the number that stands for the group of this one; it changes when groups are joined."""
        towards = self._towards
        while towards[number] != number:
            towards[number] = number = towards[towards[number]]
        return number

    def join(self, one: int, other: int) -> bool:
        """Unite the groups of two numbers; return whether they were two."""
        first, second = sorted((self.of(one), self.of(other)))
        self._towards[second] = first
        return first != second

    def lists(self) -> list[list[int]]:
        """Return the groups, each sorted, in the order of their least numbers."""
        found: dict[int, list[int]] = {}
        for number in range(len(self._towards)):
            found.setdefault(self.of(number), []).append(number)
        return list(found.values())


def connected_groups(count: int, pairs: Iterable[Iterable[int]]) -> list[list[int]]:
    """Return the numbers 0 to ``count`` - 1 in the groups that pairs connect, each sorted, the least first."""
    groups = Groups(count)
    for one, other in pairs:
        groups.join(one, other)
    return groups.lists()
