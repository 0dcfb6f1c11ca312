"""Publish and subscribe to topics of a ROS 2 graph over CycloneDDS's Python, without a ROS installation.

ROS 2 maps its names to DDS like this (design.ros2.org, "Topic and Service name mapping to DDS"): the topic ``/scan`` is
``rt/scan``, the type ``sensor_msgs/msg/LaserScan`` is ``sensor_msgs::msg::dds_::LaserScan_``, and messages are final
structs in plain CDR. So programs that use rmw_fastrtps or rmw_cyclonedds hear these topics, and are heard.

``ROS_DOMAIN_ID``, ``ROS_LOCALHOST_ONLY``, ``ROS_AUTOMATIC_DISCOVERY_RANGE`` and ``CYCLONEDDS_URI`` mean what they mean
to ROS.
"""

from __future__ import annotations

import os
import re
import time
import types
from collections import deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError, MissingDependencyError, install_command
from houseexpo.pseudoslam.io.ros_messages import FIELDS, Fields, Message, TopicQuality

_LOCAL: Final = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>'
    "</Domain></CycloneDDS>"
)
"""CycloneDDS's settings for programs of this machine alone: without multicast, which loopback interfaces often lack."""
_BY_NAME: Final = (
    "<CycloneDDS><Domain><Compatibility><IgnoreTypeInformation>1.1,1.15</IgnoreTypeInformation></Compatibility>"
    "</Domain></CycloneDDS>"
)
"""Types of RTI Connext (1.1) and Fast DDS (1.15) are compared by name, as rmw_cyclonedds does: they describe the same
types with other hashes, and CycloneDDS would take them for different ones."""
_DOMAIN_MOST: Final = 232
"""The largest domain whose ports fit below 65,536 (DDSI-RTPS 2.5, 9.6.1.1)."""
_BLOCKED_NS: Final = 100_000_000
"""How long a reliable writer waits for a slow reader."""
_NEIGHBOURS_LOOK_S: Final = 1.0
_MEET_S: Final = 0.5
_WAITING: Final = 100
"""Messages of a subscription that are kept until they are taken."""
_QOS_POLICIES: Final = {2: "durability", 11: "reliability", 8: "liveliness", 4: "deadline"}
"""Numbers of the policies that may not fit, in DDS."""
_NUMBERS: Final = ("int8", "uint8", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
_PLAIN: Final = {"bool": bool, "string": str}


class Participant:
    """A participant of a ROS 2 graph.

    Parameters
    ----------
    domain
        The domain's number; None for ``ROS_DOMAIN_ID``, or else 0.
    local
        Whether to talk only to programs on this machine; None for what ``ROS_AUTOMATIC_DISCOVERY_RANGE`` or
        ``ROS_LOCALHOST_ONLY`` says.
    warn
        Called with a sentence when a publisher or subscriber on one of the topics does not fit.

    Raises
    ------
    ConfigError
        The domain is impossible, or the network cannot be used.
    MissingDependencyError
        CycloneDDS is not installed.
    """

    def __init__(self, domain: int | None, *, local: bool | None, warn: Callable[[str], None]) -> None:
        try:
            from cyclonedds.core import DDSException
            from cyclonedds.domain import DomainParticipant
        except ImportError as error:
            said = f"ROS 2 topics need cyclonedds, which is not installed: {install_command('ros')}"
            raise MissingDependencyError(said) from error
        number = _domain() if domain is None else domain
        if not 0 <= number <= _DOMAIN_MOST:
            raise ConfigError(f"domain: expected a number from 0 to {_DOMAIN_MOST}, found {number}")
        given = os.environ.get("CYCLONEDDS_URI")
        settings = [_BY_NAME, given or (_LOCAL if (_is_local() if local is None else local) else "")]
        os.environ["CYCLONEDDS_URI"] = ",".join(filter(None, settings))  # its only way to add ours
        try:
            self._participant = DomainParticipant(number)
        except DDSException as error:
            raise ConfigError(
                f"ROS 2, domain {number}: the network cannot be used: {error}; check CYCLONEDDS_URI and the network "
                "interfaces, or try --local"
            ) from error
        finally:
            del os.environ["CYCLONEDDS_URI"]
            if given is not None:
                os.environ["CYCLONEDDS_URI"] = given
        self.domain = number
        self._warn = warn
        self._writers: dict[str, tuple[str, Any]] = {}
        self._heard: dict[str, set[str]] = {}
        self._readers: list[Any] = []
        self._neighbours = Neighbours(self._participant)
        self._looked_s = self._began_s = time.monotonic()

    def advertise(self, topic: str, kind: str, quality: TopicQuality) -> None:
        """Offer messages of a type on a topic, such as ``/robot1/scan``."""
        from cyclonedds.pub import DataWriter

        made = self._topic(topic, kind)
        listener = _listener(self._warn, topic, kind)
        self._writers[topic] = kind, DataWriter(self._participant, made, qos=_qos(quality), listener=listener)

    def publish(self, topic: str, message: Message) -> None:
        """Write a message on a topic that was advertised; without subscribers, nothing happens.

        A reader that does not take its messages delays this by 0.1 s at most; then the message is lost to it.
        """
        from cyclonedds.core import DDSException

        kind, writer = self._writers[topic]
        assert message.type == kind, (topic, message.type)  # noqa: S101  # our own topics
        try:
            writer.write(_dds_struct(message.type, message.fields))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
            self._warn(f"{topic}: a subscriber is too slow, a message was dropped for it")

    def has_subscribers(self, topic: str) -> bool:
        """Return whether anybody listens to a topic that was advertised."""
        return len(self._writers[topic][1].get_matched_subscriptions()) > 0

    def subscribe(self, topic: str, kind: str, quality: TopicQuality | None = None) -> Subscription:
        """Listen to messages of a type on a topic; the same topic may be listened to with several types."""
        from cyclonedds.sub import DataReader

        made = self._topic(topic, kind)
        subscription = Subscription(kind)
        listener = _listener(self._warn, topic, kind, subscription)
        reader = DataReader(self._participant, made, qos=_qos(quality or TopicQuality()), listener=listener)
        self._readers.append(reader)
        self._heard.setdefault(topic, set()).add(kind)
        return subscription

    def look(self) -> None:
        """Warn of others on the same topics, and of other types on them; once a second, and each thing once."""
        if time.monotonic() - self._looked_s < _NEIGHBOURS_LOOK_S:
            return
        self._looked_s = time.monotonic()
        for text in self._neighbours.news({topic: kind for topic, (kind, _) in self._writers.items()}, self._heard):
            self._warn(text)

    def refuse_second(self, topic: str) -> None:
        """Raise ConfigError if another participant publishes on a topic that only one can have.

        The network must have existed for half a second, in which participants find each other; this waits so long.
        """
        time.sleep(max(self._began_s + _MEET_S - time.monotonic(), 0.0))
        if self._neighbours.publishers(topic):
            raise ConfigError(
                f"ROS domain {self.domain}: another simulator publishes on {topic} already; end it, or use another "
                "--domain"
            )

    def close(self) -> None:
        """Leave the graph."""
        self._readers.clear()
        self._writers.clear()
        del self._participant

    def _topic(self, topic: str, kind: str) -> Any:
        from cyclonedds.topic import Topic

        return Topic(self._participant, f"rt{topic}", _dds_type(kind))


class Subscription:
    """The messages that arrived on a topic and were not taken yet; older ones make room for new ones."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._arrived: deque[Fields] = deque(maxlen=_WAITING)

    def add(self, fields: Fields) -> None:
        """Add a message; called by the network's thread."""
        self._arrived.append(fields)

    def take(self) -> list[Message]:
        """Return the messages since the last call, the oldest first."""
        found = []
        while self._arrived:
            found.append(Message(self.kind, self._arrived.popleft()))
        return found


def _domain() -> int:
    given = os.environ.get("ROS_DOMAIN_ID", "").strip() or "0"
    if not re.fullmatch(r"\d{1,4}", given):
        raise ConfigError(f"ROS_DOMAIN_ID: expected a number from 0 to {_DOMAIN_MOST}, found {given!r}")
    return int(given)


def _is_local() -> bool:
    reach = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").strip().upper()
    return reach == "LOCALHOST" or os.environ.get("ROS_LOCALHOST_ONLY", "").strip() == "1"


def _qos(quality: TopicQuality) -> Any:
    """Return the policies of DDS."""
    from cyclonedds.core import Policy, Qos

    return Qos(
        Policy.Reliability.Reliable(_BLOCKED_NS),
        Policy.History.KeepLast(quality.depth),
        Policy.Durability.TransientLocal if quality.latched else Policy.Durability.Volatile,
    )


def _listener(warn: Callable[[str], None], topic: str, kind: str, subscription: Subscription | None = None) -> Any:
    from cyclonedds.core import Listener

    def unfit(status: Any, who: str) -> None:
        policy = _QOS_POLICIES.get(int(status.last_policy_id))
        if policy is not None:  # else it is the other type of the same topic, which has a reader of its own
            warn(f"{topic}: a {who} of {kind} does not fit, its {policy} differs from what ROS 2 expects here")

    class Heard(Listener):  # type: ignore[misc]  # mypy sees nothing of cyclonedds
        def on_data_available(self, reader: Any) -> None:
            for sample in reader.take(_WAITING):
                if subscription is not None and sample.sample_info.valid_data:
                    subscription.add(_message_fields(kind, sample))

        def on_requested_incompatible_qos(self, _reader: Any, status: Any) -> None:
            unfit(status, "publisher")

        def on_offered_incompatible_qos(self, _writer: Any, status: Any) -> None:
            unfit(status, "subscriber")

    return Heard()


@cache
def _dds_type(kind: str) -> Any:
    """Return CycloneDDS's type of a ROS type: a final struct with the mapped name, which keeps ``msg`` or ``srv``."""
    from cyclonedds.idl import IdlStruct
    from cyclonedds.idl.annotations import final

    package, part, name = kind.split("/")
    fields = {field: _field_type(of) for field, of in FIELDS[kind].items()}

    def fill(namespace: dict[str, Any]) -> None:
        namespace["__annotations__"] = fields
        namespace["__module__"] = __name__

    made = types.new_class(name, (IdlStruct,), {"typename": f"{package}::{part}::dds_::{name}_"}, fill)
    return final(dataclass(made))


def _field_type(kind: str) -> Any:
    from cyclonedds.idl import types as idl

    if found := re.fullmatch(r"(.+)\[(\d*)\]", kind):
        inner, size = _field_type(found[1]), found[2]
        return idl.array[inner, int(size)] if size else idl.sequence[inner]
    return getattr(idl, kind) if kind in _NUMBERS else _PLAIN.get(kind) or _dds_type(kind)


def _dds_struct(kind: str, fields: Mapping[str, Any]) -> Any:
    """Return a message as CycloneDDS's type."""
    return _dds_type(kind)(**{name: _value(FIELDS[kind][name], value) for name, value in fields.items()})


def _value(kind: str, value: Any) -> Any:
    if isinstance(value, Mapping):
        return _dds_struct(kind, value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_value(kind.removesuffix("[]"), one) for one in value] if isinstance(value, list) else value


def _message_fields(kind: str, sample: Any) -> Fields:
    """Return the fields of a message of CycloneDDS; lists stay lists."""
    return {name: _plain(of, getattr(sample, name)) for name, of in FIELDS[kind].items()}


def _plain(kind: str, value: Any) -> Any:
    if kind in FIELDS:
        return _message_fields(kind, value)
    return [_plain(kind.removesuffix("[]"), one) for one in value] if kind.removesuffix("[]") in FIELDS else value


# Find other programs on the simulator's topics in a DDS domain, and return warnings of second publishers or types.


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
