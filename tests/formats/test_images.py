"""Images are read losslessly, and other files are rejected with a one-line message."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import zlib
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from tactile_core.errors import InputError
from tactile_core.formats.images import ImageKind, image_kind, read_image, write_png

RNG = np.random.default_rng(0)
SHAPES = [(5, 7), (5, 7, 3)]
DEPTHS = [np.uint8, np.uint16]


def noise(shape: tuple[int, ...], dtype: type) -> np.ndarray:
    return RNG.integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_image(path)
    message = str(caught.value)
    assert str(path) in message
    assert "\n" not in message
    return message


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", DEPTHS)
def test_a_png_is_lossless(tmp_path: Path, shape: tuple[int, ...], dtype: type) -> None:
    pixels = noise(shape, dtype)
    write_png(tmp_path / "a.png", pixels)
    back = read_image(tmp_path / "a.png")
    assert back.dtype == dtype
    assert back.flags.c_contiguous
    np.testing.assert_array_equal(back, pixels)


def test_channels_are_in_rgb_order(tmp_path: Path) -> None:
    bgr = np.zeros((4, 4, 3), np.uint8)
    bgr[..., 2] = 200
    cv2.imwrite(str(tmp_path / "red.png"), bgr)
    assert read_image(tmp_path / "red.png")[0, 0].tolist() == [200, 0, 0]


@pytest.mark.parametrize("dtype", DEPTHS)
def test_the_alpha_channel_is_dropped(tmp_path: Path, dtype: type) -> None:
    bgra = noise((4, 6, 4), dtype)
    cv2.imwrite(str(tmp_path / "a.png"), bgra)
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), bgra[..., 2::-1])


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.tif", "a.webp"])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_header_gives_the_kind_of_the_decoded_pixels(
    tmp_path: Path, name: str, shape: tuple[int, ...]
) -> None:
    path = tmp_path / name
    cv2.imwrite(str(path), noise(shape, np.uint8))
    kind = image_kind(path)
    assert kind == ImageKind.from_pixels(read_image(path))
    assert (kind.width_px, kind.height_px, kind.bits) == (7, 5, 8)


def test_a_header_after_long_metadata_is_found(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    cv2.imwrite(str(path), noise((5, 7, 3), np.uint8))
    segment = b"\xff\xe1" + (60000).to_bytes(2, "big") + bytes(59998)
    data = path.read_bytes()
    path.write_bytes(data[:2] + 3 * segment + data[2:])
    assert image_kind(path) == ImageKind(7, 5, 3, 8)


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
def test_every_truncation_is_rejected(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    cv2.imwrite(str(path), noise((9, 11, 3), np.uint8))
    data = path.read_bytes()
    for length in range(0, len(data) - 1, 7):
        path.write_bytes(data[:length])
        refusal(path)
    # OpenCV logs what is wrong with a PNG, unless its log is off, and decodes no torn JPEG
    assert name == "a.png" or capfd.readouterr().err == ""


def test_a_flipped_bit_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    write_png(path, noise((20, 20), np.uint8))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert "damaged" in refusal(path)


def test_a_text_file_named_png_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "notes.png"
    path.write_text("this is not an image")
    assert "not a readable image" in refusal(path)
    with pytest.raises(InputError, match="not a readable image"):
        image_kind(path)


def test_values_of_other_types_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    cv2.imwrite(str(path), np.zeros((4, 4), np.float32))
    assert "float32" in refusal(path)


def test_a_missing_file_is_rejected(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "absent.png")
    with pytest.raises(InputError, match="no such file"):
        image_kind(tmp_path / "absent.png")


def chunk(name: bytes, content: bytes) -> bytes:
    checked = name + content
    return struct.pack(">I", len(content)) + checked + struct.pack(">I", zlib.crc32(checked))


def png(width: int, height: int, *more: bytes) -> bytes:
    """A black PNG of any size, made without allocating its pixels."""
    start = b"\x89PNG\r\n\x1a\n" + chunk(
        b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    )
    compressor, row = zlib.compressobj(9), bytes(width + 1)
    data = b"".join(compressor.compress(row) for _ in range(height)) + compressor.flush()
    return start + b"".join(more) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def header_only(name: str, width: int, height: int) -> bytes:
    """A 4 × 4 image whose header claims another size."""
    data = bytearray(cv2.imencode(name, noise((4, 4), np.uint8))[1].tobytes())
    if name == ".jpg":
        at = data.index(b"\xff\xc0")
        data[at + 5 : at + 9] = struct.pack(">HH", height, width)
    elif name == ".bmp":
        data[18:26] = struct.pack("<ii", width, -height)
    elif name == ".webp":
        data[21:25] = struct.pack("<I", (width - 1) | (height - 1) << 14)
    elif name == ".pgm":
        data = bytearray(b"P5 # comment\n%d %d\n255\n" % (width, height))
    else:
        (at,) = struct.unpack_from("<I", data, 4)
        for entry in range(at + 2, len(data) - 12, 12):
            tag = struct.unpack_from("<H", data, entry)[0]
            if tag in (256, 257):
                data[entry + 2 : entry + 12] = struct.pack("<HII", 4, 1, (width, height)[tag - 256])
    return bytes(data)


def test_a_decompression_bomb_is_rejected_before_decoding(tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(png(10_001, 5000))
    assert path.stat().st_size < 100_000
    assert "10001 × 5000 pixels" in refusal(path)
    with pytest.raises(InputError, match="megapixels"):
        image_kind(path)


@pytest.mark.parametrize("name", [".jpg", ".bmp", ".tif", ".webp", ".pgm"])
def test_an_oversized_header_is_rejected_in_every_format(tmp_path: Path, name: str) -> None:
    path = tmp_path / f"a{name}"
    path.write_bytes(header_only(name, 16_000, 15_999))
    assert "16000 × 15999" in refusal(path)


@pytest.mark.parametrize(("width", "height"), [(0, 0), (0, 5), (5, 0)])
def test_an_image_without_pixels_is_rejected(tmp_path: Path, width: int, height: int) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(png(width, height))
    assert "no pixels" in refusal(path)
    with pytest.raises(InputError, match="no pixels"):
        image_kind(path)


def test_several_images_in_one_file_are_rejected(tmp_path: Path) -> None:
    frames = [noise((8, 8, 3), np.uint8) for _ in range(3)]
    assert cv2.imwritemulti(str(tmp_path / "a.tif"), frames)
    assert "several images" in refusal(tmp_path / "a.tif")
    animation = tmp_path / "a.png"
    animation.write_bytes(png(8, 8, chunk(b"acTL", struct.pack(">II", 3, 0))))
    assert "several images" in refusal(animation)
    with pytest.raises(InputError, match="several images"):
        image_kind(animation)
    webp = tmp_path / "a.webp"
    body = b"WEBP" + b"VP8X" + struct.pack("<II", 10, 2) + bytes([7, 0, 0, 7, 0, 0])
    webp.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)
    assert "several images" in refusal(webp)
    gif = tmp_path / "a.gif"
    gif.write_bytes(b"GIF89a" + struct.pack("<HHBBB", 8, 8, 0, 0, 0) + b";")
    assert "save it as PNG" in refusal(gif)


@pytest.mark.parametrize("name", ["a.bmp", "a.tif", "a.webp", "a.ppm"])
def test_truncations_of_formats_without_checksums_are_rejected(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    cv2.imwrite(str(path), noise((9, 11, 3), np.uint8))
    data = path.read_bytes()
    for length in range(0, len(data) - 1, 7):
        path.write_bytes(data[:length])
        refusal(path)


@pytest.mark.parametrize("name", ["a.jpg", "a.bmp", "a.tif", "a.webp", "a.ppm"])
def test_flipped_bits_give_an_image_or_an_input_error(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    cv2.imwrite(str(path), noise((9, 11, 3), np.uint8))
    data = path.read_bytes()
    for at in range(0, len(data), max(1, len(data) // 90)):
        flipped = bytearray(data)
        flipped[at] ^= 1 << at % 8
        path.write_bytes(flipped)
        with suppress(InputError):
            assert read_image(path).size > 0


def test_pipes_devices_folders_and_invalid_names_are_rejected(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "folder.png").mkdir()
    for path, words in [
        (tmp_path / "pipe.png", "a pipe or a device"),
        (Path("/dev/zero"), "a pipe or a device"),
        (tmp_path / "folder.png", "is a folder"),
        (tmp_path / f"{'x' * 300}.png", "too long"),
        (tmp_path / "a\0.png", "not a valid file name"),
    ]:
        assert words in refusal(path)
        with pytest.raises(InputError, match=words):
            image_kind(path)


SILENT = """
import sys
from pathlib import Path
from tactile_core.formats.images import read_image
print(read_image(Path(sys.argv[1])).shape)
print("own message", file=sys.stderr)
"""


def test_decoders_print_nothing_when_the_log_of_opencv_is_off(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    cv2.imwrite(str(path), noise((64, 64, 3), np.uint8))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2] + data[-2:])  # the decoder only warns
    for level, expected in [("OFF", False), ("WARNING", True)]:
        done = subprocess.run(
            [sys.executable, "-c", SILENT, path],
            capture_output=True,
            text=True,
            check=True,
            env=os.environ | {"OPENCV_LOG_LEVEL": level},
        )
        assert done.stdout == "(64, 64, 3)\n"
        assert ("Corrupt JPEG" in done.stderr) == expected
        assert done.stderr.endswith("own message\n")


PARALLEL = """
import os, sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tactile_core.formats.images import read_image
before = os.readlink("/proc/self/fd/2")
with ThreadPoolExecutor(8) as threads:
    list(threads.map(read_image, [Path(sys.argv[1])] * 400))
