"""Read the source of a plan with the command that built it, and keep its record for the page Review.

R1  The command that built a house makes its record, in a separate process. The source is read once for all storeys of
    the house; after that, the page answers from memory. The process stays for a while with the source in memory, and
    makes the record again after further corrections.
R2  Only a command that this user ran in this place is run, as for a rebuild (``review.rebuild``).
R3  A record is valid for the file as it was, and for the statements about it at that time. For a house without a plan,
    or one that has no plan with what is said of its file, it is valid only for all statements at that time, since only
    the search can tell their effect.
R4  One source is read at a time. If reading fails, the page gets the reason and may ask again.
"""

from __future__ import annotations

import math
import os
import selectors
import subprocess
import tempfile
import time
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from threading import Lock
from typing import IO, Any, Final, TypeAlias

import msgspec
import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections import Correction
from houseexpo.corrections.apply import correct_plan
from houseexpo.corrections.draft import Space
from houseexpo.corrections.rooms import spaces_enclosed_by
from houseexpo.corrections.vocabulary import FILE_WORDS, WORDS
from houseexpo.dataset.source_records import LevelSource, PlanSource, Rings, SourceRecord, decode_source_record
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.grids.frame import plan_points_from_source, source_points_from_plan
from houseexpo.lru_cache import LruCache
from houseexpo.plan.ids import parts_of
from houseexpo.plan.model import shift_plan
from houseexpo.service.review.question import NAMED, WIDEST_WALL_M
from houseexpo.tolerances import GRID_M, MIN_DOOR_M

_Key: TypeAlias = tuple[str, bytes, tuple[int, int]]
"""A plan, what is said of its file, and the state of its file."""
READ_S: Final = 300.0
"""The most time for reading a source, seconds: as for a house in a build."""
_KEPT_SOURCES: Final = 8
_MOST_TRIED: Final = 1200
"""The most pairs of a room and a place to try, so that it takes a second at most: for example 30 of each."""
_BESIDE: Final = 0.75
"""Floors that are nearer to each other than this share of a room's height are no storeys above each other."""
_KEPT_EDGES: Final = 20_000
OF_EDGE_M: Final = 0.3
"""A wall this near to a room's edge is the wall of this edge, metres; a passage as well."""
_KEPT_WORKERS: Final = 2
"""Each holds a house in memory."""
_WORDS_SHOWN: Final = 400


class SourceError(ConfigError):
    """A source cannot be shown; the message says why."""


class NoSuchLevelError(SourceError):
    """A source was read, and has other levels than the one of the plan: to read it again is no help."""


