"""Servers of services: against the bytes that DDSI-RTPS prescribes, CycloneDDS's own library, and real rclpy."""

from __future__ import annotations

import os
import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.exports.rasters import WALL, occupancy_picture
from houseexpo.pseudoslam.io.ros_messages import FIELDS, Fields, Message, empty_fields, occupancy_grid_message
from houseexpo.pseudoslam.ros import idl, rtps, services
from houseexpo.pseudoslam.ros.dds import Network
from houseexpo.pseudoslam.ros.services import RequestQueue, ServiceServer
from houseexpo.pseudoslam.simulator import OccupancyGrid
from tests.builders.needs import need
from tests.builders.ros.client import answers
from tests.builders.ros.judge import DOMAIN, ended, started

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
LARGE = FloorPlan("large", [(0, 0), (0, 20), (30, 20), (30, 0)], 1, {})
OWN, OTHER = bytes(range(12)), bytes(range(100, 112))
READER, WRITER = b"\0\0\1\4", b"\0\0\1\3"


def parts(packet: bytes) -> list[rtps.Submessage]:
    return [each.part for each in rtps.parse_submessages(packet, OTHER)]


def test_a_heartbeat_and_an_acknack_have_the_bytes_of_the_standard() -> None:
    beat = rtps.build_message(OWN, rtps.NOBODY, [rtps.build_heartbeat(READER, WRITER, 2, 2**32 + 3, 7)])
    body = "00000104 00000103 00000000 02000000 01000000 03000000 07000000"
    assert beat == b"RTPS\x02\x03\0\0" + OWN + bytes.fromhex("07 01 1c00" + body)
    ack = rtps.build_message(OWN, OTHER, [rtps.build_acknack(READER, WRITER, 5, [5, 7, 37], 1, is_final=False)])
    numbers = "00000000 05000000 21000000 000000a0 00000080"  # 33 bits from 5 on: the 1st, 3rd, and 33rd
    target = bytes.fromhex("0e 01 0c00") + OTHER
    assert ack == b"RTPS\x02\x03\0\0" + OWN + target + bytes.fromhex(
        "06 01 2000 00000104 00000103" + numbers + "01000000"
    )


def test_what_is_written_is_read_again() -> None:
    inline = [(rtps.RELATED, rtps.build_sample_identity(OWN + WRITER, 2**33 + 1))]
    packet = rtps.build_message(
        OWN,
        OTHER,
        [
            rtps.build_data(READER, WRITER, 2**32 + 9, b"\0\1\0\0payl", inline),
            rtps.build_gap(READER, WRITER, 4, 6),
            rtps.build_acknack(READER, WRITER, 3, [4, 258], 2, is_final=True),
            rtps.build_heartbeat(READER, WRITER, 1, 0, 3),
        ],
    )
    assert parts(packet) == [
        rtps.Data(READER, WRITER, 2**32 + 9, dict(inline), b"\0\1\0\0payl"),
        rtps.Gap(READER, WRITER, 4, 6, []),
        rtps.AckNack(READER, WRITER, 3, [4, 258], is_final=True),
        rtps.Heartbeat(READER, WRITER, 1, 0, is_final=False),
    ]
    assert list(rtps.parse_submessages(packet, bytes(range(50, 62)))) == []  # it is for another participant


def test_both_orders_of_bytes_are_read() -> None:
    body = READER + WRITER + struct.pack(">iIiII", 0, 2, 0, 9, 1)
    packet = b"RTPS\x02\x03\x01\x0f" + OWN + struct.pack(">BBH", 7, 0, len(body)) + body
    assert parts(packet) == [rtps.Heartbeat(READER, WRITER, 2, 9, is_final=False)]


def test_addresses_leave_out_other_kinds() -> None:
    shared = struct.pack("<iI", 16, 7410) + bytes(16)
    both = shared + rtps.build_locator(("192.168.1.7", 7411))
    assert rtps.parse_locators(both, "<") == [("192.168.1.7", 7411)]


def test_fragments_together_are_the_payload() -> None:
    payload = np.random.default_rng(1).bytes(10_001)
    found = rtps.build_fragments(READER, WRITER, 3, payload, [], size=4_000)
    assert len(found) == 3
    assert b"".join(part[4 + 32 :][:4_000] for part in found)[:10_001] == payload
    assert struct.unpack_from("<IHHI", found[2], 4 + 20) == (3, 1, 4_000, 10_001)


