"""Load policies by name, from a file (Python or trained weights), or from a module and function."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from traceback import extract_tb
from typing import Final

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.protocol import Interface, PolicyFactory, Training, read_interface, read_training
from houseexpo.words import suggest_name

_HERE: Final = "houseexpo.pseudoslam.agents"
NAMES: Final = {
    "random": f"{_HERE}.simple:RandomWalk",
    "spin": f"{_HERE}.simple:Spin",
    "forward": f"{_HERE}.simple:Forward",
    "wall": f"{_HERE}.simple:WallFollower",
    "frontier": f"{_HERE}.explorers:NearestFrontier",
    "random-frontier": f"{_HERE}.explorers:RandomFrontier",
    "frontier-mapex": f"{_HERE}.mapex:MapExNearest",
    "information": f"{_HERE}.explorers:InformationGain",
    "prospector": f"{_HERE}.explorers:Prospector",
    "tour": f"{_HERE}.explorers:Tour",
    "chooser": f"{_HERE}.learned:chooser_0",
    "chooser-1": f"{_HERE}.learned:chooser_1",
    "chooser-2": f"{_HERE}.learned:chooser_2",
    "finisher": f"{_HERE}.learned:finisher",
    "look-around": f"{_HERE}.learned:look_around",
    "straight": f"{_HERE}.learned:straight",
    "swift": f"{_HERE}.learned:swift",
    "oracle": f"{_HERE}.oracle:Oracle",
    "seek": f"{_HERE}.seeking:Seeker",
    "seek-likely": f"{_HERE}.seeking:seek_likely_0",
    "seek-likely-1": f"{_HERE}.seeking:seek_likely_1",
    "seek-likely-2": f"{_HERE}.seeking:seek_likely_2",
    "shortest": f"{_HERE}.seeking:ShortestWay",
    "wait": f"{_HERE}.social:Waiting",
    "keep-away": f"{_HERE}.social:KeepingAway",
    "give-way": f"{_HERE}.social:give_way_0",
    "give-way-1": f"{_HERE}.social:give_way_1",
    "give-way-2": f"{_HERE}.social:give_way_2",
    "greedy": f"{_HERE}.simple:Greedy",
    "a-star": f"{_HERE}.simple:AStar",
}
"""The policies that come with the project."""
ATTRIBUTE: Final = "policy"
"""The name of the factory in a file if none is given."""


@dataclass(frozen=True)
class NamedPolicy:
    """The factory of a policy, and its origin.

    Parameters
    ----------
    name
        The name that was requested.
    source
        ``module:function`` or ``file:function``.
    sha256
        SHA-256 of the file of its weights or, without weights, of its code; "" if there is no file.
    """

    name: str
    factory: PolicyFactory
    source: str
    sha256: str

    @property
    def interface(self) -> Interface:
        """The policy's observations and actions."""
        return read_interface(self.factory)

    @property
    def training(self) -> Training | None:
        """The training that produced the policy, None if it was not trained."""
        return read_training(self.factory)


def load_policy(name: str) -> NamedPolicy:
    """Return a policy by a name of ``NAMES``, a file, ``FILE.py:function``, or ``module:function``.

    A file's suffix determines how it is read (``LOADERS``). Modules are found in the usual way of Python. From the
    working directory, only the module that was named is imported.

    Raises
    ------
    ConfigError
        The policy does not exist, cannot be imported, or is not a factory.
    """
    if name in NAMES:
        return _import_policy(name, NAMES[name])
    path, attribute = _split_attribute(name)
    if path.suffix in LOADERS:
        if not path.is_file():
            raise ConfigError(f"policy {name!r}: expected a file, found none at {path}; check the path")
        factory = LOADERS[path.suffix](path, attribute or ATTRIBUTE)
        return _check_policy(name, factory, f"{path}:{attribute or ATTRIBUTE}", path)
    if attribute:
        return _import_policy(name, name)
    raise ConfigError(
        f"policy: no {name!r}; known: {', '.join(NAMES)}, a file ({', '.join(LOADERS)}), or module:function"
        + suggest_name(name, NAMES)
    )


