"""Frames add up to the map, whichever are left out, and are small."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.pseudoslam.render.sight import Sight
from houseexpo.service.drive.messages import RobotReport, SentMap, encode_frame
from tests.builders.browsing import VALUES, frame_from, painted
from tests.builders.tries import tries

REPORT = RobotReport(7, 5, 3, 11, (1.5, 2.5, -0.5), 12.5, 0.25, 3.75)
NOTHING = Sight(np.empty(0), np.empty((0, 6)))


@tries(50)
@given(st.integers(0, 2**31), st.integers(1, 9), st.integers(1, 9), st.integers(1, 5))
def test_frames_add_up_to_the_map(seed: int, rows: int, cols: int, steps: int) -> None:
    rng = np.random.default_rng(seed)
    known, shown = np.zeros((rows, cols), np.uint8), np.zeros((rows, cols), np.uint8)
    sent = SentMap(known.shape)
    for _ in range(steps):
        change = rng.random((rows, cols)) < 0.3
        known[change] = rng.choice(VALUES, change.sum())
        painted(shown, frame_from(encode_frame(REPORT, sent.update(known), NOTHING)))
        assert np.array_equal(shown, known)


def test_a_frame_says_how_the_robot_does() -> None:
    sight = Sight(np.array([0.0, 31.25, 125.0]), np.array([[0.0, 4.0, 5.0, 6.0, 7.0, -8.0]]))
    found = frame_from(encode_frame(REPORT, SentMap((2, 2)).update(np.zeros((2, 2), np.uint8)), sight))
    assert found[:8] == (5, 3, 7, 11, (1.5, 2.5, -0.5), 12.5, 0.25, 3.75)
    assert found.rect == (0, 0, 0, 0)
    assert found.bodies.tolist() == [[0.0, 4.0, 5.0, 6.0, 7.0, -8.0]]
    assert found.ranges.tolist() == [0.0, 31.25, 125.0]


def test_only_the_rectangle_that_changed_is_sent() -> None:
    known = np.zeros((50, 60), np.uint8)
    sent = SentMap(known.shape)
    known[10, 20], known[12, 25] = 255, 127
    delta = sent.update(known)
    assert delta[:4] == (10, 20, 3, 6)
    assert len(sent.update(known).runs) == 0