@dataclass(frozen=True, eq=False)
class SourceView:
    """The source of a plan, or of a level without one (``plan`` is None). Coordinates are those of the plan, metres.

    A plan that is made of what a person says has those of the level: its origin would move with each word.
    """

    record: SourceRecord
    level: LevelSource
    found: PlanSource | None

    @cached_property
    def plan(self) -> FloorPlan | None:
        """The plan without the words of its storey, or with them if the search finds none without (``is_founded``)."""
        if self.found is None:
            return None
        plan = decode(bytes(self.found.plan))
        return shift_plan(plan, *self.origin_of(plan)) if self.is_founded else plan

    @property
    def is_founded(self) -> bool:
        """Whether the plan includes the words of its storey."""
        return self.found is not None and self.found.is_founded

    @property
    def why_no_plan(self) -> str:
        """The reason why the source gives no plan, "" if it gives one or several."""
        return "" if self.level.plans else self.level.rejected or self.record.rejected

    @cached_property
    def origin(self) -> tuple[float, float]:
        """The plan's origin (x, y) in the level's frame, metres."""
        return self.origin_of(self.plan)

    def origin_of(self, plan: FloorPlan | None) -> tuple[float, float]:
        """Return the origin (x, y) of a plan of the level in the level's frame, metres; (0, 0) for None."""
        if plan is None or plan.frame is None:
            return 0.0, 0.0
        there = source_points_from_plan(plan.frame, np.zeros((1, 2)))
        x, y = np.round(plan_points_from_source(self.level.frame, there)[0], 4).tolist()
        return x, y

    @cached_property
    def spaces(self) -> tuple[Space, ...]:
        """The spaces between walls; spaces that nothing led into come first."""
        if self.found is None:
            return ()
        unreached = [Space(shape, reachable=False) for shape in self._moved(self.found.unreached)]
        return (*unreached, *map(Space, self._moved(self.found.spaces)))

    @cached_property
    def rooms_elsewhere(self) -> list[Polygon]:
        """The rooms of the other plans at this height: of buildings, and of wings half a storey higher or lower."""
        beside = [level for level in self.record.levels if level.id != self.level.id and self._is_beside(level)]
        found = [each for level in (self.level, *beside) for each in level.plans if each is not self.found]
        plans = [decode(bytes(each.plan)) for each in found]
        ahead = [np.subtract(self.origin_of(plan), self.origin) for plan in plans]
        return [
            shapely.transform(room.polygon, lambda points, by=by: points + by)
            for plan, by in zip(plans, ahead, strict=True)
            for room in plan.rooms
        ]

    def _is_beside(self, level: LevelSource) -> bool:
        """Return whether the rooms of one of two levels, this one and another, reach well above the other's floor."""
        low, high = sorted((self.level, level), key=lambda each: each.frame.floor)
        return high.frame.floor - low.frame.floor < _BESIDE * low.ceiling_m

    @cached_property
    def enclosed(self) -> list[Polygon]:
        """The spaces that the walls and whatever may close their gaps enclose beside the rooms of the plan."""
        if self.plan is None:
            return []
        floor = [*(room.polygon for room in self.plan.rooms), *(door.polygon for door in self.plan.doors)]
        return spaces_enclosed_by(shapely.union_all([*self.standing, *floor]))

    @cached_property
    def standing(self) -> list[Polygon]:
        """The walls, and whatever may close their gaps."""
        return [] if self.found is None else self._moved(self.found.standing)

    def standing_in(self, plan: FloorPlan | None) -> list[Polygon]:
        """Return ``standing`` in the coordinates of a plan of the level; the walls of a level without a plan."""
        if self.found is None:
            return self._moved(self.level.edges)
        shift = np.subtract(self.origin, self.origin_of(plan))
        return [shapely.transform(shape, lambda points: points + shift) for shape in self.standing]

    @cached_property
    def walls(self) -> list[Polygon]:
        """The walls that the source shows."""
        return [] if self.found is None else self._moved(self.found.walls)

    @cached_property
    def lines(self) -> list[LineString]:
        """The straight lines of the drawing."""
        pairs = [pair for each in self.level.strokes for pair in pairwise(np.subtract(each.points, self.origin))]
        return list(shapely.linestrings(np.reshape(pairs, (-1, 2, 2))))

    @property
    def is_map(self) -> bool:
        """Whether the source is a robot's map."""
        return any(picture.name == "map" for picture in self.level.pictures)

    @cached_property
    def all_walls(self) -> BaseGeometry:
        """The walls that the source shows, as one shape."""
        walls = shapely.union_all(self.walls)
        shapely.prepare(walls)
        return walls

    @cached_property
    def near_walls(self) -> BaseGeometry:
        """The area within ``OF_EDGE_M`` of what the page shows as walls: a wall there is that of a room's edge."""
        lines = shapely.linestrings(np.reshape(self.level.seen_low, (-1, 2, 2)) - self.origin)
        shown = [*self.walls, *lines]
        area = shapely.union_all(shapely.buffer(shown, OF_EDGE_M, quad_segs=2))  # quicker than that of their union
        shapely.prepare(area)
        return area

    def is_open(self, line: LineString, room: Polygon, shift: Sequence[float] = (0.0, 0.0)) -> bool:
        """Return whether the source shows no wall between most of a line and a room beside it: under eaves, it does.

        ``shift`` leads from the source's plan to the plan of the line and the room, metres.
        """
        return self._shares_before(line, room, shift)[0] > 1 / 2

    def _shares_before(self, line: LineString, room: Polygon, shift: Sequence[float]) -> tuple[float, float]:
        """Return the shares of a line before which a room lies openly, and behind a wall of the source."""
        (ax, ay), (bx, by) = line.coords
        count = max(int(line.length / OF_EDGE_M), 1) * 3
        starts = np.array([(ax, ay)]) + (np.arange(count)[:, None] + 0.5) / count * (bx - ax, by - ay)
        way = np.array([ay - by, bx - ax]) / line.length
        free, shut = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
        for side in (way, -way):
            rays = shapely.linestrings(np.stack([starts, starts + side * WIDEST_WALL_M], axis=1))
            far = shapely.distance(shapely.points(starts), shapely.intersection(rays, room))
            meets = np.isfinite(far)
            ends = starts + far[:, None] * side
            between = shapely.linestrings((np.stack([starts, ends], axis=1) - np.array(shift))[meets])
            is_clear = shapely.length(shapely.intersection(between, self.all_walls)) < GRID_M
            free[meets] |= is_clear
            shut[meets] |= ~is_clear
        return float(free.mean()), float((shut & ~free).mean())

    @cached_property
    def computed(self) -> LruCache[Any]:
        """What was computed of edges of rooms, by their points: an answer changes few rooms."""
        return LruCache(_KEPT_EDGES)

    @cached_property
    def pictured(self) -> tuple[float, float, float, float]:
        """The bounds (x1, y1, x2, y2) of the pictures in the level's frame, metres."""
        boxes = np.array([picture.bounds for picture in self.level.pictures] or [(0.0, 0.0, 10.0, 10.0)])
        return (*boxes[:, :2].min(axis=0).tolist(), *boxes[:, 2:].max(axis=0).tolist())

    @cached_property
    def _bounds(self) -> tuple[float, float, float, float]:
        """The bounds of the pictures and of the drawing's lines, as ``pictured``."""
        points = [np.reshape(self.pictured, (2, 2)), *(np.asarray(each.points) for each in self.level.strokes)]
        there = np.concatenate(points)
        return (*there.min(axis=0).tolist(), *there.max(axis=0).tolist())

    def bounds_around(self, plan: FloorPlan | None) -> tuple[float, float, float, float]:
        """Return the bounds (x1, y1, x2, y2) of what is shown in the coordinates of a plan of the level, metres."""
        x, y = self.origin if plan is None else self.origin_of(plan)
        x1, y1, x2, y2 = self._bounds
        return x1 - x, y1 - y, x2 - x, y2 - y

    @cached_property
    def places(self) -> list[tuple[str, list[list[float]]]]:
        """The places where a door may be: the kind and the jambs of each, in metres of the plan."""
        return [(place.kind, (np.array(place.ends) - self.origin).round(3).tolist()) for place in self.level.places]

    @cached_property
    def _offered(self) -> list[tuple[str, list[list[float]]]]:
        """The places that the page offers."""
        rooms = [] if self.plan is None else [room.polygon for room in self.plan.rooms]

        def is_before_wall(line: LineString) -> bool:
            near = shapely.dwithin(rooms, line.centroid, WIDEST_WALL_M)
            return any(self._shares_before(line, rooms[k], (0.0, 0.0))[1] > 1 / 2 for k in np.flatnonzero(near))

        return [
            (kind, ends)
            for kind, ends in self.places
            if self._takes(ends) and (kind in NAMED or not is_before_wall(LineString(ends)))
        ]

    def drawn_under(self, plan: FloorPlan | None) -> dict[str, Any]:
        """Return the layers under a plan of the level, in that plan's metres; corrections may move a plan's origin."""
        origin = self.origin if plan is None else self.origin_of(plan)
        (x, y), ahead = origin, np.subtract(self.origin, origin)
        frame = self.level.frame if plan is None else plan.frame
        return {
            "frame": None if frame is None else frame.matrix,
            "layers": [
                {"name": each.name, "title": each.title, "png": msgspec.to_builtins(each.png),
                 "box": [each.bounds[0] - x, each.bounds[1] - y, each.bounds[2] - x, each.bounds[3] - y]}
                for each in self.level.pictures
            ],
            "edges": [(np.array(ring) - (x, y)).round(3).tolist() for wall in self.level.edges for ring in wall],
            "places": [
                {"kind": kind, "ends": (np.array(ends) + ahead).round(3).tolist()}
                for kind, ends in self._offered
            ],
            "strokes": [
                {"kind": each.kind, "points": (np.array(each.points) - (x, y)).round(3).tolist()}
                for each in self.level.strokes
            ],
            "parts": [
                {"name": name, "box": [x1 - x, y1 - y, x2 - x, y2 - y]}
                for name, (x1, y1, x2, y2) in self.level.parts
            ],
            "is_solid": self.level.solid is not None,
            "side": msgspec.to_builtins(self.record.side),
        }  # fmt: skip

    def solid_over(self, plan: FloorPlan | None) -> dict[str, Any]:
        """Return the level's triangles, and the origin (x, y) of a plan of it in their metres; {} if it has none."""
        if self.level.solid is None:
            return {}
        origin = self.origin if plan is None else self.origin_of(plan)
        return {"origin": origin, **msgspec.to_builtins(self.level.solid)}

    def _takes(self, ends: list[list[float]]) -> bool:
        """Return whether a door at a place would have an effect; a large plan is not checked."""
        plan = self.plan
        if plan is None or plan.frame is None or len(plan.rooms) * len(self.places) > _MOST_TRIED:
            return True
        a, b = source_points_from_plan(plan.frame, ends).round(3).tolist()
        if math.dist(a, b) < MIN_DOOR_M:
            return False
        (effect,) = correct_plan(plan, [Correction("door", (tuple(a), tuple(b)))], self.spaces, measure=False).effects
        return effect.outcome != "none" or effect.waits

    def _moved(self, shapes: Iterable[Rings]) -> list[Polygon]:
        found = [Polygon(rings[0], rings[1:]) for rings in shapes if rings]
        moved = [shapely.transform(shape, lambda points: points - self.origin) for shape in found]
        parts = [part for shape in moved for part in shapely.get_parts(shapely.make_valid(shape))]  # rings are rounded
        return [part for part in parts if isinstance(part, Polygon)]


