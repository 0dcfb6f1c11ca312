"""A robot and its browser: what comes in moves it, what changes goes out, thirty times a second.

R1  A browser says which frames it has drawn. Where it is behind by a few, the robot waits: nothing piles up, and it
    goes on where the person saw it last. A frame holds all that changed since the last one, however long that is ago.
R2  A browser that has drawn nothing for ten seconds, takes none of what is sent, or is left alone for a quarter of an
    hour, is gone: the socket is closed, and the robot with it.
R3  A message that is none of ``messages`` is answered with the reason, and the socket is closed.
R4  A step by hand takes a millisecond or two and is taken at once: handing it to a thread costs half as much again. A
    robot is set down, explores, replays and is saved in threads, as many as there are cores.
R5  While something takes long, the browser is told what that is: kernels that are compiled once on a machine, which may
    take a minute, or a large house.
R6  An explorer that thought for long catches up, for a third of a second: it takes the steps a second that were asked.
    A person's robot does not: it would run on where nobody saw it.
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
from houseexpo.pseudoslam.kernels.compiling import compiling_now
from houseexpo.service.drive.frames import SAVED
from houseexpo.service.drive.messages import FRAMES_PER_S, Finish, Move, Pace, Replay, Save, Seen, Start, read
from houseexpo.service.drive.recordings import read_recording
from houseexpo.service.drive.robots import Robot

WINDOW: Final = 6
"""So many frames may be on their way: a fifth of a second."""
BEHIND: Final = 3
"""So many frames are made up for where the machine was busy."""
BEHIND_BY_ITSELF: Final = 10
"""The same of a robot that nobody drives (R6)."""
GONE_S: Final = 10.0
LEFT_ALONE_S: Final = 900.0
MAX_MESSAGES_A_S: Final = 200
STEPS_PER_S: Final = 30.0
LONG_S: Final = 0.7
"""What takes longer is explained to the browser (R5)."""
TOLD_S: Final = 0.5

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
        self._works_since_s: float | None = None
        self._is_finished = False

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
        first = None
        with anyio.move_on_after(GONE_S):
            first = await self._received()
        if not isinstance(first, Start | Replay):
            raise _EndError("message: expected a start or a replay first", REFUSED)
        try:
            async with anyio.create_task_group() as group:
                group.start_soon(self._explain)
                robot = await self._in_thread(lambda: self._set_down(first))
                await self._tell({"hello": robot.hello()})
                self._heard_s = self._seen_s = time.monotonic()
                group.start_soon(self._listen, robot)
                await self._show(robot)
        except BaseExceptionGroup as several:
            raise several.exceptions[0] from None

    def _set_down(self, first: Start | Replay) -> Robot:
        if isinstance(first, Start):
            return Robot(self._plan_of(first.plan), first)
        recording = read_recording(first.recording)
        return Robot(self._plan_of(recording.start.plan), recording.start, recording)

    async def _explain(self) -> None:
        """Say what takes so long, while something does (R5)."""
        functions_before = compiling_now().functions
        while True:
            await anyio.sleep(TOLD_S)
            since_s = self._works_since_s
            if since_s is not None and (seconds := time.monotonic() - since_s) > LONG_S:
                compiling = compiling_now()
                told = {"compiling": compiling.is_busy, "functions": compiling.functions - functions_before}
                await self._tell({"preparing": {**told, "seconds": round(seconds, 1)}})

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
                case Finish():
                    await self._finish(robot)
                case Start() | Replay():
                    raise _EndError("message: a robot is set down already; open another socket for the next", REFUSED)

    async def _show(self, robot: Robot) -> None:
        """Move the robot and send frames (R1)."""
        due, first, owed = time.monotonic(), True, 0.0
        behind = BEHIND_BY_ITSELF if robot.goes_by_itself else BEHIND
        while True:
            now = time.monotonic()
            if now - self._heard_s > LEFT_ALONE_S:
                raise _EndError("Nobody drove for a quarter of an hour; set the robot down again.", ENDED)
            if self._number - self._seen >= WINDOW:
                if now - self._seen_s > GONE_S:
                    raise _EndError("The browser draws nothing any more.", ENDED)
            else:
                share = self._steps_per_s / FRAMES_PER_S
                owed = min(owed + share, max(share, 1.0))
                steps = int(owed) if robot.goes_by_itself else 1
                owed -= steps if robot.goes_by_itself else 0
                work = self._step(robot, steps, first=first)
                frame = await self._in_turn(work, quick=not robot.goes_by_itself and not first)
                first = False
                if frame is not None:
                    self._number += 1
                    if self._number - self._seen == 1:
                        self._seen_s = time.monotonic()
                    await self._send(frame)
                if robot.ended:
                    await self._finish(robot)
            due = max(due + 1 / FRAMES_PER_S, time.monotonic() - behind / FRAMES_PER_S)
            await anyio.sleep(max(due - time.monotonic(), 0))

    def _step(self, robot: Robot, steps: int, *, first: bool) -> Callable[[], bytes | None]:
        move = self._move

        def work() -> bytes | None:
            if robot.goes_by_itself:
                changed = sum(robot.advance() for _ in range(steps)) > 0
            else:
                changed = robot.move(move.linear, move.angular)
            return robot.frame() if changed or first else None

        return work

    async def _finish(self, robot: Robot) -> None:
        """Send the figures, once."""
        if not self._is_finished:
            self._is_finished = True
            await self._tell({"finish": await self._in_turn(robot.finish)})

    async def _in_turn(self, work: Callable[[], Answer], *, quick: bool = False) -> Answer:
        """Let the robot do something, one thing at a time; what is quick needs no other thread (R4)."""
        async with self._turn:
            return work() if quick else await self._in_thread(work)

    async def _in_thread(self, work: Callable[[], Answer]) -> Answer:
        self._works_since_s = time.monotonic()
        try:
            return await anyio.to_thread.run_sync(work, limiter=self._threads)
        finally:
            self._works_since_s = None

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

    async def _tell(self, told: dict[str, Any]) -> None:
        await self._send(msgspec.json.encode(told).decode())

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
