"""A plugin that imports well and whose components are each wrong in a way of their own."""

from __future__ import annotations

from collections.abc import Mapping

from tactile_core.interfaces.hookspecs import hookimpl


@hookimpl
def tactile_estimators() -> Mapping[str, str]:
    return {
        "camera_instead": "fake_clumsy.parts:NotAnEstimator",
        "function_instead": "fake_clumsy.parts:function",
        "no_class": "fake_clumsy.parts:Missing",
        "no_colon": "fake_clumsy.parts",
        "no_module": "fake_clumsy.nowhere:Missing",
        "quits": "fake_quitter:Missing",
    }


@hookimpl
def tactile_cameras() -> Mapping[str, str]:
    return {"unfinished": "fake_clumsy.parts:UnfinishedCamera"}


@hookimpl
def tactile_profiles() -> str:
    return "a folder that is not there"
