"""Name our counterpart in errors for unknown attributes and arguments of modules, data sets, plans and methods."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Final, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_DATASET: Final = {
    "apply": "[function(plan) for plan in plans]; measure_cached keeps the results",
    "area": 'plans.column("area")',
    "columns": "plans.to_pandas().columns; plans.column(name) is one of them",
    "describe": "plans.to_pandas().describe()",
    "df": "plans.to_pandas()",
    "export": "houseexpo.export(plans, format, folder)",
    "filter": "plans.select(where=function), whose other arguments select without reading plans",
    "groupby": "plans.to_pandas().groupby(column)",
    "iloc": "plans[...], with numbers, slices, masks, lists of numbers or ids",
    "loc": "plans[...], with numbers, slices, masks, lists of numbers or ids",
    "map": "[function(plan) for plan in plans]; measure_cached keeps the results",
    "query": "plans.select(...), or plans[mask]",
    "save": 'houseexpo.export(plans, "json", folder)',
    "shape": "len(plans), or plans.to_pandas().shape",
    "show": "plans.plot()",
    "shuffle": "plans.sample(len(plans), seed=0)",
    "sort_values": "plans.sort(column)",
    "tail": "plans[-5:]",
    "to_csv": "plans.to_pandas().to_csv(file)",
    "to_dataframe": "plans.to_pandas()",
    "to_geojson": "plan.to_geojson() of each plan, or plans.to_geopandas(layer).to_json()",
    "to_json": 'plans.to_pandas().to_json(file), or houseexpo.export(plans, "json", folder)',
    "to_polars": "polars.from_arrow(plans.to_arrow())",
    "train_test_split": "plans.split(train=0.7, test=0.3, seed=0), which keeps copies of a house together",
    "value_counts": "plans.to_pandas()[column].value_counts()",
    "write": 'houseexpo.export(plans, "json", folder)',
}

_PLAN: Final = {
    "bounds": "plan.bbox",
    "draw": "plan.plot(), or plan.save(file) for a drawing",
    "export": "houseexpo.export([plan], format, folder)",
    "furniture": "plan.objects",
    "geometry": "plan.free_space, or plan.outline without what stands in it",
    "height": "plan.bbox",
    "image": "plan.grid(pixels_per_metre), or plan.save(file) for a drawing",
    "labels": "[room.label for room in plan.divided.rooms]",
    "load": "houseexpo.load_plan(file)",
    "name": "plan.id",
    "occupancy": "plan.grid(pixels_per_metre)",
    "path": "plan.shortest_path(start, goal)",
    "perimeter": "plan.outline.length",
    "polygon": "plan.free_space, or plan.outline without what stands in it",
    "render": "plan.plot(), or plan.save(file) for a drawing",
    "show": "plan.plot()",
    "source_rooms": "plan.room_num",
    "to_dict": "json.loads(houseexpo.encode(plan))",
    "to_image": "plan.grid(pixels_per_metre), or plan.save(file) for a drawing",
    "to_json": "houseexpo.encode(plan), or plan.save(file)",
    "to_networkx": "plan.graph()",
    "to_numpy": "plan.grid(pixels_per_metre)",
    "to_shapely": "plan.free_space",
    "vertices": "plan.verts",
    "width": "plan.bbox",
    "write": "plan.save(file)",
}

_MODULE: Final = {
    "from_json": "houseexpo.decode(text), or houseexpo.load_plan(file)",
    "load": "houseexpo.open_dataset(path), or houseexpo.load_plan(file) for a plan",
    "load_dataset": "houseexpo.open_dataset(path)",
    "make": 'gymnasium.make("PseudoSLAM/Exploration-v0", dataset=path) after import houseexpo.pseudoslam',
    "open": "houseexpo.open_dataset(path), or houseexpo.load_plan(file) for a plan",
    "open_plan": "houseexpo.load_plan(file)",
    "plot": "plan.plot(), or plans.plot()",
    "read": "houseexpo.open_dataset(path), or houseexpo.load_plan(file) for a plan",
    "read_dataset": "houseexpo.open_dataset(path)",
    "read_plan": "houseexpo.load_plan(file)",
    "save": "houseexpo.save_plan(plan, file), or houseexpo.export(plans, format, folder)",
    "show": "plan.plot(), or plans.plot()",
    "split": "plans.split(train=0.7, test=0.3, seed=0)",
    "to_json": "houseexpo.encode(plan)",
}

FOREIGN_NAMES: Final[Mapping[str, Mapping[str, str]]] = {
    "a Dataset": _DATASET,
    "a FloorPlan": _PLAN,
    "houseexpo": _MODULE,
}
"""Our counterparts of names in other libraries, by the owner that lacks the name."""


def unknown_attribute(owner: str, name: str, obj: object) -> AttributeError:
    """Return the error for an unknown attribute; it names our counterpart if another library has this name."""
    ours = FOREIGN_NAMES[owner].get(name)
    return AttributeError(f"{owner} has no {name!r}" + (f"; use {ours}" if ours else ""), name=name, obj=obj)


def names_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Return a method whose error for wrong arguments lists its parameters."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            name, parameters = function.__name__, ", ".join(_written(signature))
            raise TypeError(f"{name}: {error}; expected {name}({parameters})") from None
        return function(*args, **kwargs)

    return checked


def _written(signature: inspect.Signature) -> list[str]:
    """Return the parameters as written in a call, without ``self`` and types."""
    found = []
    for parameter in list(signature.parameters.values())[1:]:
        is_first_by_name = parameter.kind is parameter.KEYWORD_ONLY and "*" not in found
        found += ["*"] if is_first_by_name else []
        found.append(str(parameter.replace(annotation=inspect.Parameter.empty)))
    return found
