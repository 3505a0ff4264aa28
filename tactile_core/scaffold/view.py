"""The ``image`` section of a new profile: size, crop, perspective and bit depth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tactile_core.acquisition.geometry import Size
from tactile_core.algorithms.light.light_change import lit_area
from tactile_core.errors import InputError
from tactile_core.formats.images import ImageKind
from tactile_core.formats.scan import Crop
from tactile_core.interfaces.image import FEWEST_PX, ImageSection
from tactile_core.profiles.model import Profile
from tactile_core.quantities import Pixels
from tactile_core.scaffold.markers import PictureFinding
from tactile_core.scaffold.scale import ScaleMethod

_DEFAULTS: Mapping[str, Any] = {
    "crop": None,
    "flip": "none",
    "rotate_deg": 0,
    "lens": None,
    "warp": None,
}
_DEPTHS = (10, 12, 14, 16)  # Usual bit depths of cameras that send 16-bit images


def find_view(
    pixels: Pixels, parent: Profile, name: str, crop: Crop | None, scale: ScaleMethod | None
) -> list[PictureFinding]:
    """Find size, crop, perspective and bit depth of the image.

    Parameters
    ----------
    pixels : (H, W) or (H, W, 3)
        The undeformed sensor as the camera sends it.
    parent : Profile
    name : str
        The image's name, for the comments.
    crop : (x, y, width, height) or None
        Crop from the recording.
    scale : ScaleMethod or None
        A rectangle rectifies a tilted view.

    Raises
    ------
    InputError
        The image is in colour and the parent needs grey images, or vice versa; or it is one
        row.
    """
    height, width = pixels.shape[:2]
    if min(height, width) < FEWEST_PX:
        raise InputError(
            f"{name} has {width} × {height} px, which shows no surface; give an image of the whole "
            f"sensor with no contact"
        )
    depth = _depth(pixels, parent, name)
    if scale is not None and scale.kind == "rectangle":
        return [_rectify_view(parent, crop, scale), *depth]
    return [*_upright(pixels, parent, name, crop), *depth]


def section_of(
    parent: Profile, findings: list[PictureFinding], mm_per_px: float = 1.0
) -> ImageSection:
    """Return the parent's ``image`` section with the findings applied."""
    values = parent.image.model_dump()
    for finding in findings:
        if finding.section == "image":
            values.update(finding.values)
    return ImageSection.model_validate({**values, "mm_per_px": mm_per_px})


def _depth(pixels: Pixels, parent: Profile, name: str) -> list[PictureFinding]:
    kind, image = ImageKind.from_pixels(pixels), parent.image
    if image.color == "rgb" and kind.channels == 1:
        raise InputError(
            f"{name} is grey and {parent.name!r} measures colours; give --from a profile with "
            f"sequential lights, or a colour image; pins before a grey camera are not measured"
        )
    if image.color == "grey" and kind.channels == 3 and not _is_grey(pixels):
        raise InputError(
            f"{name} is in colour and {parent.name!r} takes grey images; give --from a profile "
            f"with coloured lights, or record in grey"
        )
    if kind.bits == 8:
        depth, why = 8, f"{name} has 8 bits."
    elif image.bit_depth > 8 and pixels.max() <= image.full_scale:
        return []
    else:
        brightest = int(pixels.max())
        depth = next(bits for bits in _DEPTHS if brightest < 2**bits)
        why = f"The brightest pixel of {name} has {brightest}, which needs {depth} bits."
    return [] if depth == image.bit_depth else [PictureFinding("image", why, {"bit_depth": depth})]


def _is_grey(pixels: Pixels) -> bool:
    return bool((np.ptp(pixels, axis=2) == 0).all())


def _rectify_view(parent: Profile, recorded: Crop | None, rectangle: ScaleMethod) -> PictureFinding:
    """Return the perspective warp of a rectangle of known size."""
    width_mm, height_mm = rectangle.size_mm
    xy = np.asarray(rectangle.points_px)
    crop: dict[str, Any] = _reset(parent, ("crop",))
    if recorded is not None:  # the crop is applied before the warp
        crop = {"crop": list(recorded)}
        xy = xy - recorded[:2]
    sides = np.hypot(*(np.roll(xy, -1, axis=0) - xy).T)
    long_px = max(sides[0], sides[2], (sides[1] + sides[3]) / 2 * width_mm / height_mm)
    width = round(long_px / _shrink(long_px, parent.image.width_px))
    height = round(width * height_mm / width_mm)
    if min(width, height) < 8:  # px; smaller ones are mistakes in --scale
        raise InputError(
            f"the rectangle of --scale is {width} × {height} px; give a larger one, with its "
            f"corners in the order top left, top right, bottom right, bottom left"
        )
    values = {
        **crop,
        **_reset(parent, ("flip", "rotate_deg", "lens")),
        "width_px": width,
        "height_px": height,
        "warp": {
            "source": [[round(float(v), 2) for v in point] for point in xy],
            "target": [[0, 0], [width, 0], [width, height], [0, height]],
        },
    }
    return PictureFinding(
        "image",
        f"The rectangle of {width_mm:g} × {height_mm:g} mm fills the image; the gel outside it is "
        f"not measured. 'source' holds its four corners in the camera's pixels (the crop's, if "
        f"there is one).",
        values,
    )


