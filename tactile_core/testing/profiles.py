"""Checks of the profiles in a plugin, and of the shipped profiles that use the plugin.

Each profile's pipeline measures virtual presses rendered from the profile, and its virtual sensor
is opened.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice

import numpy as np

from tactile_core.bundles.bundle import Bundle
from tactile_core.calibration.virtual_unit import virtual_unit
from tactile_core.formats.yaml_tree import Node, read_yaml
from tactile_core.pipeline.initial_reference import FIRST
from tactile_core.pipeline.pipeline import Pipeline
from tactile_core.pipeline.sensor import Sensor
from tactile_core.plugins.options import calibrator_of
from tactile_core.profiles.loader import list_profiles, load_profile
from tactile_core.profiles.model import Profile
from tactile_core.testing.checks import Suite, check
from tactile_core.testing.differences import (
    CannotCheck,
    depend_on,
    pickling_fault,
    report,
    report_errors,
)
from tactile_core.testing.registered import ProfileFile
from tactile_core.testing.virtual_presses import full_rig, simulator

# Matches absolute paths except devices.
_ABSOLUTE = re.compile(r"(/(?!dev/)|~|\\\\|[A-Za-z]:[\\/])\S")


class ProfileChecks(Suite):
    """Validity of a profile on every machine."""

    @check("profile")
    def test_profile(self, profile: ProfileFile) -> None:
        """It is valid: no unknown key, and every component and extended profile exists."""
        with report_errors(
            profile,
            "it is not valid",
            why="the sensor cannot be opened",
            do="correct the file; check it with 'tactile validate'",
        ):
            load_profile(profile.path)

    @check("profile")
    def test_profile_name(self, profile: ProfileFile) -> None:
        """Its name equals the file's name and is unique among the profiles."""
        name = self._load_profile(profile).name
        same = [e for e in list_profiles() if e.name == profile.path.stem]
        others = [e.origin for e in same if e.path.resolve() != profile.path.resolve()]
        found = ""
        if name != profile.path.stem:
            found = f"it is named {name!r}, but its file {profile.path.name!r}"
        elif others:
            found = f"a profile of this name already exists ({', '.join(others)})"
        report(
            profile,
            found,
            why="profiles are opened by the file's name, and bundles store the profile's name",
            do="rename one of them",
        )

    @check("profile")
    def test_profile_paths(self, profile: ProfileFile) -> None:
        """It contains no absolute path, except devices."""
        with depend_on("profile"):
            tree, _ = read_yaml(profile.path)
        for node in _scalars(tree):
            absolute = isinstance(node.value, str) and _ABSOLUTE.match(node.value)
            report(
                f"{profile}:{node.place.line}",
                f"it contains the absolute path {node.value!r}" if absolute else "",
                why="that folder exists only on one machine",
                do="put the file next to the profile and use a relative path",
            )

    @check("profile")
    def test_starting_bundle(self, profile: ProfileFile) -> None:
        """The starting calibration that it names is one, and measures images of its size."""
        loaded = self._load_profile(profile)
        if loaded.starting_bundle is None:
            return
        with report_errors(
            profile,
            "its starting bundle cannot be used",
            why="a sensor that is not calibrated cannot be opened",
            do="make it with 'tactile starting-calibration', and name its folder",
        ):
            bundle = Bundle.load(loaded.starting_bundle)
            bundle.check(loaded)
        whose = "" if bundle.manifest.starting else "its starting bundle is that of one unit"
        report(
            profile,
            whose,
            why="every unit would be measured as if it were that one",
            do="make it with 'tactile starting-calibration'",
        )

    @check("profile")
    def test_pipeline(self, profile: ProfileFile) -> None:
        """Every step of its pipeline measures a virtual press, also after pickling."""
        loaded = self._load_profile(profile)
        simulator()
        if calibrator_of(loaded.calibration).refusal:
            raise CannotCheck("no virtual press of a ball calibrates this sensor")
        if full_rig(loaded) is None:
            raise CannotCheck("no virtual press can be rendered with this illumination")
        with report_errors(
            profile,
            "its pipeline fails on a virtual press",
            why="no recording of this sensor could be measured",
            do="see the checks of its components, and its image section",
        ):
            unit = virtual_unit(loaded, stroke_frames=2)
            pipeline = Pipeline(loaded, unit.bundle)
            reading = pipeline.process(unit.stroke[0])
        idle = [name for name in loaded.estimators if name not in reading.steps]
        report(
            profile,
            f"the steps {', '.join(idle)} do not run on a calibrated unit" if idle else "",
            why="users of the sensor never receive these quantities",
            do="add the steps that provide their inputs, or remove them",
        )
        pipeline.reset()
        frame = unit.stroke[1]
        found = pickling_fault(pipeline, lambda one: one.process(frame).steps)
        report(
            profile,
            found and f"of its pipeline: {found}",
            why="a Pipeline is pickled to run in other processes",
            do="see the pickling checks of its components",
        )

    @check("profile")
    def test_virtual_sensor(self, profile: ProfileFile) -> None:
        """Its virtual sensor gives frames of the profile's size, and a press changes them."""
        self._load_profile(profile)
        simulator()
        why = "--sim runs a profile without its hardware"
        do = "correct the lights or the gel in the profile, or override them under 'sim:'"
        with report_errors(profile, "its virtual sensor does not run", why=why, do=do):
            virtual_profile = load_profile(profile.path, sim=True)
            with Sensor(virtual_profile, reference=FIRST).open() as sensor:
                # [frames] They reach from the undeformed surface into a press
                frames = [reading.frame for reading in islice(sensor.stream(), 6)]
        image = virtual_profile.image
        sizes = {frame.pixels.shape[1::-1] for frame in frames}
        found = ""
        if sizes != {(image.width_px, image.height_px)}:
            found = f"its virtual sensor gives images of {sizes}"
        elif np.array_equal(frames[0].pixels, frames[-1].pixels):
            found = "its virtual sensor gives the same image when a ball presses"
        report(profile, found, why=why, do=do)

    def _load_profile(self, profile: ProfileFile) -> Profile:
        with depend_on("profile"):
            return load_profile(profile.path)


def _scalars(node: Node) -> Iterator[Node]:
    if isinstance(node.value, dict):
        for child in node.value.values():
            yield from _scalars(child)
    elif isinstance(node.value, tuple):
        for child in node.value:
            yield from _scalars(child)
    else:
        yield node
