"""Maps as houses: the same world as that of a plan with the same cells, at the map's own resolution or another."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids import read_map
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam import MapHouse, PeopleConfig, Simulator, SimulatorConfig, map_house, open_maps
from houseexpo.pseudoslam.config import LaserConfig
from houseexpo.pseudoslam.worlds.cache import world_for
from houseexpo.pseudoslam.worlds.maps import open_houses
from tests.builders.commands import call

HUT = FloorPlan("hut", [(0, 0), (0, 4), (2, 4), (2, 6), (7, 6), (7, 0), (3, 0), (3, 1), (2.5, 1), (2.5, 0)], 2, {})
CONFIG = SimulatorConfig(pixels_per_metre=20.0, laser=LaserConfig(range_m=3.0, fov_deg=270.0))


def map_of_hut() -> MapHouse:
    """Return the cells of the hut's world, as a map whose border is left off."""
    world = world_for(HUT, CONFIG)
    x_m, y_m = world.frame.origin_m
    return map_house(world.occupied[1:-1, 1:-1] > 0, 0.05, origin_m=(x_m + 0.05, y_m + 0.05), name="hut")


def test_scans_in_a_map_are_those_in_the_plan_rasterised_to_the_same_cells() -> None:
    of_plan, of_map = Simulator.of(HUT, CONFIG), Simulator.of(map_of_hut(), CONFIG)
    for name in ("occupied", "traversable", "observable"):
        assert np.array_equal(getattr(of_plan.world, name), getattr(of_map.world, name))
    assert of_map.world.frame.origin_m == pytest.approx(of_plan.world.frame.origin_m)
    one, other = (each.start(np.random.default_rng(3)) for each in (of_plan, of_map))
    for action in ["forward", "left", "forward", "left", "left", "right", "forward"] * 8:
        of_plan.step(one, action)  # type: ignore[arg-type]
        of_map.step(other, action)  # type: ignore[arg-type]
        assert np.array_equal(one.known, other.known)
        assert np.array_equal(one.pose_px, other.pose_px)
    assert of_plan.coverage(one) == of_map.coverage(other) > 0.2


def slowly_resampled(cells: np.ndarray, scale: float) -> np.ndarray:
    """R2, cell by cell."""
    rows, cols = (int(np.ceil(length * scale - 1e-6)) for length in cells.shape)
    found = np.zeros((rows, cols), np.uint8)
    for row, col in np.ndindex(rows, cols):
        if scale > 1:
            found[row, col] = cells[int((row + 0.5) / scale), int((col + 0.5) / scale)]
            continue
        for i in range(int(row / scale + 1e-6), int(np.ceil((row + 1) / scale - 1e-6))):
            for j in range(int(col / scale + 1e-6), int(np.ceil((col + 1) / scale - 1e-6))):
                inside = i < cells.shape[0] and j < cells.shape[1]
                found[row, col] |= cells[i, j] if inside else 1
    return found


@pytest.mark.parametrize("scale", [0.5, 1 / 3, 0.8, 0.29, 2.0, 1.25])
def test_resampling_keeps_every_wall_and_the_upper_left_corner(scale: float) -> None:
    cells = (np.random.default_rng(1).random((31, 44)) < 0.1).astype(np.uint8)
    house = MapHouse("noise", cells, GridFrame((2.0, -1.0), 10.0, (31, 44), y_up=True))
    other = house.resample(10.0 * scale)
    assert np.array_equal(other.occupied, slowly_resampled(cells, scale))
    corners = [each.frame.point_from_pixel(0.0, 0.0) for each in (house, other)]
    assert corners[0] == pytest.approx(corners[1])
    assert house.resample(10.0) is house


def test_unknown_cells_block_unless_they_are_said_to_be_free() -> None:
    cells = np.zeros((30, 30))
    cells[:, 15] = np.nan
    assert map_house(cells, 0.1).occupied[:, 15].all()
    assert not map_house(cells, 0.1, unknown="free").occupied.any()


