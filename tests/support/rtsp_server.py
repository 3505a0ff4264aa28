"""GStreamer's RTSP server on this computer; run with the system's Python and an encoding."""

from __future__ import annotations

import signal
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Self

PYTHON = "/usr/bin/python3"
"""The system's, for which Debian packages gi."""

WIDTH, HEIGHT, FPS = 320, 240, 30
RED, GREEN, BLUE = 200, 40, 60
SOURCE = (
    f"videotestsrc is-live=true pattern=solid-color "
    f"foreground-color={0xFF000000 | RED << 16 | GREEN << 8 | BLUE} "
    f"! video/x-raw,format=I420,width={WIDTH},height={HEIGHT},framerate={FPS}/1"
)
ENCODERS = {
    "h264": "x264enc tune=zerolatency key-int-max=15 ! rtph264pay name=pay0",
    "jpeg": "jpegenc ! rtpjpegpay name=pay0",
}
"""How the stream is encoded and sent."""


@cache
def missing() -> str:
    """Return the Debian packages that are not installed, or ""."""
    packages = (
        "python3-gi gir1.2-gst-rtsp-server-1.0 gstreamer1.0-plugins-good gstreamer1.0-plugins-ugly"
    )
    if not Path(PYTHON).exists():
        return packages
    probe = subprocess.run([PYTHON, __file__, "probe"], capture_output=True, check=False)
    return packages if probe.returncode else ""


class RtspServer:
    """A server whose stream ``/live`` shows one colour.

    Attributes
    ----------
    url : str
    """

    def __init__(self, encoding: str = "h264") -> None:
        self._process = subprocess.Popen(
            [PYTHON, __file__, encoding], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        self.url = f"rtsp://127.0.0.1:{int(self._process.stdout.readline())}/live"

    def pause(self) -> None:
        """Send nothing more, but keep the connection."""
        self._process.send_signal(signal.SIGSTOP)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._process:
            self._process.kill()


def serve(encoding: str) -> None:
    """Serve until the process is killed."""
    import gi

    gi.require_version("Gst", "1.0")
    gi.require_version("GstRtspServer", "1.0")
    from gi.repository import GLib, Gst, GstRtspServer

    Gst.init(None)
    if encoding == "probe":
        elements = ("videotestsrc", "x264enc", "rtph264pay", "jpegenc", "rtpjpegpay")
        sys.exit(not all(map(Gst.ElementFactory.find, elements)))
    factory = GstRtspServer.RTSPMediaFactory()
    factory.set_launch(f"( {SOURCE} ! {ENCODERS[encoding]} )")
    server = GstRtspServer.RTSPServer()
    server.set_address("127.0.0.1")
    server.set_service("0")
    server.get_mount_points().add_factory("/live", factory)
    server.attach(None)
    print(server.get_bound_port(), flush=True)
    GLib.MainLoop().run()


if __name__ == "__main__":
    serve(sys.argv[1])
