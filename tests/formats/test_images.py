"""Images are read without loss, and what is no image is refused in one sentence."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

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
def test_a_png_keeps_every_bit(tmp_path: Path, shape: tuple[int, ...], dtype: type) -> None:
    pixels = noise(shape, dtype)
    write_png(tmp_path / "a.png", pixels)
    back = read_image(tmp_path / "a.png")
    assert back.dtype == dtype
    assert back.flags.c_contiguous
    np.testing.assert_array_equal(back, pixels)


def test_red_comes_first(tmp_path: Path) -> None:
    bgr = np.zeros((4, 4, 3), np.uint8)
    bgr[..., 2] = 200
    cv2.imwrite(str(tmp_path / "red.png"), bgr)
    assert read_image(tmp_path / "red.png")[0, 0].tolist() == [200, 0, 0]


@pytest.mark.parametrize("dtype", DEPTHS)
def test_transparency_is_dropped(tmp_path: Path, dtype: type) -> None:
    bgra = noise((4, 6, 4), dtype)
    cv2.imwrite(str(tmp_path / "a.png"), bgra)
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), bgra[..., 2::-1])


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.tif", "a.webp"])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_kind_told_by_the_header_is_that_of_the_pixels(
    tmp_path: Path, name: str, shape: tuple[int, ...]
) -> None:
    path = tmp_path / name
    cv2.imwrite(str(path), noise(shape, np.uint8))
    kind = image_kind(path)
    assert kind == ImageKind.of(read_image(path))
    assert (kind.width_px, kind.height_px, kind.bits) == (7, 5, 8)


def test_a_header_beyond_long_metadata_is_found(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    cv2.imwrite(str(path), noise((5, 7, 3), np.uint8))
    segment = b"\xff\xe1" + (60000).to_bytes(2, "big") + bytes(59998)
    data = path.read_bytes()
    path.write_bytes(data[:2] + 3 * segment + data[2:])
    assert image_kind(path) == ImageKind(7, 5, 3, 8)


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
def test_every_truncation_is_refused(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    cv2.imwrite(str(path), noise((9, 11, 3), np.uint8))
    data = path.read_bytes()
    for length in range(0, len(data) - 1, 7):
        path.write_bytes(data[:length])
        refusal(path)
    assert capfd.readouterr().err == ""  # the decoders' own words stay unsaid


def test_a_flipped_bit_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    write_png(path, noise((20, 20), np.uint8))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert "damaged" in refusal(path)


def test_a_text_file_named_png_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.png"
    path.write_text("this is no image")
    assert "no image" in refusal(path)
    with pytest.raises(InputError, match="no image"):
        image_kind(path)


def test_values_of_other_types_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    cv2.imwrite(str(path), np.zeros((4, 4), np.float32))
    assert "float32" in refusal(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "absent.png")
    with pytest.raises(InputError, match="no such file"):
        image_kind(tmp_path / "absent.png")


def test_every_kind_of_real_image_is_read(recordings: Path) -> None:
    kinds = {
        "three_colour/objectfolder/reference.png": ImageKind(160, 120, 3, 8),
        "three_colour/wedge/bg-0.jpg": None,
        "six_led/groove/image01.png": ImageKind(616, 514, 1, 8),
        "six_led/diligent_bear/017.png": ImageKind(612, 512, 3, 16),
    }
    for name, kind in kinds.items():
        told = image_kind(recordings / name)
        assert told == ImageKind.of(read_image(recordings / name))
        assert kind in (None, told)
