"""Find other programs on the simulator's topics in a DDS domain, and return warnings of second publishers or types."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Final

_SHARED: Final = ("tf", "tf_static")
"""Topics on which many publish."""
_READ_MOST: Final = 10_000


class Neighbours:
    """The publishers and subscribers of other participants, as CycloneDDS has discovered them."""

    def __init__(self, participant: Any) -> None:
        from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription

        self._own = participant.guid
        self._publishers = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
        self._subscribers = BuiltinDataReader(participant, BuiltinTopicDcpsSubscription)
        self._told: set[str] = set()

    def publishers(self, topic: str) -> int:
        """Return how many others publish on a topic, whatever the type."""
        return sum(name == topic for name, _ in self._read_names(self._publishers))

    def news(self, offered: Mapping[str, str], heard: Mapping[str, Collection[str]]) -> list[str]:
        """Return sentences about what has come and does not fit.

        Parameters
        ----------
        offered
            The ROS type of each topic that the simulator publishes.
        heard
            The ROS types of each topic to which it listens.
        """
        found = []
        for name, kind in self._read_names(self._publishers):
            expected = heard.get(name, ())
            if expected and kind not in expected:
                found.append(f"{name}: expected messages of {' or '.join(sorted(expected))}, but others publish {kind}")
            elif name in offered and name.rsplit("/", 1)[-1] not in _SHARED:
                found.append(f"{name}: another program publishes on it too; end it, or use another --domain")
        for name, kind in self._read_names(self._subscribers):
            if name in offered and kind != offered[name]:
                found.append(f"{name}: a subscriber expects {kind}, but its messages are {offered[name]}")
        new = [text for text in dict.fromkeys(found) if text not in self._told]
        self._told.update(new)
        return new

    def _read_names(self, reader: Any) -> list[tuple[str, str]]:
        """Return the ROS names of topics and types of others."""
        return [
            (sample.topic_name.removeprefix("rt"), sample.type_name.replace("::dds_::", "/").replace("::", "/")[:-1])
            for sample in reader.read(_READ_MOST)
            if sample.sample_info.valid_data
            and sample.sample_info.instance_state == _alive()
            and sample.participant_key != self._own
            and sample.topic_name.startswith("rt/")
        ]


def _alive() -> int:
    from cyclonedds.core import InstanceState

    return int(InstanceState.Alive)
