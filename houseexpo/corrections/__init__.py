"""Corrections of single houses by people: their vocabulary (``vocabulary``) and their application (``apply``)."""

from houseexpo.corrections.vocabulary import Correction, Override

__all__ = ["Correction", "Override"]
