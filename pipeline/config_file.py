"""Read a manifest, a TOML file with the sources of a build and the parameters that differ from the defaults.

::

    [build]                        # options on the command line take precedence
    sources = ["houses/", "procedural:300"]
    seed = 2019

    [planes]                       # one table for each stage, as in pipeline.config
    door_m = 0.25
"""

from __future__ import annotations

import difflib
import hashlib
import math
import os
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Literal

import msgspec

from houseexpo.configuration import config_from_mapping, convert_value, name_in_config_errors, read_toml
from houseexpo.dataset.manifest import manifest_path
from houseexpo.errors import ConfigError
from pipeline.config import ConnectivityConfig, PipelineConfig


@dataclass(frozen=True)
class BuildOptions:
    """The sources of a build, and how they are read.

    ``up``, ``units``, ``scale`` and ``storey_height`` (m) are for mesh files; "auto" means that they are detected.

    ``weights`` is a file of models that ``houseexpo fit`` wrote; "" for those that the program comes with.

    ``resolution`` is the side of a cell, in metres, of robots' maps that do not say it.

    ``units`` is auto, m, cm, mm, in, ft, or the length of a unit in metres; ``scale`` is 20 for a model at 1:20. A
    plan whose quality is below ``min_quality``, 0 to 1, is rejected. ``licence`` is the licence under which plans of
    the sources may be published (its SPDX identifier), and ``credit`` says whom to name; ``houseexpo release`` needs
    them. ``furnished``, 0 to 1, is the share of the made houses that get furniture. ``keep_stages`` keeps a picture
    of the stages beside each plan and does not change the plans.
    """

    sources: tuple[str, ...] = ()
    seed: int = 0
    limit: int | None = None
    up: Literal["auto", "y", "z"] = "auto"
    units: str = "auto"
    scale: float = 1.0
    storey_height: float | None = None
    resolution: float | None = None
    furniture: bool = False
    model_path: str = ""  # folders to look for Gazebo models in, divided as in PATH
    weights: str = ""
    min_quality: float = 0.0
    furnished: float = 0.0
    keep_stages: bool = False
    licence: str = ""
    credit: str = ""


@dataclass(frozen=True)
class LimitsConfig:
    """The limits of one house: processor time, s, and memory of its worker; a house that exceeds one is rejected."""

    seconds: float = 300.0
    memory_gb: float = 4.0


@dataclass(frozen=True)
class BuildConfig:
    """Everything that a build depends on, except its inputs."""

    build: BuildOptions = field(default_factory=BuildOptions)
    limits: LimitsConfig = field(default_factory=LimitsConfig)
    stages: PipelineConfig = field(default_factory=PipelineConfig)

    @property
    def planning(self) -> PipelineConfig:
        """The stages' parameters, with what the options say of them."""
        evidence = replace(self.stages.evidence, furniture=self.build.furniture or self.stages.evidence.furniture)
        return replace(self.stages, evidence=evidence)

    def parameters(self) -> dict[str, Any]:
        """Return the parameters that the plans depend on, as plain values to store and hash.

        Whether copies are kept and how long a house may take change no plan, so that a build with other words on them
        goes on with its plans. The default limits stand for all of them: earlier versions hashed them too.
        """
        options = asdict(self.build)
        names = ["seed", "up", "units", "scale", "storey_height", "furniture", "min_quality", "furnished"]
        if self.build.resolution is not None:  # newer than data sets whose plans name the hash of these
            names.append("resolution")
        chosen = {name: options[name] for name in names}
        stages = asdict(self.stages)
        del stages["dedupe"]["off"]
        stages["isolated"]["dwellings"] = False  # an option that went; plans made before have its hash
        if stages["connectivity"]["closed_spaces"] == ConnectivityConfig.closed_spaces:  # as new
            del stages["connectivity"]["closed_spaces"]
        if not self.stages.weights:
            del stages["weights"]
        return {"build": chosen, "limits": asdict(LimitsConfig()), **stages}

    def digest(self) -> str:
        """SHA-256 of the parameters, in hex digits."""
        return hashlib.sha256(msgspec.json.encode(self.parameters(), order="deterministic")).hexdigest()


