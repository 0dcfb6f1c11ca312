"""Run the session of a robot and its browser: messages move the robot, frames show it, thirty times per second.

R1  A browser reports which frames it has drawn. If it is a few frames behind, the robot waits: frames do not pile up,
    and the robot continues where the person last saw it. A frame contains all changes since the last one.
R2  The session ends if the browser has drawn nothing for ten seconds, does not accept data, or receives no input for a
    quarter of an hour.
R3  An unknown message is answered with the reason, and the socket is closed.
R4  A step by hand takes one or two milliseconds and is taken at once, because handing it to a thread adds half of that.
    Robots are placed, explore, replay and are saved in threads, as many as there are cores.
R5  During long work, the browser is told what it is: kernels that are compiled once per machine, which may take a
    minute, or a large house.
R6  An explorer that was slow catches up for a third of a second, to keep the steps per second that were asked for. A
    person's robot does not, because it would move unseen.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

import anyio
import anyio.to_thread
import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.kernels.compiling import compiling_progress
from houseexpo.service.drive.messages import (
    FRAMES_PER_S,
    SAVED,
    FinishDrive,
    FrameDrawn,
    MoveRobot,
    SendPathAndMap,
    SetPace,
    StartDrive,
    decode_message,
)
from houseexpo.service.drive.robots import DrivenRobot

WINDOW: Final = 6
"""Frames that may be in transit: a fifth of a second."""
BEHIND: Final = 3
"""Frames that are made up for if the machine was busy."""
BEHIND_BY_ITSELF: Final = 10
"""The same for a robot that nobody drives (R6)."""
GONE_S: Final = 10.0
LEFT_ALONE_S: Final = 900.0
"""Seconds after which a silent browser and an unattended robot end the session (R2)."""
MAX_MESSAGES_A_S: Final = 200
STEPS_PER_S: Final = 30.0
TAKEN_OVER_STEPS_PER_S: Final = 5.0
"""Steps of an explorer's robot that a person drives: 1.5 m/s or 50 degrees per second."""
LONG_S: Final = 0.7
"""The browser is told about work that takes longer, seconds (R5)."""
TOLD_S: Final = 0.5

REFUSED: Final = 1008
FULL: Final = 1013
NORMAL_CLOSURE: Final = 1000
BROKEN: Final = 1011
Answer = TypeVar("Answer")


