"""A property of a new sensor, and how it was determined."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Finding:
    """Keys of one section of a profile, and the origin of their values.

    Attributes
    ----------
    section : str
        ``image`` or ``gel``, for example.
    comment : str
        Meaning and origin of the keys, in a sentence or two.
    values : mapping
        Keys and values for the file; empty if the parent's values are inherited.
    noted : bool
        Also reported to the user: the values are inherited instead of measured, or doubtful.
    """

    section: str
    comment: str
    values: Mapping[str, Any] = field(default_factory=dict)
    noted: bool = False