def describe_exception(error: BaseException, here: str) -> str:
    """Return a text on a policy's exception and the last line of its code; ``here`` is the caller's file."""
    frames = [frame for frame in extract_tb(error.__traceback__) if frame.filename != here]
    own = [frame for frame in frames if frame.filename == frames[0].filename]
    where = f" ({own[-1].filename}, line {own[-1].lineno})" if own else ""
    return f"{type(error).__name__}: {error}".removesuffix(": ") + where


def describe_no_policy(named: NamedPolicy, returned: object) -> str:
    """Return the message for a factory that did not return a policy."""
    return (
        f"expected {named.source} to be a factory: called with (robot, seed), it returns a policy, which is called "
        f"with (observation, info); it returned {returned!r}"
    )


def _split_attribute(name: str) -> tuple[Path, str]:
    """Return a file or module, and the text after its last colon."""
    place, colon, attribute = name.rpartition(":")
    return (Path(place), attribute) if colon and attribute.isidentifier() else (Path(name), "")


def _import_policy(name: str, place: str) -> NamedPolicy:
    module_name, _, attribute = place.rpartition(":")
    with _working_directory(module_name):
        module = _run(name, lambda: importlib.import_module(module_name))
    file = getattr(module, "__file__", None)
    return _check_policy(name, _attribute(name, module, attribute), place, Path(file) if file else None)


@contextmanager
def _working_directory(module_name: str) -> Iterator[None]:
    """Allow to import a module from the working directory, after all others, so that it cannot hide a library."""
    here, top = Path.cwd(), module_name.partition(".")[0]
    if not ((here / f"{top}.py").is_file() or (here / top).is_dir()) or str(here) in sys.path:
        yield
        return
    sys.path.append(str(here))
    try:
        yield
    finally:
        sys.path.remove(str(here))


def _from_python(path: Path, attribute: str) -> PolicyFactory:
    spec = importlib.util.spec_from_file_location(f"policy_{path.stem}", path)
    assert spec is not None and spec.loader is not None  # noqa: S101, PT018  # it ends in .py
    module, loader = importlib.util.module_from_spec(spec), spec.loader
    sys.modules[spec.name] = module  # dataclasses look up their module
    _run(str(path), lambda: loader.exec_module(module))
    return _attribute(str(path), module, attribute)


def _from_training(path: Path, _attribute: str) -> PolicyFactory:
    from houseexpo.pseudoslam.agents.learned import NetworkFactory

    return NetworkFactory(path)


def _from_weights(path: Path, _attribute: str) -> PolicyFactory:
    from houseexpo.pseudoslam.agents.learned import ChooserFactory
    from houseexpo.pseudoslam.agents.seeking import FORMAT, SeekerFactory

    return SeekerFactory(path) if FORMAT.encode() in path.read_bytes()[:64] else ChooserFactory(path)


LOADERS: Final[dict[str, Callable[[Path, str], PolicyFactory]]] = {
    ".py": _from_python, ".pt": _from_training, ".onnx": _from_training, ".json": _from_weights,
}  # fmt: skip
"""The readers of files by suffix: functions of the file and the name in it that return a factory."""


def _run(name: str, work: Callable[[], object]) -> object:
    try:
        return work()
    except (Exception, SystemExit) as error:  # a script may call sys.exit()
        raise ConfigError(f"policy {name!r}: cannot be imported: {type(error).__name__}: {error}") from error


def _attribute(name: str, module: object, attribute: str) -> PolicyFactory:
    found = getattr(module, attribute, None)
    if found is None:
        raise ConfigError(f"policy {name!r}: expected a class or function {attribute!r} there, found none")
    factory: PolicyFactory = found
    return factory


def _check_policy(name: str, factory: object, source: str, file: Path | None) -> NamedPolicy:
    if not callable(factory):
        raise ConfigError(f"policy {name!r}: expected a class or function, found {factory!r}")
    read_interface(factory)
    read_training(factory)
    file = getattr(factory, "file", file)
    return NamedPolicy(name, factory, source, hashlib.sha256(file.read_bytes()).hexdigest() if file else "")
