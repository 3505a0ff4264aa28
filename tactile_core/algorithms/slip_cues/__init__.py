"""Cues of slip that need neither a reference of the undeformed surface nor a calibration."""