class Sources:
    """The records of one data set's houses; threads may share it."""

    def __init__(self, commands: Callable[[], Sequence[Sequence[str]]]) -> None:
        """``commands`` returns the commands of the builds that made the data set, or raises ConfigError (R2)."""
        self._commands = commands
        self._views: LruCache[SourceView] = LruCache(_KEPT_SOURCES)
        self._latest: dict[str, tuple[bytes, SourceView]] = {}
        self._read: dict[str, tuple[Mapping[str, Any], SourceRecord, tuple[int, int]]] = {}
        """The latest records by input, each with the statements and the state of the file at that time."""
        self._asked: dict[str, str] = {}
        """The storey for which the file of a storey was read: its process has the file in memory."""
        self._failed: dict[_Key, SourceError] = {}
        self._reading = Lock()
        self._workers = _Workers()

    def known(self, name: str, tables: Mapping[str, Any], *, is_plan: bool) -> SourceView | None:
        """Return the source of a plan if it has been read with the current statements, else None."""
        found = self._views.get(self._key(name, tables, is_plan=is_plan))
        if found is None and is_plan and (storey := self._of_read_file(name, tables)) is not None:
            found = self._keep(name, tables, storey, is_plan=is_plan)
        return found

    def _of_read_file(self, name: str, tables: Mapping[str, Any]) -> SourceView | None:
        """Return the source of a storey whose file was read for another one, with the same statements, or None (R1)."""
        for then, record, state in [*self._read.values()]:
            ids = {each for level in record.levels for each in (level.id, *(plan.id for plan in level.plans))}
            if name not in ids:
                continue
            view = _view(record, name)
            is_same = _key(name, tables, is_plan=True) == _key(name, then, is_plan=True)
            if is_same and view.found is not None and not view.is_founded and state == _state_of(record):
                return view
        return None

    def _keep(self, name: str, tables: Mapping[str, Any], view: SourceView, *, is_plan: bool) -> SourceView:
        self._latest.pop(name, None)
        latest = _key(name, tables, is_plan=True)[1], view
        self._latest = dict([*self._latest.items(), (name, latest)][-_KEPT_SOURCES:])
        return self._views.get_or_make(self._key(name, tables, is_plan=is_plan), lambda: view)

    def latest_with(self, name: str, tables: Mapping[str, Any], *, is_plan: bool) -> SourceView | None:
        """Return the source to show while it is read again: None where the search finds a plan, as far as is known."""
        return None if is_plan and self._is_found(name, tables) else self.latest(name)

    def latest(self, name: str) -> SourceView | None:
        """Return the source of a plan as last read, even if statements have changed since, or None."""
        return self._latest[name][1] if name in self._latest else None

    def is_read_with(self, name: str, tables: Mapping[str, Any]) -> bool:
        """Return whether the source was read last with what is said of the file now; words of storeys do not matter."""
        return name in self._latest and self._latest[name][0] == _key(name, tables, is_plan=True)[1]

    def why_not(self, name: str, tables: Mapping[str, Any], *, is_plan: bool) -> SourceError | None:
        """Return why reading the source failed, None if it succeeded or was not tried."""
        return self._failed.get(self._key(name, tables, is_plan=is_plan))

    def _is_found(self, name: str, tables: Mapping[str, Any]) -> bool:
        """Return whether the search finds a plan without the words of its storey, as far as is known.

        What was read with other statements about the file tells nothing: an undo may have taken them back.
        """
        said = _key(name, tables, is_plan=True)
        latest = (
            self.latest(name)
            if self.is_read_with(name, tables)
            else self._views.get((*said, self._state_of_file(name)))
        )
        return latest is None or (latest.found is not None and not latest.is_founded)

    def _key(self, name: str, tables: Mapping[str, Any], *, is_plan: bool) -> _Key:
        """R3."""
        said = _key(name, tables, is_plan=is_plan and self._is_found(name, tables))
        return *said, self._state_of_file(name)

    def _state_of_file(self, name: str) -> tuple[int, int]:
        """Return the time and the size of the file of a plan, zeros if it is not known yet, or not there."""
        latest = self.latest(name)
        return (0, 0) if latest is None else _state_of(latest.record)

    def read(self, name: str, tables: Mapping[str, Any], *, is_plan: bool) -> SourceView:
        """Return the source of a plan; reading it takes seconds unless it is in memory.

        Raises
        ------
        SourceError
            The source cannot be read.
        """
        with self._reading:  # R4
            if (known := self.known(name, tables, is_plan=is_plan)) is not None:
                return known
            key = self._key(name, tables, is_plan=is_plan)
            try:
                record = self._record(name)
                view = _view(record, name)
            except ConfigError as error:
                failure = error if isinstance(error, SourceError) else SourceError(str(error))
                self._failed[key] = failure
                raise failure from None
            self._failed.pop(key, None)
            self._read.pop(record.id, None)
            read = tables, record, _state_of(record)
            self._read = dict([*self._read.items(), (record.id, read)][-_KEPT_WORKERS:])
            for each in record.levels:
                self._asked |= dict.fromkeys((each.id, *(plan.id for plan in each.plans)), self._asked.get(name, name))
            return self._keep(name, tables, view, is_plan=is_plan)

    def _record(self, name: str) -> SourceRecord:
        why = ""
        for command in reversed(self._commands()):
            asked = (*command[:5], f"--show-source={self._asked.get(name, name)}", *command[5:])
            try:
                return decode_source_record(self._workers.ask(asked))
            except TimeoutError:
                raise SourceError(f"{name}: reading its source took more than {READ_S:.0f} s") from None
            except OSError as error:
                why = error.strerror or str(error)
            except msgspec.DecodeError:
                raise SourceError(f"{name}: its source was read by another version; restart the service") from None
        raise SourceError(f"{name}: its source cannot be shown: {why[:_WORDS_SHOWN] or 'nothing was said'}")