def _upright(
    pixels: Pixels, parent: Profile, name: str, recorded: Crop | None
) -> list[PictureFinding]:
    image, findings = parent.image, []
    camera: Size = (pixels.shape[1], pixels.shape[0])
    changed = [
        key for key in ("flip", "rotate_deg", "lens") if getattr(image, key) != _DEFAULTS[key]
    ]
    if changed:
        kept = ", ".join(changed)
        text = f"{kept}: inherited from {parent.name}; check it for this camera and its mounting."
        findings.append(PictureFinding("image", text, noted=True))
    if image.warp is not None and _contains(camera, image.warp.source):
        text = (
            f"Size, crop and warp are inherited from {parent.name}; for another camera position, "
            f"give a rectangle on the gel (--scale rectangle:24x32@…)."
        )
        return [*findings, PictureFinding("image", text, noted=True)]
    dropped = _reset(parent, ("warp",))
    crop = _crop(pixels, parent, name, recorded)
    size: Size = camera if crop.values.get("crop") is None else crop.values["crop"][2:]
    if image.crop is not None and not crop.values and recorded is None:
        size = image.crop[2:]
    if image.rotate_deg % 180:
        size = size[1], size[0]
    if crop.comment:
        findings.append(crop)
    return [*findings, _size(size, parent, name, dropped)]


def _contains(camera: Size, points: Any) -> bool:
    return all(0 <= x <= camera[0] and 0 <= y <= camera[1] for x, y in points)


def _crop(pixels: Pixels, parent: Profile, name: str, recorded: Crop | None) -> PictureFinding:
    inherited = parent.image.crop
    if recorded is not None:
        return PictureFinding("image", "The crop of the scan.", {"crop": list(recorded)})
    if inherited is not None and _holds(pixels, inherited):
        text = f"The crop is inherited from {parent.name}; check it for this camera."
        return PictureFinding("image", text, noted=True)
    lit = lit_area(pixels)
    if lit is not None:
        text = (
            f"[x, y, width, height] of the lit gel in {name}; its surroundings are darker than a "
            f"fifth of it. 'crop: null' measures the entire image."
        )
        tilted = lit.taper < 0.88  # narrow over wide end
        if tilted:
            text += (
                " The gel is wider at one end, so the camera is tilted: give the four corners of a "
                "rectangle of known size (--scale rectangle:24x32@…) to rectify the image."
            )
        return PictureFinding("image", text, {"crop": list(lit.box)}, noted=tilted)
    if inherited is not None:
        text = f"The entire image: {parent.name}'s crop reaches beyond it."
        return PictureFinding("image", text, {"crop": None})
    return PictureFinding("image", "")


def _holds(pixels: Pixels, crop: Crop) -> bool:
    return bool(crop[0] + crop[2] <= pixels.shape[1] and crop[1] + crop[3] <= pixels.shape[0])


def _size(camera: Size, parent: Profile, name: str, dropped: Mapping[str, Any]) -> PictureFinding:
    factor = _shrink(camera[0], parent.image.width_px)
    size = tuple(max(1, round(side / factor)) for side in camera)
    text = f"Size of the measured image: {camera[0]} × {camera[1]} px of {name}."
    if factor > 1:
        text += (
            f" Downscaled {factor} times to about {parent.name}'s size: larger images take longer."
        )
    if dropped:
        text += f" {parent.name}'s warp reaches beyond this camera's image and is removed."
    values: dict[str, Any] = dict(dropped)
    if size != (parent.image.width_px, parent.image.height_px):
        values |= {"width_px": size[0], "height_px": size[1]}
    return PictureFinding("image", text if values else "", values)


def _shrink(width_px: float, parents_px: int) -> int:
    """Return the factor of downscaling to about the parent's width: 2 from a ratio of 1.75 on."""
    return max(1, int(width_px / parents_px + 0.25))


def _reset(parent: Profile, keys: tuple[str, ...]) -> dict[str, Any]:
    return {key: _DEFAULTS[key] for key in keys if getattr(parent.image, key) != _DEFAULTS[key]}
