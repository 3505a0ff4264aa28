"""The fuzzed areas: each builds an attempt from random numbers and mutates its inputs."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from fuzz.areas import (
    bad_disks,
    calls,
    clocks,
    command_lines,
    damaged_recordings,
    faulty_plugins,
    foreign_frames,
    inputs,
    interruptions,
    live_pages,
)
from fuzz.attempt import Attempt
from fuzz.sandbox import Sandbox

Area = Callable[[Sandbox, Random], Attempt]

AREAS: dict[str, tuple[Area, int]] = {
    "options": (command_lines.options, 240),
    "outputs": (command_lines.outputs, 120),
    "profiles": (inputs.profiles, 240),
    "images": (inputs.images, 200),
    "folders": (inputs.folders, 160),
    "videos": (inputs.videos, 100),
    "scans": (inputs.scans, 140),
    "targets": (inputs.targets, 120),
    "labels": (inputs.labels, 100),
    "bundles": (inputs.bundles, 200),
    "scripts": (inputs.scripts, 120),
    "truths": (inputs.truths, 30),
    "python": (calls.entry_points, 260),
    "plugins": (faulty_plugins.faulty_parts, 160),
    "frames": (foreign_frames.foreign_frames, 120),
    "clocks": (clocks.clocks, 80),
    "damage": (damaged_recordings.damaged, 120),
    "pages": (live_pages.pages, 40),
    "disks": (bad_disks.failing, 200),
    "signals": (interruptions.in_the_middle, 80),
    "streams": (interruptions.streams, 50),
    "writers": (interruptions.two_writers, 40),
    "shells": (interruptions.from_a_shell, 20),
}
"""Each area with its number of cases in 'make fuzz'."""