class _Workers:
    """The processes that have read a source, the latest few (R1)."""

    def __init__(self) -> None:
        self._running: dict[tuple[str, ...], tuple[subprocess.Popen[bytes], IO[bytes]]] = {}
        weakref.finalize(self, _end_all, self._running)

    def ask(self, command: tuple[str, ...]) -> bytes:
        """Return the next line from a command's process; start the process if it does not run.

        Raises
        ------
        TimeoutError
            The process takes more than ``READ_S``.
        OSError
            The process cannot be started, or ends without a line; the message is the end of its output.
        """
        said: IO[bytes]
        known = self._running.pop(command, None)
        if known is not None and known[0].poll() is not None:
            _end(*known)
            known = None
        if known is None:
            while len(self._running) >= _KEPT_WORKERS:
                _end(*self._running.pop(next(iter(self._running))))
            said = tempfile.TemporaryFile()  # noqa: SIM115  # lives as long as the process
            try:
                worker = subprocess.Popen(  # noqa: S603  # a command that this user ran (R2)
                    command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=said, bufsize=0
                )
            except OSError:
                said.close()
                raise
        else:
            worker, said = known
            assert worker.stdin is not None  # noqa: S101  # a pipe
            with suppress(BrokenPipeError):
                worker.stdin.write(b"\n")
        try:
            line = _line(worker, READ_S)
        except TimeoutError:
            _end(worker, said)
            raise
        if not line.endswith(b"\n"):
            worker.wait()
            said.seek(0)
            words = said.read().decode(errors="replace").strip().splitlines()[-1:]
            _end(worker, said)
            raise OSError(words[0] if words else "")
        self._running[command] = worker, said
        return line


