"""The recording of a guided calibration: which of its frames are presses that were kept."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tactile_core.quantities import Frame
from tactile_core.recordings.kinds import is_recorded, recording_file
from tactile_core.recordings.recording_file import EventEntry

# Names of the events; their values are those of GuidedSession.
KEPT, WITHDRAWN = "calibration press kept", "calibration press withdrawn"


@dataclass(frozen=True)
class GuidedSession:
    """Presses that a guided calibration kept.

    Attributes
    ----------
    stamps_s : frozenset of float
        Timestamps of their frames.
    ball_diameter_mm : float
    """

    stamps_s: frozenset[float]
    ball_diameter_mm: float

    @classmethod
    def from_recording(cls, path: Path) -> GuidedSession | None:
        """Read it from a recording; None if no calibration was guided in it."""
        if not path.exists() or not is_recorded(path):
            return None
        stamps: dict[str, float] = {}
        ball_mm = None
        with recording_file(path) as file:
            for entry in file.entries:
                if not isinstance(entry, EventEntry):
                    continue
                if entry.name == KEPT:
                    stamps[str(entry.values["name"])] = float(entry.values["timestamp_s"])
                    ball_mm = float(entry.values["ball_diameter_mm"])
                elif entry.name == WITHDRAWN:
                    stamps.pop(str(entry.values["name"]), None)
        return None if ball_mm is None else cls(frozenset(stamps.values()), ball_mm)

    def is_kept(self, frame: Frame) -> bool:
        """Whether a frame is one of the presses."""
        return frame.timestamp_s in self.stamps_s
