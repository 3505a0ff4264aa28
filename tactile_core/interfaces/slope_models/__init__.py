"""Building blocks of calibrations that map intensities to slopes.

:class:`~tactile_core.interfaces.slope_models.slope_model.SlopeModel` is a complete model, and
:class:`~tactile_core.interfaces.slope_models.slope_model.SlopeCalibration` a calibration that
consists of one. The training samples (``samples``) and the file (``model_file``) serve models of
other kinds as well.
"""