class _EndError(Exception):
    """The end of a session, with the text for the browser and the socket's code."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(text)
        self.text, self.code = text, code


class DriveSocket:
    """One socket; ``plan_of`` returns a plan by its id, ``threads`` limits the robots that move at once.

    ``policies`` are the server's own, see ``DrivenRobot``.
    """

    def __init__(
        self,
        socket: WebSocket,
        plan_of: Callable[[str], FloorPlan],
        threads: anyio.CapacityLimiter,
        policies: Mapping[str, str] | None = None,
    ) -> None:
        self._socket, self._plan_of, self._threads = socket, plan_of, threads
        self._policies = policies
        self._turn, self._sending = anyio.Lock(), anyio.Lock()
        self._move = MoveRobot(0.0, 0.0)
        self._steps_per_s = STEPS_PER_S
        self._number, self._seen = 0, 0
        self._heard_s = self._seen_s = time.monotonic()
        self._messages: tuple[int, int] = (0, 0)  # (second, how many in it)
        self._works_since_s: float | None = None
        self._is_finished = False

    async def run(self) -> None:
        """Serve the socket until one side ends the session, and close it."""
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
            first = await self._receive()
        if not isinstance(first, StartDrive):
            raise _EndError("message: expected a start first", REFUSED)
        try:
            async with anyio.create_task_group() as group:
                group.start_soon(self._explain)
                robot = await self._in_thread(lambda: self._place(first))
                await self._tell({"hello": robot.hello()})
                self._heard_s = self._seen_s = time.monotonic()
                group.start_soon(self._listen, robot)
                await self._show(robot)
        except BaseExceptionGroup as several:
            raise several.exceptions[0] from None

    def _place(self, first: StartDrive) -> DrivenRobot:
        return DrivenRobot(self._plan_of(first.plan), first, self._policies)

    async def _explain(self) -> None:
        """Report long work to the browser (R5)."""
        functions_before = compiling_progress().functions
        while True:
            await anyio.sleep(TOLD_S)
            since_s = self._works_since_s
            if since_s is not None and (seconds := time.monotonic() - since_s) > LONG_S:
                compiling = compiling_progress()
                told = {"compiling": compiling.is_busy, "functions": compiling.functions - functions_before}
                await self._tell({"preparing": {**told, "seconds": round(seconds, 1)}})

    async def _listen(self, robot: DrivenRobot) -> None:
        while True:
            message = await self._receive()
            match message:
                case MoveRobot():
                    self._move, self._heard_s = message, time.monotonic()
                case SetPace():
                    self._steps_per_s, self._heard_s = message.steps_per_s, time.monotonic()
                case FrameDrawn():
                    if message.number > self._number:
                        raise _EndError("message: this frame was not sent yet", REFUSED)
                    self._seen, self._seen_s = max(self._seen, message.number), time.monotonic()
                case SendPathAndMap():
                    data = await self._in_turn(robot.archive)
                    await self._send(bytes([SAVED]) + data)
                case FinishDrive():
                    await self._finish(robot)
                case StartDrive():
                    raise _EndError("message: there is a robot already; open another socket for the next one", REFUSED)

    async def _show(self, robot: DrivenRobot) -> None:
        """Move the robot and send frames (R1)."""
        due, first, owed = time.monotonic(), True, 0.0
        behind = BEHIND_BY_ITSELF if robot.goes_by_itself else BEHIND
        while True:
            now = time.monotonic()
            if now - self._heard_s > LEFT_ALONE_S:
                raise _EndError("Nobody drove for a quarter of an hour; start the robot again.", NORMAL_CLOSURE)
            if self._number - self._seen >= WINDOW:
                if now - self._seen_s > GONE_S:
                    raise _EndError("The browser has stopped drawing.", NORMAL_CLOSURE)
            else:
                steers = robot.goes_by_itself and bool(self._move.linear or self._move.angular)
                share = (TAKEN_OVER_STEPS_PER_S if steers else self._steps_per_s) / FRAMES_PER_S
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

    def _step(self, robot: DrivenRobot, steps: int, *, first: bool) -> Callable[[], bytes | None]:
        move = self._move

        def work() -> bytes | None:
            if robot.goes_by_itself and (move.linear or move.angular):
                changed = sum(robot.take_over(move.linear, move.angular) for _ in range(steps)) > 0
            elif robot.goes_by_itself:
                changed = sum(robot.advance() for _ in range(steps)) > 0
            else:
                changed = robot.move(move.linear, move.angular)
            return robot.frame() if changed or first else None

        return work

    async def _finish(self, robot: DrivenRobot) -> None:
        """Send the results, once."""
        if not self._is_finished:
            self._is_finished = True
            await self._tell({"finish": await self._in_turn(robot.finish)})

    async def _in_turn(self, work: Callable[[], Answer], *, quick: bool = False) -> Answer:
        """Call a method of the robot, one at a time; a quick one runs in this thread (R4)."""
        async with self._turn:
            return work() if quick else await self._in_thread(work)

    async def _in_thread(self, work: Callable[[], Answer]) -> Answer:
        self._works_since_s = time.monotonic()
        try:
            return await anyio.to_thread.run_sync(work, limiter=self._threads)
        finally:
            self._works_since_s = None

    async def _receive(self) -> Any:
        """Return the next message (R3)."""
        event = await self._socket.receive()
        if event["type"] == "websocket.disconnect":
            raise WebSocketDisconnect(event.get("code", NORMAL_CLOSURE))
        second, count = self._messages
        now = int(time.monotonic())
        self._messages = (now, count + 1) if second == now else (now, 1)
        if self._messages[1] > MAX_MESSAGES_A_S:
            raise _EndError(f"message: expected at most {MAX_MESSAGES_A_S} a second, found more", REFUSED)
        text = event.get("text")
        if text is None:
            raise ConfigError("message: expected text, found bytes")
        return decode_message(text)

    async def _tell(self, told: dict[str, Any]) -> None:
        await self._send(msgspec.json.encode(told).decode())

    async def _send(self, data: bytes | str) -> None:
        """Send data; end the session if the browser does not accept it (R2)."""
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