_BESIDE = ("build", "limits", *(f"limits.{each.name}" for each in fields(LimitsConfig)))
"""Keys of a manifest that are no stage's."""


def find_manifest(given: Path) -> Path:
    """Return the path of a manifest, given as a file or as the bare name of one that comes with the project.

    Raises
    ------
    ConfigError
        There is no such file or name.

    Examples
    --------
    >>> find_manifest(Path("demo")).name
    'demo.toml'
    """
    if given.is_file():
        return given
    known = _bundled_manifests()
    if given.stem in known and given.name == str(given) == given.stem:
        return known[given.stem]
    near = difflib.get_close_matches(given.stem, known, n=1)
    advice = f"did you mean --config {near[0]}? Known by name: " if near else "check the path; known by name: "
    raise ConfigError(f"manifest {str(given)!r}: there is no such file; {advice}{', '.join(known)}")


def _bundled_manifests() -> dict[str, Path]:
    """Return the manifests of builds that come with the project, by name."""
    files = sorted(manifest_path("demo").parent.glob("*.toml"))
    return {file.stem: file for file in files if "." not in file.stem and "build" in read_toml(file)}


def load_config(path: Path) -> BuildConfig:
    """Read a manifest; relative sources and model folders start at the manifest's folder.

    Raises
    ------
    ConfigError
        The file cannot be read, has an unknown key, or gives a value of the wrong type.
    """
    tables = read_toml(path)
    own = {name: tables.pop(name) for name in ("build", "limits") if name in tables}
    with name_in_config_errors(path):
        if "weights" in tables:
            raise ConfigError('weights: expected a file, under [build]: weights = "mine.toml"')
        stages = config_from_mapping(PipelineConfig, tables, convert=convert_to_type, beside=_BESIDE)
        config = config_from_mapping(BuildConfig, own, convert=convert_to_type)
        for name in ("min_quality", "furnished"):
            if (share := getattr(config.build, name)) > 1:
                raise ConfigError(f"build.{name} = {share!r}: expected 0 to 1")
        for name, value in asdict(config.limits).items():
            if not value:  # the system takes a limit of 0 for none
                raise ConfigError(f"limits.{name} = {value!r}: expected a number above 0")
    sources = tuple(_from_here(source, path.parent) for source in config.build.sources)
    model_path = absolute_folders(config.build.model_path, path.parent)
    weights = str(path.parent.absolute() / config.build.weights) if config.build.weights else ""
    build = replace(config.build, sources=sources, model_path=model_path, weights=weights)
    return replace(config, build=build, stages=stages)


def absolute_folders(folders: str, here: Path) -> str:
    """Return a PATH-like list of folders with absolute paths; relative ones start at ``here``."""
    return os.pathsep.join(str(here.absolute() / folder) for folder in folders.split(os.pathsep) if folder)


def convert_to_type(value: Any, hint: Any, key: str) -> Any:
    """Convert a value of a manifest or of an override to its type; raise ConfigError if it is out of range.

    Numbers must be finite and not negative; integers other than seeds must be at least 1.
    """
    found = convert_value(value, hint, key)
    if isinstance(found, float) and not (math.isfinite(found) and found >= 0):
        raise ConfigError(f"{key} = {value!r}: expected a finite number of at least 0")
    if isinstance(found, int) and not isinstance(found, bool) and found < (0 if key.endswith("seed") else 1):
        raise ConfigError(f"{key} = {value!r}: expected at least {0 if key.endswith('seed') else 1}")
    return found


def _from_here(source: str, folder: Path) -> str:
    return source if source.startswith("procedural:") or "://" in source else str(folder / source)
