"""Component options are validated by their own models, and their paths are relative to the file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tactile_core.errors import ProfileError
from tactile_core.profiles.loader import load_profile

if TYPE_CHECKING:
    from support.own_plugins import Install

ESTIMATOR = """\
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, field_validator, model_validator
from typing_extensions import TypeAliasType

from tactile_core.interfaces.device import Options
from tactile_core.interfaces.estimator import Estimator
from tactile_core.quantities import Gradients, HeightMap


class Layer(BaseModel):
    size: int


Folder = TypeAliasType("Folder", Path)
Stack = TypeAliasType("Stack", list[Layer])


class Net(Estimator):
    class Options(Options):
        place: Folder | None = None
        stack: Stack = []
        weights: Path
        more: list[Path] = []
        table: Path | Literal["auto"] | None = "auto"
        title: str = ""
        gain: float = 1.0
        layers: list[Layer] = []

        @field_validator("gain")
        @classmethod
        def _small(cls, gain: float) -> float:
            if gain > 9:
                raise ValueError("more than the amplifier has")
            return gain

        @model_validator(mode="after")
        def _titled(self):
            if self.title == self.weights.stem:
                raise ValueError("give the title in words")
            return self

    def estimate(self, gradients: Gradients) -> HeightMap: ...
"""

PROFILE = """\
schema: 1
name: bench
image: {width_px: 320, height_px: 240, mm_per_px: 0.05}
estimators:
  height:
    use: nets.net
"""


@pytest.fixture
def nets(install: Install) -> None:
    install("nets", {"net.py": ESTIMATOR}, tactile_estimators={"net": "own_nets.net:Net"})


def write(folder: Path, options: str) -> Path:
    path = folder / "lab" / "p.yaml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(PROFILE + options, encoding="utf-8")
    return path


def problems_of(folder: Path, options: str) -> list[str]:
    with pytest.raises(ProfileError) as caught:
        load_profile(write(folder, options))
    return [f"{p.line}:{p.column}: {p.key}: {p.message}" for p in caught.value.problems]


@pytest.mark.usefixtures("nets")
def test_options_that_are_paths_are_relative_to_the_profile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write(
        tmp_path,
        "    weights: ../cnn.onnx\n    more: [a, /b]\n    table: t\n    title: x.y\n    place: p\n",
    )
    options = load_profile("lab/p.yaml").estimators["height"].options
    assert Path(options["weights"]).resolve() == tmp_path / "cnn.onnx"
    assert options["more"] == [str(tmp_path / "lab" / "a"), "/b"]
    assert options["table"] == str(tmp_path / "lab" / "t")
    assert options["title"] == "x.y"
    assert options["place"] == str(tmp_path / "lab" / "p")


CAMERA = """\
schema: 1
name: bench
image: {width_px: 320, height_px: 240, mm_per_px: 0.05}
camera: {use: core.uvc, usb_id: "046d:081b", product: C310, fps: 30}
"""


@pytest.mark.parametrize(
    ("own", "chosen"),
    [
        ("fps: 25", {"usb_id", "product"}),
        ("product: See3CAM", {"product"}),
        ("serial: A1, port: 1-2", {"serial", "port"}),
    ],
)
def test_a_profile_that_chooses_its_device_drops_the_parents_choice(
    tmp_path: Path, own: str, chosen: set[str]
) -> None:
    (tmp_path / "parent.yaml").write_text(CAMERA, encoding="utf-8")
    path = tmp_path / "mine.yaml"
    path.write_text(f"extends: parent.yaml\nname: mine\ncamera: {{{own}}}\n", encoding="utf-8")
    options = load_profile(path).camera.options
    assert chosen == {"usb_id", "product", "serial", "port"}.intersection(options)
    assert "fps" in options


@pytest.mark.usefixtures("nets")
def test_a_literal_option_is_not_taken_for_a_path(tmp_path: Path) -> None:
    options = load_profile(write(tmp_path, "    weights: ~/w\n    table: auto\n")).components
    assert options["estimators.height"].options["table"] == "auto"
    assert options["estimators.height"].options["weights"] == str(Path("~/w").expanduser())


@pytest.mark.usefixtures("nets")
def test_each_wrong_option_is_reported_at_its_line(tmp_path: Path) -> None:
    options = "    wieghts: w\n    gain: 10\n    layers:\n      - {size: 1}\n      - {size: big}\n"
    assert problems_of(tmp_path, options) == [
        "7:5: estimators.height.wieghts: unknown key; did you mean 'weights'?",
        "8:5: estimators.height.gain: more than the amplifier has",
        "11:10: estimators.height.layers.1.size: should be a whole number, not 'big'",
    ]


@pytest.mark.usefixtures("nets")
def test_an_error_of_the_whole_component_is_reported_at_its_key(tmp_path: Path) -> None:
    assert problems_of(tmp_path, "    weights: net.bin\n    title: net\n") == [
        "5:3: estimators.height: give the title in words"
    ]


@pytest.mark.usefixtures("nets")
def test_a_missing_required_option_is_reported(tmp_path: Path) -> None:
    assert problems_of(tmp_path, "") == ["5:3: estimators.height.weights: is missing; add it"]


def test_an_import_failure_is_reported_at_the_use_of_the_plugin(
    tmp_path: Path, install: Install
) -> None:
    install("nets", {"net.py": "1 / 0"}, tactile_estimators={"net": "own_nets.net:Net"})
    (problem,) = problems_of(tmp_path, "    weights: w\n")
    assert problem.startswith("6:5: estimators.height.use: ")
    assert "tactile-nets 1.0" in problem
    assert "ZeroDivisionError" in problem


def test_the_starting_bundle_is_relative_to_the_file_that_names_it(tmp_path: Path) -> None:
    design = tmp_path / "design" / "finger.yaml"
    design.parent.mkdir()
    design.write_text(
        "schema: 1\nname: finger\nimage: {width_px: 64, height_px: 48, mm_per_px: 0.1}\n"
        "starting_bundle: start\n"
    )
    mine = tmp_path / "mine.yaml"
    mine.write_text("extends: design/finger.yaml\nname: mine\n")
    assert load_profile(mine).starting_bundle == design.parent.resolve() / "start"
    assert load_profile(mine, sim=True).starting_bundle is None
