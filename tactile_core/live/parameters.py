"""How the live page is served."""

from __future__ import annotations


class PAGE:
    """Sizes, rates and limits of the live page."""

    # [Hz] Largest number of pictures a second that a browser gets of one sensor. Source: motion
    # looks smooth from about 25 a second; more would take time from measuring.
    pictures_per_s = 30.0
    # [px] Longest side of the camera's picture and of a map as they are sent; larger ones are
    # reduced. Source: widths of a panel of the page on common screens.
    picture_px = 960
    map_px = 320
    # [percent] Quality of the camera's picture. Source: by hand, : artefacts are invisible.
    jpeg_quality = 80
    arrows_across = 24  # [count] Arrows along the longer side of a field of vectors
    # [s] Length of the plots. Source: by hand, : some grasps are on the screen together.
    history_s = 30.0
    health_s = 0.5  # [s] Time between two looks at the health
    # [count] Observations that are averaged for a reference. Source: as in
    # ``Sensor.capture_reference``.
    reference_frames = 10
    # [bytes] Longest message that a browser may send. Source: the longest command has about 1 kB.
    message_bytes = 16384
    # [count] Pages and sensors that are watched at the same time. Source: by hand, : four pages
    # of four sensors.
    browsers = 16
    # [s] Time in which a new connection must send its request. Source: by hand, : a slow network
    # needs less than one second.
    handshake_s = 5.0
