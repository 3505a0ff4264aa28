"""How the live page is served."""

from __future__ import annotations

from typing import NamedTuple


class PageParameters(NamedTuple):
    """Sizes, rates and limits of the live page.

    Attributes
    ----------
    pictures_per_s : float, Hz
        Largest number of pictures a second that a browser gets of one sensor. Source: motion looks
        smooth from about 25 a second; more would take time from measuring.
    picture_px, map_px : int, px
        Longest side of the camera's picture and of a map as they are sent; larger ones are reduced.
        Source: widths of a panel of the page on common screens.
    jpeg_quality : int, percent
        Quality of the camera's picture. Source: chosen by hand: artefacts are invisible.
    arrows_across : int, count
        Arrows along the longer side of a field of vectors. Source: chosen by hand.
    history_s : float, s
        Length of the plots. Source: chosen by hand: some grasps are on the screen together.
    health_s : float, s
        Time between two looks at the health. Source: chosen by hand.
    reference_frames : int, count
        Observations that are averaged for a reference. Source: as in ``Sensor.capture_reference``.
    message_bytes : int, bytes
        Longest message that a browser may send. Source: the longest command has about 1 kB.
    browsers : int, count
        Pages and sensors that are watched at the same time. Source: chosen by hand: four pages of
        four sensors.
    handshake_s : float, s
        Time in which a new connection must send its request. Source: chosen by hand: a slow network
        needs less than one second.
    """

    pictures_per_s: float = 30.0
    picture_px: int = 960
    map_px: int = 320
    jpeg_quality: int = 80
    arrows_across: int = 24
    history_s: float = 30.0
    health_s: float = 0.5
    reference_frames: int = 10
    message_bytes: int = 16384
    browsers: int = 16
    handshake_s: float = 5.0


PAGE = PageParameters()
"""The values in use."""