def _line(worker: subprocess.Popen[bytes], within_s: float) -> bytes:
    """Return a process's next line, or its output up to its end; raise TimeoutError after ``within_s``."""
    assert worker.stdout is not None  # noqa: S101  # a pipe
    until, found = time.monotonic() + within_s, bytearray()
    with selectors.DefaultSelector() as ready:
        ready.register(worker.stdout, selectors.EVENT_READ)
        while not found.endswith(b"\n"):
            if not ready.select(max(until - time.monotonic(), 0.0)):
                raise TimeoutError
            part = os.read(worker.stdout.fileno(), 1 << 20)
            if not part:
                break
            found += part
    return bytes(found)


def _end(worker: subprocess.Popen[bytes], said: IO[bytes]) -> None:
    worker.kill()
    worker.wait()
    for pipe in (worker.stdin, worker.stdout, said):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()


def _end_all(running: dict[tuple[str, ...], tuple[subprocess.Popen[bytes], IO[bytes]]]) -> None:
    while running:
        _end(*running.popitem()[1])


def _state_of(record: SourceRecord) -> tuple[int, int]:
    """Return the time and the size of a record's file, zeros if it has none, or it is not there."""
    with suppress(OSError):
        if record.path:
            found = Path(record.path).stat()
            return found.st_mtime_ns, found.st_size
    return 0, 0


