"""What was found out about a lab's own sensor, and how."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Finding:
    """Keys of one section of a profile, and where their values come from.

    Attributes
    ----------
    section : str
        ``image`` or ``gel``, for example.
    comment : str
        What they are and how they were found, a sentence or two.
    values : mapping
        As they go into the file; empty where the parent's stand and are only spoken of.
    noted : bool
        To be said aloud: not found but taken from the parent, or doubtful.
    """

    section: str
    comment: str
    values: Mapping[str, Any] = field(default_factory=dict)
    noted: bool = False
