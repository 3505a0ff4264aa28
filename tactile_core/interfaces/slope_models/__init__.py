"""What models from intensity to slope share, to compose one's own calibration of.

:class:`~tactile_core.interfaces.slope_models.slope_model.SlopeModel` is the whole of one;
``samples``, ``tables``, ``model_file``, ``image_shape`` and ``for_reference`` are its parts, for a
model that needs only some of them.
"""
