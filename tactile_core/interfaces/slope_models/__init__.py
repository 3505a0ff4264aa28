"""Building blocks of calibrations that map intensities to slopes.

:class:`~tactile_core.interfaces.slope_models.slope_model.SlopeModel` is a complete model, and
:class:`~tactile_core.interfaces.slope_models.slope_model.SlopeCalibration` a calibration that
consists of one. Their parts (``samples``, ``tables``, ``model_file``, ``image_shape``,
``for_reference``) serve models that need only some of them.
"""