@pytest.mark.parametrize("seed", range(5))
def test_on_a_network_that_loses_messages_all_samples_come_once(seed: int) -> None:
    rng = np.random.default_rng(seed)
    writer, reader = services._Writer(WRITER), services._Reader(READER)
    came: list[bytes] = []

    def carry(mails: list[services._Mail], sender: bytes) -> None:
        for mail in mails:
            if rng.random() < 0.4:
                continue
            for each in rtps.parse_submessages(rtps.build_message(sender, mail.prefix, mail.parts), mail.prefix):
                part = each.part
                if isinstance(part, rtps.Data):
                    if reader.is_new(OWN + WRITER, part.number):
                        came.append(part.payload or b"")
                elif isinstance(part, rtps.AckNack):
                    carry(writer.take_acknack(OTHER + READER, part), OWN)
                else:
                    carry(reader.take_part(OWN + WRITER, part), OTHER)

    writer.add(b"before")  # a reader that comes later does not get it
    asked = reader.match(OWN + WRITER, [("127.0.0.1", 2)])
    carry(writer.match(OTHER + READER, [("127.0.0.1", 1)]), OWN)
    carry(asked, OTHER)
    sent = [f"{k:04}".encode() for k in range(60)]
    for payload in sent:
        carry(writer.add(payload), OWN)
    for _ in range(40):
        carry(writer.beat(), OWN)
    assert sorted(came) == sent
    assert writer.beat() == []  # all are acknowledged


def test_an_answer_for_one_reader_is_a_gap_for_the_others() -> None:
    writer = services._Writer(WRITER)
    for guid in (OTHER + READER, OWN + READER):
        writer.match(guid, [("127.0.0.1", 1)])
    first, second = writer.add(b"secret!!", to={OWN + READER})
    assert b"secret" not in b"".join(first.parts)
    assert b"secret" in b"".join(second.parts)


def test_a_reader_that_does_not_answer_is_left_alone() -> None:
    writer = services._Writer(WRITER)
    writer.match(OTHER + READER, [("127.0.0.1", 1)])
    writer.add(b"0000")
    assert sum(len(writer.beat()) for _ in range(200)) == 50
    writer.add(b"0001")
    assert len(writer.beat()) == 1


@pytest.mark.parametrize("kind", sorted(kind for kind in FIELDS if "/srv/" in kind))
def test_cdr_comes_back(kind: str) -> None:
    need(modules=["cyclonedds"], how="make ros")
    fields = empty_fields(kind)
    data = idl.encode_message(Message(kind, fields))
    assert data[:4] == b"\0\1\0\0"
    assert idl.encode_message(Message(kind, idl.decode_message(kind, data))) == data
    with pytest.raises(ValueError, match=kind):
        idl.decode_message(kind, b"\0\1\0\0")


@pytest.fixture
def domain() -> int:
    return DOMAIN + 50 + os.getpid() % 100


@pytest.fixture
def served(domain: int) -> Iterator[Callable[[str, str], RequestQueue]]:
    need(modules=["cyclonedds"], how="make ros")
    made = ServiceServer(domain, local=True, warn=print)
    try:
        yield made.offer
    finally:
        made.close()


def asked_by_cyclonedds(
    domain: int, name: str, kind: str, request: Fields, service: RequestQueue, answer: Fields
) -> Fields:
    """Ask as rmw_cyclonedds does: 16 bytes, an id and a number, stand before the request and come back."""
    from cyclonedds.core import Policy, Qos
    from cyclonedds.idl import IdlStruct, make_idl_struct
    from cyclonedds.idl import types as of
    from cyclonedds.pub import DataWriter
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    def headed(part: str) -> Any:
        inner = idl.dds_type(f"{kind}_{part}")
        fields = {"guid": of.uint64, "number": of.int64, **inner.__annotations__}
        package, _, short = kind.split("/")
        assert issubclass(inner, IdlStruct)
        return make_idl_struct(f"Headed{part}", f"{package}::srv::dds_::{short}_{part}_", fields)

    network = Network(domain, local=True, warn=print)
    qos = Qos(Policy.Reliability.Reliable(10**8), Policy.History.KeepLast(10))
    wanted, given = headed("Request"), headed("Response")
    writer = DataWriter(network._participant, Topic(network._participant, f"rq{name}Request", wanted), qos=qos)
    reader = DataReader(network._participant, Topic(network._participant, f"rr{name}Reply", given), qos=qos)
    until = time.monotonic() + 20.0
    while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
        assert time.monotonic() < until, "the service was not found"
        time.sleep(0.01)
    inner = idl.dds_struct(f"{kind}_Request", request)
    writer.write(wanted(77, 5, **{field: getattr(inner, field) for field in request}))
    calls: list[Any] = []
    found: list[Any] = []
    while not found:
        assert time.monotonic() < until, "no answer came"
        for call in service.take():
            calls.append(call)
            call.answer(answer)
        found = reader.take(10)
        time.sleep(0.005)
    network.close()
    assert [idl.encode_message(Message(f"{kind}_Request", call.fields)) for call in calls] == [
        inner.serialize(use_version_2=False)
    ]
    assert (found[0].guid, found[0].number) == (77, 5)
    return idl.message_fields(f"{kind}_Response", found[0])


def test_a_client_of_cyclonedds_gets_its_answer(domain: int, served: Callable[[str, str], RequestQueue]) -> None:
    kind = "simulation_interfaces/srv/SetEntityState"
    service = served("/houseexpo/set_entity_state", kind)
    request = empty_fields(f"{kind}_Request") | {"entity": "robot2", "set_twist": True}
    request["state"]["pose"]["position"]["x"] = 2.5
    answer = {"result": {"result": 101, "error_message": "it does not fit"}}
    assert asked_by_cyclonedds(domain, "/houseexpo/set_entity_state", kind, request, service, answer) == answer


