"""Let a person drive the robot of an environment by keys, show it on a screen, and save its map and trajectory."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from houseexpo.exports.encoding import encode_image as as_file
from houseexpo.exports.rasters import FREE, UNKNOWN, WALL, map_server_files
from houseexpo.files import make_folder, write_atomically
from houseexpo.pseudoslam.envs.single import PseudoSlamEnv
from houseexpo.pseudoslam.kernels import mapping
from houseexpo.pseudoslam.render.canvas import Image
from houseexpo.pseudoslam.render.picture import Shows, draw_episode
from houseexpo.pseudoslam.simulator import ACTIONS, Action
from houseexpo.words import count_noun

KEYS: Final[dict[str, Action]] = {
    "up": "forward", "w": "forward", "left": "left", "a": "left", "right": "right", "d": "right",
}  # fmt: skip
NAMES: Final[dict[str, str]] = {**KEYS, "down": "backward", "s": "backward"}
"""What the keys mean for a robot with a drive."""
COMMANDS: Final[dict[str, dict[str, tuple[float, float]]]] = {
    "differential": {"forward": (1.0, 0.0), "backward": (-1.0, 0.0), "left": (0.0, 1.0), "right": (0.0, -1.0)},
    "ackermann": {"forward": (1.0, 0.0), "backward": (-1.0, 0.0), "left": (1.0, 1.0), "right": (1.0, -1.0)},
}
"""The actions of drives by motion and name; a car turns only while it moves."""
HELP: Final = "arrows or w a d: drive   r: again   t: truth   q: quit"
FILES: Final = ("map.pgm", "map.png", "map.yaml", "trajectory.csv")
"""The files of a recorded drive."""
_KEY_WAIT_S = 0.5


class Screen(Protocol):
    """A display of a drive, such as ``terminal.Terminal``."""

    @property
    def most_px(self) -> tuple[int, int]:
        """Return the largest width and height of a picture, pixels."""

    def show(self, image: Image, caption: str = "") -> None:
        """Show a picture and a caption."""

    def keys(self, wait_s: float) -> list[str]:
        """Return the pressed keys, after waiting for one for at most ``wait_s`` seconds."""


class TrajectoryRow(NamedTuple):
    """A line of the trajectory; the first of an episode has no action."""

    step: int
    action: str
    x_m: float
    y_m: float
    heading_rad: float
    reward: float
    explored_m2: float


class DriveSession:
    """An episode that a person drives.

    ``rows`` is its trajectory; ``observation`` and ``info`` are the environment's latest.

    Parameters
    ----------
    env
        An environment with discrete actions, or of a robot with a drive.
    seed, options
        Arguments of the first ``reset``; later resets continue with the same generator.
    """

    def __init__(self, env: PseudoSlamEnv, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        self._env, self._options = env, options
        self._shows: Shows = "map"
        self._start_episode(seed)

    def _start_episode(self, seed: int | None = None) -> None:
        self.observation, self.info = self._env.reset(seed=seed, options=self._options)
        self.rows: list[TrajectoryRow] = []
        self._trail: list[npt.NDArray[np.float64]] = []
        self._ended = ""
        self._note("", 0.0)

    def _note(self, action: str, reward: float) -> None:
        x, y, heading = self.info["pose"].tolist()
        self.rows.append(TrajectoryRow(len(self.rows), action, x, y, heading, reward, self.info["explored_m2"]))
        self._trail.append(self._env.state.poses_px.copy())

    def press(self, key: str) -> None:
        """Perform the action of a key; do nothing if the key has no action or the episode has ended."""
        if key == "r":
            self._start_episode()
        elif key == "t":
            self._shows = "both" if self._shows == "map" else "map"
        elif not self._ended and (commands := COMMANDS.get(self._env.config.robot.motion)):
            if key in NAMES:
                self.act(np.array(commands[NAMES[key]], np.float32), NAMES[key])
        elif key in KEYS and not self._ended:
            self.act(ACTIONS.index(KEYS[key]), KEYS[key])

    def act(self, action: Any, name: str) -> None:
        """Take an action of the environment; ``name`` is its name in the trajectory."""
        self.observation, reward, terminated, truncated, self.info = self._env.step(action)
        self._note(name, reward)
        if terminated or truncated:
            self._ended = "done: " if self.info["is_success"] else "over: "

    def picture(self, most_px: tuple[int, int]) -> Image:
        """Return a picture of the current state."""
        return draw_episode(self._env.simulator, self._env.state, self._trail, most_px=most_px, shows=self._shows)

    @property
    def caption(self) -> str:
        """Return one line on the state of the episode, and one on the keys."""
        info, rewards = self.info, [row.reward for row in self.rows]
        bumps = count_noun(info["collisions"], "collision")
        hit = ", bump!" if info["collided"] else ""
        return (
            f"{self._ended}step {len(rewards) - 1}: {info['coverage']:.0%} seen, {info['explored_m2']:.1f} m², "
            f"{bumps}, reward {rewards[-1]:+.2f} of {sum(rewards):+.2f}{hit}\n{HELP}"
        )

    @property
    def ended(self) -> bool:
        """Whether the episode has ended."""
        return bool(self._ended)

    def files(self) -> dict[str, bytes]:
        """Return trajectory.csv, the map for ROS (map.pgm, map.yaml) and a picture of it (map.png), by name."""
        state, frame = self._env.state, self._env.simulator.world.frame
        shades = np.full(256, UNKNOWN, np.uint8)
        shades[[mapping.FREE, mapping.OBSTACLE]] = FREE, WALL
        files = map_server_files("map", shades[state.known], frame.cell_m, (*frame.origin_m, 0.0))
        files["map.png"] = as_file(self.picture((1600, 1200)), "PNG")
        stream = io.StringIO(newline="")
        csv.writer(stream, lineterminator="\n").writerows([TrajectoryRow._fields, *self.rows])
        files["trajectory.csv"] = stream.getvalue().encode()
        return files

    def save(self, folder: Path, write: Callable[[Path, bytes], object] = write_atomically) -> list[Path]:
        """Write ``files`` into a folder and return their paths."""
        files = self.files()
        make_folder(folder)
        for name, data in files.items():
            write(folder / name, data)
        return [folder / name for name in sorted(files)]


def drive_by_keys(session: DriveSession, screen: Screen) -> None:
    """Show a drive and perform the actions of keys until "q" or Ctrl-C is pressed."""
    size, keys = (0, 0), [""]
    try:
        while "q" not in keys:
            for key in keys:
                session.press(key)
            if keys or screen.most_px != size:
                size = screen.most_px
                screen.show(session.picture(size), session.caption)
            keys = screen.keys(_KEY_WAIT_S)
        for key in keys[: keys.index("q")]:
            session.press(key)
    except KeyboardInterrupt:
        return