assert os.readlink("/proc/self/fd/2") == before
print("own message", file=sys.stderr)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
def test_threads_that_read_images_at_once_leave_stderr_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), noise((64, 64, 3), np.uint8))
    done = subprocess.run(
        [sys.executable, "-c", PARALLEL, path],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"OPENCV_LOG_LEVEL": "OFF"},
    )
    assert done.stderr == "own message\n"


def test_every_kind_of_recorded_image_is_read(recordings: Path) -> None:
    kinds = {
        "three_colour/objectfolder/reference.png": ImageKind(160, 120, 3, 8),
        "three_colour/wedge/bg-0.jpg": None,
        "six_led/groove/image01.png": ImageKind(616, 514, 1, 8),
        "six_led/diligent_bear/017.png": ImageKind(612, 512, 3, 16),
    }
    for name, kind in kinds.items():
        found = image_kind(recordings / name)
        assert found == ImageKind.from_pixels(read_image(recordings / name))
        assert kind in (None, found)


@pytest.mark.parametrize("ending", ["jpg", "png", "tiff", "webp"])
@pytest.mark.parametrize("orientation", [3, 6])
def test_an_orientation_tag_is_ignored_in_every_format(
    tmp_path: Path, ending: str, orientation: int
) -> None:
    tag = Image.Exif()
    tag[274] = orientation
    stored = np.zeros((40, 60, 3), np.uint8)
    stored[:16, :16] = 200
    path = tmp_path / f"turned.{ending}"
    Image.fromarray(stored).save(path, exif=tag)
    found = read_image(path)
    assert found.shape == stored.shape
    assert np.abs(found[4:12, 4:12].astype(int) - 200).max() < 20
    assert found[24:, 24:].max() < 20


@pytest.mark.parametrize(
    "wrong",
    [
        np.array([[None, 1]]),
        np.zeros((4, 4)),
        np.zeros((4, 4, 2), np.uint8),
        np.zeros((0, 4), np.uint8),
        "a.png",
    ],
)
def test_what_is_no_image_is_not_written(tmp_path: Path, wrong: object) -> None:
    with pytest.raises(InputError, match=r"is no image; give \(H, W\)"):
        write_png(tmp_path / "a.png", wrong)  # type: ignore[arg-type]
    assert not (tmp_path / "a.png").exists()
