"""Guided calibration: live frames of somebody who presses a ball become a scored bundle.

``change`` compares a frame with the reference on a few cells. ``touch`` follows the change through
time, and finds each press that is new and still. ``examination`` judges it, with the circles and
the doubts of ``tactile calibrate``. ``coverage`` shows what is covered and where to press next.
``prequential`` measures each press with the calibration on those before it. ``session`` puts them
together, and ``background`` does in other processes what takes longer than a frame.
"""
