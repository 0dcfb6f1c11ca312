from .analysis.copies import find_duplicates
from .analysis.graph import rooms_graph
from .analysis.navigability import navigability
from .corrections import Correction, Override
from .dataset import Dataset, open_dataset
from .dataset.build_from_python import build
from .dataset.fetch import fetch
from .drawing import contact_sheet, draw_plan, svg
from .errors import (
    ConfigError,
    DatasetError,
    HouseExpoError,
    MissingDependencyError,
    PlanError,
    TrainingError,
    UnknownPlanError,
    WorkerError,
)
from .exports import export
from .floorplan import FloorPlan, decode, load_plan, save_plan
from .grids.frame import GridFrame
from .grids.raster import door_ids, free_mask, room_ids
from .inference import with_rooms
from .inference.map_prediction import PredictedMap, predict_map
from .plan import Door, Frame, Navigability, PlanObject, Quality, Room
from .plan.json_codec import encode
from .plan.repair import Repair
from .plan.room_labels import LABELS, UNLABELLED, canonical

__all__ = [
    "LABELS",
    "UNLABELLED",
    "ConfigError",
    "Correction",
    "Dataset",
    "DatasetError",
    "Door",
    "FloorPlan",
    "Frame",
    "GridFrame",
    "HouseExpoError",
    "MissingDependencyError",
    "Navigability",
    "Override",
    "PlanError",
    "PlanObject",
    "PredictedMap",
    "Quality",
    "Repair",
    "Room",
    "TrainingError",
    "UnknownPlanError",
    "WorkerError",
    "build",
    "canonical",
    "contact_sheet",
    "decode",
    "door_ids",
    "draw_plan",
    "encode",
    "export",
    "fetch",
    "find_duplicates",
    "free_mask",
    "load_plan",
    "navigability",
    "open_dataset",
    "predict_map",
    "room_ids",
    "rooms_graph",
    "save_plan",
    "svg",
    "with_rooms",
]

__version__: str
