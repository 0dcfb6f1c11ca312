from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from houseexpo.configuration import config_from_mapping, config_to_mapping, convert_value, read_config, read_toml
from houseexpo.errors import ConfigError


@dataclass(frozen=True)
class Circle:
    radius_m: float


@dataclass(frozen=True)
class Square:
    side_m: float = 1.0


@dataclass(frozen=True)
class Thing:
    shape: Circle | Square = Square()
    at: tuple[float, ...] = ()
    name: str | None = None
    is_fixed: bool = False


@dataclass(frozen=True)
class Scene:
    things: tuple[Thing, ...] = ()
    main: Thing = field(default_factory=Thing)


def test_what_is_written_is_read_again():
    scene = Scene((Thing(Circle(0.3), (1.0, 2.0)), Thing(name="post")), Thing(is_fixed=True))
    assert config_from_mapping(Scene, config_to_mapping(scene)) == scene
    assert config_to_mapping(scene)["things"][0]["shape"] == {"circle": {"radius_m": 0.3}}
    assert config_from_mapping(Scene, {}) == Scene()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"thing": 1}, "unknown key 'thing'; did you mean 'things'? Known: things, main"),
        ({"main": {"colour": 1}}, "unknown key 'main.colour'; known: main.shape, main.at"),
        ({"main": 3}, "main: expected a mapping of shape, at, name, is_fixed; found 3"),
        ({"main": {"shape": {}}}, "main.shape: expected one of circle, square; found 0 of them"),
        ({"main": {"shape": {"circle": {}}}}, "main.shape.circle.radius_m: expected a value, found none"),
        ({"things": 3}, "things: expected a list, found 3"),
        ({"things": [{"is_fixed": 1}]}, "things[0].is_fixed: expected true or false, found 1"),
    ],
)
def test_an_error_names_the_key(given, said):
    with pytest.raises(ConfigError) as caught:
        config_from_mapping(Scene, given)
    assert str(caught.value).startswith(said)


def test_types_are_checked_on_request(tmp_path):
    file = tmp_path / "square.toml"
    file.write_text("side_m = 2\n")
    assert isinstance(read_config(Square, file, convert=convert_value).side_m, float)
    file.write_text('side_m = "wide"\n')
    with pytest.raises(ConfigError, match=r"square.toml: side_m = 'wide': expected `float`, got `str`"):
        read_config(Square, file, convert=convert_value)
    file.write_bytes(b"side_m = \xd4")
    with pytest.raises(ConfigError, match=r"square.toml: expected TOML, found bytes that are no text in UTF-8$"):
        read_config(Square, file, convert=convert_value)
    file.write_text("side_m =")
    with pytest.raises(ConfigError, match=r"square.toml: expected TOML, found"):
        read_config(Square, file)


@pytest.mark.parametrize("text", ["a = " + "9" * 5000, "a = " + "[" * 5000, 'a = "\\uD800"', "\x00"])
def test_what_no_toml_reader_takes_is_refused_by_name(tmp_path, text):
    file = tmp_path / "a.toml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"a\.toml: expected TOML"):
        read_toml(file)