def _area(found: PlanSource) -> float:
    return decode(bytes(found.plan)).area


def _view(record: SourceRecord, name: str) -> SourceView:
    """Return the view of a plan, or of a house without one: of the largest of the plans that were found since."""
    ids = {name, parts_of(name).without_digits}
    for level in record.levels:
        for plan in level.plans:
            if plan.id in ids:
                return SourceView(record, level, plan)
    for level in record.levels:
        is_all = len(record.levels) == 1 and (record.id in ids or not level.plans)
        if level.id in ids or is_all:
            return SourceView(record, level, max(level.plans, key=_area, default=None))
    if not record.levels:
        why = f": {record.rejected}" if record.rejected else ""
        raise SourceError(f"{name}: the file as it is read now has no levels{why}")
    levels = ", ".join(level.id for level in record.levels)
    raise NoSuchLevelError(
        f"{name}: the file as it is read now has no such level. It has {levels}, of which the next build (B) makes "
        "plans; U takes back what you said last"
    )


def _key(name: str, tables: Mapping[str, Any], *, is_plan: bool) -> tuple[str, bytes]:
    """R3."""
    said: dict[str, Any] = {}
    for place, table in sorted(tables.items()):
        if isinstance(table, dict) and name.startswith(place):
            words = (*FILE_WORDS, "keep", *(() if is_plan else WORDS))
            said[place] = {word: table[word] for word in words if word in table}
    return name, msgspec.json.encode({place: table for place, table in said.items() if table})
