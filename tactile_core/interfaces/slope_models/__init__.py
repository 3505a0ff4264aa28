"""What models from intensity to slope share, to compose one's own calibration of.

:class:`~tactile_core.interfaces.slope_models.slope_model.SlopeModel` is the whole of one, and
:class:`~tactile_core.interfaces.slope_models.slope_calibration.SlopeCalibration` a calibration that
is nothing else;
``samples``, ``tables``, ``model_file``, ``image_shape`` and ``for_reference`` are its parts, for a
model that needs only some of them.
"""