def written(folder: Path) -> Path:
    """Write a map_server map of two rooms at 5 cm, and return its yaml."""
    cells = np.full((80, 120), 205, np.uint8)
    cells[10:70, 10:110] = 0
    cells[11:69, 11:109] = 254
    cells[11:69, 60] = 0
    cells[30:50, 60] = 254
    Image.fromarray(cells).save(folder / "flat.pgm")
    file = folder / "flat.yaml"
    file.write_text(
        "image: flat.pgm\nresolution: 0.05\norigin: [-3.0, -2.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return file


def test_an_environment_takes_a_map_and_keeps_its_cells(tmp_path: Path) -> None:
    file = written(tmp_path)
    for place in (file, tmp_path):  # the folder holds one map, whose picture is not a second one
        env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=str(place)).unwrapped
        _, info = env.reset(seed=1, options={"pose": (-1.0, 0.5, 0.0)})
        assert info["plan_id"] == "flat"
        assert info["pose"].tolist() == pytest.approx([-1.0, 0.5, 0.0])
        assert env.config.pixels_per_metre == 20.0
        assert env.simulator.world.occupied.shape == (80, 120)  # its border is unknown and blocks
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=file, config=SimulatorConfig(pixels_per_metre=10.0))
    env.reset(seed=1)
    assert env.unwrapped.simulator.world.occupied.shape == (40, 60)
    vector = gymnasium.make_vec("PseudoSLAM/Exploration-v0", 2, dataset=str(file))
    observations, _ = vector.reset(seed=[1, 2])
    alone = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=str(file))
    assert np.array_equal(observations[0], alone.reset(seed=1)[0])


def test_a_start_is_drawn_in_the_largest_free_piece() -> None:
    cells = np.zeros((40, 100), bool)
    cells[:, 30] = True
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=map_house(cells, 0.1))
    for seed in range(20):
        assert env.reset(seed=seed)[1]["pose"][0] > 3.1
    with pytest.raises(ConfigError, match="largest part"):
        env.reset(options={"pose": (1.0, 2.0, 0.0)})


def test_people_walk_in_a_map() -> None:
    config = SimulatorConfig(pixels_per_metre=10.0, people=PeopleConfig(2))
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=map_house(np.zeros((60, 60), bool), 0.1), config=config)
    env.reset(seed=0)
    assert env.step(0)[4]["coverage"] > 0


def test_maps_of_several_resolutions_need_a_configuration() -> None:
    houses = [map_house(np.zeros((40, 40), bool), side, name=f"{side}") for side in (0.1, 0.05)]
    with pytest.raises(ConfigError, match=r"maps of 10 \(0.1\) and 20 \(0.05\)"):
        gymnasium.make("PseudoSLAM/Exploration-v0", dataset=houses)
    gymnasium.make("PseudoSLAM/Exploration-v0", dataset=houses, config=CONFIG).reset(seed=0)


def test_bad_maps_are_refused_with_their_reason(tmp_path: Path) -> None:
    picture = tmp_path / "a.png"
    Image.fromarray(np.full((20, 20), 255, np.uint8)).save(picture)
    with pytest.raises(ConfigError, match=r"a\.png.*side of a cell"):
        open_maps(picture)
    with pytest.raises(ConfigError, match="side of a cell"):
        map_house(np.zeros((4, 4), bool))
    with pytest.raises(ConfigError, match="no free cell"):
        map_house(np.ones((4, 4), bool), 0.1)
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigError, match="found none"):
        open_maps(tmp_path / "empty")


def test_a_map_with_a_yaw_is_a_house_in_its_own_frame(tmp_path: Path) -> None:
    """The frame of the map is that of the poses: a free cell of the turned picture is free where the map has it."""
    file = written(tmp_path)
    straight = read_map(file)
    file.write_text(file.read_text().replace("0.0]", "0.5]"))
    (house,) = open_maps(file)
    free = np.argwhere(ndimage.binary_erosion(straight.free, iterations=3))
    places = read_map(file).points_from_pixels(free[:, ::-1] + 0.5)
    cells = house.frame.cells_from_points(places)
    assert len(free) > 100
    assert not house.occupied[cells[:, 0], cells[:, 1]].any()


def test_record_takes_a_map(tmp_path: Path) -> None:
    file, movie = written(tmp_path), tmp_path / "movie.gif"
    done = call("record", file, "--out", movie, "--steps", "3")
    assert "in plan flat" in " ".join(done.split())
    assert movie.stat().st_size > 1000


@pytest.mark.parametrize("found", [b"plans", bytearray(b"plans"), range(3), 5])
def test_what_holds_no_houses_is_no_data_set(found: object) -> None:
    with pytest.raises(ConfigError, match="dataset: expected a data set or its path"):
        open_houses(found)  # type: ignore[arg-type]
