"""What people say of single houses: the words (``vocabulary``), and what they do to a plan (``apply``)."""

from houseexpo.corrections.vocabulary import Correction, Override

__all__ = ["Correction", "Override"]
