"""A robot and its browser: what comes in moves it, what changes goes out, thirty times a second.

R1  A browser says which frames it has drawn. Where it is behind by a few, the robot waits: nothing piles up, and it
    goes on where the person saw it last. A frame holds all that changed since the last one, however long that is ago.
R2  A browser that has drawn nothing for ten seconds, takes none of what is sent, or is left alone for a quarter of an
    hour, is gone: the socket is closed, and the robot with it.
R3  A message that is none of ``messages`` is answered with the reason, and the socket is closed.
R4  A step by hand takes a millisecond or two and is taken at once: handing it to a thread costs half as much again. A
    robot is set down, explores and is saved in threads, as many as there are cores.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final, TypeVar

import anyio
import anyio.to_thread
import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.service.drive.frames import SAVED
from houseexpo.service.drive.messages import FRAMES_PER_S, YOU, Move, Pace, Save, Seen, Start, read
from houseexpo.service.drive.robots import Robot

WINDOW: Final = 6
"""So many frames may be on their way: a fifth of a second."""
BEHIND: Final = 3
"""So many frames are made up for where the machine was busy."""
GONE_S: Final = 10.0
LEFT_ALONE_S: Final = 900.0
MAX_MESSAGES_A_S: Final = 200
STEPS_PER_S: Final = 10.0

REFUSED: Final = 1008
FULL: Final = 1013
ENDED: Final = 1000
BROKEN: Final = 1011
Answer = TypeVar("Answer")


class _EndError(Exception):
    """The session ends; with what is said to the browser, and the socket's code."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.text, self.code = text, code


class Session:
    """One socket; ``plan_of`` finds a plan by its id, ``threads`` is how many robots move at once."""

    def __init__(self, socket: WebSocket, plan_of: Callable[[str], FloorPlan], threads: anyio.CapacityLimiter) -> None:
        self._socket, self._plan_of, self._threads = socket, plan_of, threads
        self._turn, self._sending = anyio.Lock(), anyio.Lock()
        self._move = Move(0.0, 0.0)
        self._steps_per_s = STEPS_PER_S
        self._number, self._seen = 0, 0
        self._heard_s = self._seen_s = time.monotonic()
        self._messages: tuple[int, int] = (0, 0)  # (second, how many in it)

    async def run(self) -> None:
        """Serve the socket until either side has had enough; it is closed then."""
        try:
            await self._serve()
        except _EndError as end:
            await self._close(end.text, end.code)
        except WebSocketDisconnect:
            return
        except HouseExpoError as error:
            await self._close(str(error), REFUSED)

    async def _serve(self) -> None:
        start = None
        with anyio.move_on_after(GONE_S):
            start = await self._received()
        if not isinstance(start, Start):
            raise _EndError("message: expected a start first", REFUSED)
        robot = await self._in_thread(lambda: Robot(self._plan_of(start.plan), start))
        await self._send(msgspec.json.encode({"hello": robot.hello(), "driver": start.driver}).decode())
        self._heard_s = self._seen_s = time.monotonic()
        try:
            async with anyio.create_task_group() as group:
                group.start_soon(self._listen, robot)
                await self._show(robot, by_hand=start.driver == YOU)
        except BaseExceptionGroup as several:
            raise several.exceptions[0] from None

    async def _listen(self, robot: Robot) -> None:
        while True:
            message = await self._received()
            match message:
                case Move():
                    self._move, self._heard_s = message, time.monotonic()
                case Pace():
                    self._steps_per_s, self._heard_s = message.steps_per_s, time.monotonic()
                case Seen():
                    if message.number > self._number:
                        raise _EndError("message: a frame that was not sent cannot be seen", REFUSED)
                    self._seen, self._seen_s = max(self._seen, message.number), time.monotonic()
                case Save():
                    data = await self._in_turn(robot.saved)
                    await self._send(bytes([SAVED]) + data)
                case Start():
                    raise _EndError("message: a robot is set down already; open another socket for the next", REFUSED)

    async def _show(self, robot: Robot, *, by_hand: bool) -> None:
        """Move the robot and send frames (R1)."""
        due, first, owed = time.monotonic(), True, 0.0
        while True:
            now = time.monotonic()
            if now - self._heard_s > LEFT_ALONE_S:
                raise _EndError("Nobody drove for a quarter of an hour; set the robot down again.", ENDED)
            if self._number - self._seen >= WINDOW:
                if now - self._seen_s > GONE_S:
                    raise _EndError("The browser draws nothing any more.", ENDED)
            else:
                owed = min(owed + self._steps_per_s / FRAMES_PER_S, 1.0)
                steps = 1 if by_hand else int(owed)
                owed -= 0 if by_hand else steps
                work = self._step(robot, by_hand=by_hand, first=first, steps=steps)
                frame = await self._in_turn(work, quick=by_hand and not first)
                first = False
                if frame is not None:
                    self._number += 1
                    if self._number - self._seen == 1:
                        self._seen_s = time.monotonic()
                    await self._send(frame)
            due = max(due + 1 / FRAMES_PER_S, time.monotonic() - BEHIND / FRAMES_PER_S)
            await anyio.sleep(max(due - time.monotonic(), 0))

    def _step(self, robot: Robot, *, by_hand: bool, first: bool, steps: int) -> Callable[[], bytes | None]:
        move = self._move

        def work() -> bytes | None:
            changed = robot.move(move.linear, move.angular) if by_hand else steps > 0 and robot.explore()
            return robot.frame() if changed or first else None

        return work

    async def _in_turn(self, work: Callable[[], Answer], *, quick: bool = False) -> Answer:
        """Let the robot do something, one thing at a time; what is quick needs no other thread (R4)."""
        async with self._turn:
            return work() if quick else await self._in_thread(work)

    async def _in_thread(self, work: Callable[[], Answer]) -> Answer:
        return await anyio.to_thread.run_sync(work, limiter=self._threads)

    async def _received(self) -> Any:
        """Return the next message (R3)."""
        event = await self._socket.receive()
        if event["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(event.get("code", ENDED))
        second, count = self._messages
        now = int(time.monotonic())
        self._messages = (now, count + 1) if second == now else (now, 1)
        if self._messages[1] > MAX_MESSAGES_A_S:
            raise _EndError(f"message: expected at most {MAX_MESSAGES_A_S} a second, found more", REFUSED)
        text = event.get("text")
        if text is None:
            raise ConfigError("message: expected text, found bytes")
        return read(text)

    async def _send(self, data: bytes | str) -> None:
        """Send; a browser that takes nothing is gone (R2)."""
        async with self._sending:
            try:
                with anyio.fail_after(GONE_S):
                    await (self._socket.send_text(data) if isinstance(data, str) else self._socket.send_bytes(data))
            except (TimeoutError, RuntimeError, OSError):
                raise WebSocketDisconnect(BROKEN) from None

    async def _close(self, text: str, code: int) -> None:
        with anyio.move_on_after(GONE_S):
            try:
                await self._socket.send_text(msgspec.json.encode({"error": text}).decode())
                await self._socket.close(code, text.encode()[:120].decode(errors="ignore"))
            except (RuntimeError, OSError, WebSocketDisconnect):
                return
