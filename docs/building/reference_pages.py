"""The Python reference: pages of the site that are made of the docstrings when it is prepared."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cache

import reference_source as source
from docstring_markdown import markdown, summary
from reference_source import Entry

PUBLIC = {
    "sensor": ("Sensor and pipeline", ("pipeline", "acquisition")),
    "files": ("Files, bundles and profiles", ("formats", "bundles", "profiles")),
    "recordings": ("Recordings", ("recordings",)),
    "quantities": ("Quantities", ("quantities",)),
    "interfaces": ("Interfaces", ("interfaces",)),
    "errors": ("Errors", ("errors",)),
}
"""Pages of the names that ``tactile_core`` offers: title, and the packages that define them."""

FURTHER = {
    "files": ("tactile_core.formats.npz.read_quantities",),
    "sensor": (
        "tactile_core.calibration.fitting.calibrate",
        "tactile_core.plugins.registry.resolve",
        "tactile_core.plugins.registry.list_plugins",
        "tactile_sim.VirtualStage",
        "tactile_sim.Faults",
    ),
    "recordings": (
        "tactile_core.recordings.recording.open_recording",
        "tactile_core.recordings.recording.Recording",
        "tactile_core.recordings.running_recording.RunningRecording",
        "tactile_core.interfaces.recording_writer.RecordedSession",
        "tactile_core.recordings.recovery.recover",
    ),
}
"""Names on these pages that are promised under their own module."""

ALGORITHMS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "light": (
        "Light",
        "The reference, the drift of the lights, and whether an image shows the gel.",
        ("light",),
    ),
    "slopes": ("Slopes", "From intensities to surface slopes.", ("slopes",)),
    "poisson": ("Poisson integration", "From surface slopes to height.", ("poisson",)),
    "contact": (
        "Contact and surface shape",
        "The contact area, and the undeformed surface that heights refer to.",
        ("contact", "heights"),
    ),
    "circles": (
        "Ball contacts",
        "Where a ball touched, found from shading alone, for calibration.",
        ("circles",),
    ),
    "markers": (
        "Markers",
        "Centres and masks of printed markers, and the same marker from frame to frame.",
        ("markers",),
    ),
    "displacement": (
        "Displacement fields",
        "A dense displacement field from markers or from optical flow.",
        ("displacement",),
    ),
    "force": (
        "Force",
        "An elastic layer on a rigid plate, and forces fitted to features of readings.",
        ("force",),
    ),
    "slip": (
        "Slip",
        "Stick, incipient slip and gross slip: shear, imprint, loss of contact, friction.",
        ("slip",),
    ),
    "arrays": ("Array helpers", "Filters, regression and sampling.", ("arrays",)),
}
"""Pages of ``tactile_core.algorithms``: title, purpose, and modules or packages."""

MODELS = {
    "six-led-model": (
        "Model of the six-LED rig",
        "Photometric stereo under sequential lights.",
        ("tactile_desktop_six_led",),
    ),
    "four-colour-model": (
        "Model of the four-colour rig",
        "Slopes from hue and intensity.",
        ("tactile_baxter_fingertip",),
    ),
    "virtual-gel": (
        "Virtual gel",
        "Contact mechanics of a bonded elastic layer.",
        (
            "tactile_sim.gel_surface",
            "tactile_sim.normal_contact",
            "tactile_sim.friction",
        ),
    ),
    "virtual-light": (
        "Virtual light",
        "Rendering of the gel surface in the light of a rig.",
        (
            "tactile_sim.optics.rig",
            "tactile_sim.optics.sources",
            "tactile_sim.optics.lights",
            "tactile_sim.optics.shadows",
            "tactile_sim.optics.sources",
            "tactile_sim.optics.surface",
            "tactile_sim.optics.markers",
        ),
    ),
    "virtual-camera": (
        "Virtual camera",
        "Light to pixel values, and the defects of a rig.",
        (
            "tactile_sim.optics.camera",
            "tactile_sim.optics.faults",
        ),
    ),
}
"""Pages outside ``tactile_core.algorithms``: title, purpose, and full names."""


@cache
def pages() -> dict[str, str]:
    """Return the text of every page by its file name."""
    written = {f"{page}.md": _public_page(page) for page in PUBLIC}
    written |= {f"{page}.md": _modules_page(*entry) for page, entry in _algorithms().items()}
    written |= {f"{page}.md": _modules_page(*entry) for page, entry in MODELS.items()}
    return {"index.md": _index()} | written


def names_on(page: str) -> list[str]:
    """Return the full names on a page of public names."""
    packages = PUBLIC[page][1]
    own = [name for name in source.public_names() if name.split(".")[1] in packages]
    return [*own, *FURTHER.get(page, ())]


def _index() -> str:
    lines = [
        "# Python reference",
        "",
        "Signatures and docstrings. What stays compatible between versions is listed under",
        "[compatibility](../compatibility.md).",
        "",
        "## Public names",
        "",
    ]
    for page, (title, _) in PUBLIC.items():
        short = [f"[`{n}`]({page}.md#{_anchor(n)})" for n in map(_short, names_on(page))]
        lines += [f"- [{title}]({page}.md): {', '.join(short)}"]
    lines += [
        "",
        "## Algorithms",
        "",
        "Pure functions on arrays, below `tactile_core.algorithms`. They are not part of the",
        "promise of compatibility, but each can be used alone.",
        "",
    ]
    lines += _links(ALGORITHMS)
    lines += ["", "## Models", "", "The models behind the rigs and the virtual sensors.", ""]
    lines += _links(MODELS)
    return "\n".join(lines) + "\n"


def _public_page(page: str) -> str:
    entries = [(name, source.entry(name)) for name in names_on(page)]
    parts = [f"# {PUBLIC[page][0]}", _contents([entry for _, entry in entries])]
    for name, entry in entries:
        module = name.rpartition(".")[0] if name in FURTHER.get(page, ()) else source.PACKAGE
        parts += _sections(entry, 2, f"`from {module} import {entry.name}`")
    return "\n\n".join(parts) + "\n"


def _links(listed: dict[str, tuple[str, str, tuple[str, ...]]]) -> list[str]:
    return [f"- [{title}]({page}.md): {purpose}" for page, (title, purpose, _) in listed.items()]


def _algorithms() -> dict[str, tuple[str, str, tuple[str, ...]]]:
    """Return the pages of the algorithms with full names."""
    package = f"{source.PACKAGE}.algorithms"
    return {
        page: (title, purpose, tuple(f"{package}.{name}" for name in names))
        for page, (title, purpose, names) in ALGORITHMS.items()
    }


def _modules_page(title: str, purpose: str, names: Sequence[str]) -> str:
    parts = [f"# {title}", purpose]
    for name in names:
        for module in source.modules_below(name):
            entries = source.entries(module)
            text = source.docstring(module)
            if not entries and not text:
                continue
            heading = module.removeprefix("tactile_core.").removeprefix("algorithms.")
            parts += [f"## {heading}", f"`{module}`"]
            parts += [markdown(text)] if text else []
            for entry in entries:
                parts += _sections(entry, 3)
    return "\n\n".join(parts) + "\n"


def _sections(entry: Entry, level: int, under: str = "") -> Iterator[str]:
    """Yield an entry's heading, signature and docstring, then those of its members."""
    yield f"{'#' * level} {entry.name}"
    if under:
        yield under
    yield f"```python\n{entry.signature}\n```"
    if entry.docstring:
        yield markdown(entry.docstring)
    for member in entry.members:
        yield from _sections(member, level + 1)


def _contents(entries: Sequence[Entry]) -> str:
    """Return a table of names and what they are."""
    rows = [f"| [`{e.name}`](#{_anchor(e.name)}) | {summary(e.docstring)} |" for e in entries]
    return "\n".join(["| name | |", "| --- | --- |", *rows])


def _anchor(heading: str) -> str:
    return re.sub(r"[^\w]+", "-", heading.lower()).strip("-")


def _short(name: str) -> str:
    return name.rpartition(".")[2]
