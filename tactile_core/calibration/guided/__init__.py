"""Guided calibration: live frames of somebody who presses a ball become a scored bundle.

``touch`` follows the change of live frames through time, and finds each press that is new and
still. ``examination`` judges it, with the circles of ``tactile calibrate``, and measures it with
the calibration on the presses before it. ``coverage`` shows what is covered and where to press
next. ``session`` puts them together, and ``background`` compares frames with the reference, and
does in another process what takes longer than a frame.
"""
