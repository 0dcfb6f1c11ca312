"""Explain the names in a plan's file in words, for pages and reports: grounds of quality, notes, kinds of doors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from houseexpo.plan.parts import DoorKind

GROUNDS: Final[Mapping[str, str]] = {
    "cut_share": "doors that are cuts, not evidence",
    "cut_off_share": "rooms that only cuts lead into",
    "patch_share": "walls closed by a guess where they have holes",
    "given_edge": "an open house, its edge taken from floor or walls",
    "guesses": "levels, units, scale, axis or edges of rooms guessed",
    "floorless_room": "a room without a floor in a house with floors",
    "roomless_floor_share": "floor between the rooms that is in none",
    "roomless_wall_share": "walls that stand beside no room",
    "idle_lintel_share": "lintels of doors that the plan does not have",
    "twin_door_share": "doors beside another between the same rooms",
    "odd_doors": "doors too narrow or too wide on the whole",
    "odd_room_share": "rooms of odd shape or size",
    "loose_end_share": "rooms in which a wall ends in the middle",
    "left_out": "parts left out or filled",
    "unlike_spaces": "unlike the rooms that the source names",
    "sealed": "no door leads into it",
    "doubtful_space": "a room that may be none: a terrace, a court, a void",
    "tall": "the source reaches far above this storey",
    "rail_share": "railings and low walls beside the rooms",
    "small": "hardly larger than a closet",
    "bare": "nothing shows that people use it: no way in, no furniture, no name",
    "half_seen_rooms": "rooms seen in part: a fifth or more of their edge shows no wall",
    "beyond_rooms": "the map shows free space or walls that the plan lacks",
    "ragged_room": "a ragged room: several that are one, or rays that went on through a door or glass",
    "free_wall": "a wall that stands free in a room: rooms may be one, or it is ground with obstacles",
    "open_border": "lies open: a map's border, unseen space or a guess ends a third of it or more, not walls",
}
"""The meaning of each ground of a plan's quality, by its name in the file."""

NOTES: Final[Mapping[str, str]] = {
    "boundary:room_edge": "closed an open room along its edge as the source draws it",
    "boundary:floor_edge": "closed an open front by its floor",
    "boundary:wall_ends": "closed an open front by its walls' ends",
    "cuts": "cut a wall",
    "doors_unknown": "the source shows no door here: where the passages are is unknown",
    "erased_parts": "erased a part standing apart",
    "filled_cells": "filled a closed cell",
    "filled_pockets": "filled a corner out of reach",
    "no_rooms": "left out a place between walls that is no room: outside, a void, a block",
    "closed_spaces": "left out a closed space that is likely no room",
    "left_out": "left out a part that no cut leads into",
    "unlikely_entrances": "left out an entrance that is likely a window or a niche",
}
"""The meaning of each note in a plan's provenance, by its name; by ``name:text`` if the note is a text."""

DOORS: Final[Mapping[DoorKind, str]] = {
    "door": "a passage under a lintel, or the source has a door here",
    "opening": "a gap of full height, or the source has an opening without a door here",
    "entrance": "leads outside; it stays closed in the outline",
    "cut": "a robot could not pass otherwise",
}
"""The reason for a door of each kind."""