def test_a_large_answer_comes_in_parts(domain: int, served: Callable[[str, str], RequestQueue]) -> None:
    service = served("/houseexpo/load_map", "nav_msgs/srv/LoadMap")
    data = np.arange(500 * 400, dtype=np.int8).reshape(400, 500)
    grid = occupancy_grid_message(0, "map", OccupancyGrid(data, 0.05, (0.0, 0.0))).fields
    kind, answer = "nav_msgs/srv/LoadMap", {"map": grid, "result": 0}
    found = asked_by_cyclonedds(domain, "/houseexpo/load_map", kind, {"map_url": "x"}, service, answer)
    assert found["map"]["data"] == data.ravel().tolist()


def test_packets_of_others_do_no_harm(domain: int, served: Callable[[str, str], RequestQueue]) -> None:
    service = served("/houseexpo/reset", "std_srvs/srv/Empty")
    host = served.__self__  # type: ignore[attr-defined]
    rng = np.random.default_rng(3)
    good = rtps.build_message(
        OTHER, rtps.NOBODY,
        [rtps.build_data(rtps.SPDP_READER, rtps.SPDP_WRITER, 1, rtps.build_discovery_payload(
            [(rtps.PARTICIPANT_GUID, OTHER + rtps.PARTICIPANT),
             (rtps.META_LOCATOR, rtps.build_locator(("127.0.0.1", 9)))])),
         rtps.build_heartbeat(READER, WRITER, 1, 2**60, 3), rtps.build_gap(READER, WRITER, 1, 2**60)],
    )  # fmt: skip
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(good, host._address)
        for _ in range(2_000):
            packet = bytearray(good)
            for at in rng.integers(20, len(packet), rng.integers(1, 6)):
                packet[at] = rng.integers(256)
            sender.sendto(packet[: rng.integers(10, len(packet) + 1)], host._address)
    request = empty_fields("std_srvs/srv/Empty_Request")
    found = asked_by_cyclonedds(domain, "/houseexpo/reset", "std_srvs/srv/Empty", request, service, request)
    assert found == request


HEADER = b"RTPS\x02\x03\x00\x00" + OTHER


@pytest.mark.parametrize(
    "part",
    [
        b"\x0c\x01\x04\x00" + bytes(4),  # INFO_SOURCE with a short body
        b"\x0e\x01\x04\x00" + bytes(4),  # INFO_DESTINATION with one
        rtps.build_heartbeat(READER, WRITER, 1, 2**63 - 1, 3),
        rtps.build_heartbeat(READER, WRITER, 2**63 - 1, 2**63 - 1, 3),
    ],
)
def test_a_packet_that_no_participant_sends_is_refused(part: bytes) -> None:
    with pytest.raises(ValueError, match=r"too short|no writer counts to"):
        list(rtps.parse_submessages(HEADER + part, bytes(12)))


def test_a_packet_costs_itself_and_the_services_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    served = ServiceServer(DOMAIN + 40, local=True, warn=said.append)
    try:
        monkeypatch.setattr(rtps, "parse_submessages", lambda *_: 1 / 0)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for _ in range(3):
                sender.sendto(HEADER, served._address)
        ends = time.monotonic() + 5.0
        while not said and time.monotonic() < ends:
            time.sleep(0.01)
        assert said == ["ROS 2 services: ZeroDivisionError: division by zero: a packet was left out"]
        assert served._thread.is_alive()
    finally:
        served.close()


@pytest.mark.slow
def test_rclpy_asks_for_houses(tmp_path: Path) -> None:
    need(modules=["cyclonedds", "rclpy"], how="make ros")
    for plan in (HALL, LARGE):
        plan.save(tmp_path / f"{plan.id}.json")
    process = started(tmp_path, "--plan", "hall")
    try:
        found = answers(["large", "nowhere", "hall"] * 5)
    finally:
        said = ended(process)
    assert found["is_there"]
    assert found["services"]["/houseexpo/reset"] == ["std_srvs/srv/Empty"]
    assert found["services"]["/houseexpo/step_simulation"] == ["simulation_interfaces/srv/StepSimulation"]
    large, nowhere, hall = found["answers"][:3]
    assert found["answers"] == [large, nowhere, hall] * 5
    assert large == [0, *size_and_walls(LARGE)]  # it comes in parts
    assert hall == [0, *size_and_walls(HALL)]
    assert nowhere == [1, 0, 0, 0]
    assert "house large" in said


def size_and_walls(plan: FloorPlan) -> list[int]:
    """Return the width, height and occupied cells of the map of a plan, cells of 4 cm."""
    pixels, _ = occupancy_picture(plan, 0.04, 0.04, "world")
    return [pixels.shape[1], pixels.shape[0], int((pixels == WALL).sum())]
