"""Comparison of variants: each differs in one step and is scored against the same truth."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.virtual_lab import BALL_MM, VirtualLab

from tactile_core.algorithms.heights.sphere import BallPress
from tactile_core.calibration.virtual_unit import virtual_unit
from tactile_core.errors import InputError, PluginError, ProfileError
from tactile_core.evaluation.comparison import Comparison, compare, parse_swap, variants_of
from tactile_core.evaluation.comparison.report import comparison_page, comparison_table
from tactile_core.formats.npz import write_npz

PRESSES = {
    "left": BallPress((60.0, 55.0), BALL_MM, 0.8),
    "right": BallPress((100.0, 70.0), 5.0, 0.6),
}


@pytest.fixture(scope="module")
def recorded(lab: VirtualLab, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two frames in ``in``, their truth in ``truth``, and a second, poorer bundle."""
    folder = tmp_path_factory.mktemp("recorded")
    section = lab.profile.image
    for name, press in PRESSES.items():
        lab.save(folder / "in" / f"{name}.png", press)
        height = press.height_mm((section.height_px, section.width_px), section.mm_per_px)
        gy, gx = np.gradient(height, section.mm_per_px)
        (folder / "truth").mkdir(exist_ok=True)
        truth = {
            "height_mm": height.astype(np.float32),
            "gradients": np.dstack([gx, gy]).astype(np.float32),
            "contact": height > height.max() - press.depth_mm,
            "mm_per_px": section.mm_per_px,
        }
        write_npz(folder / "truth" / f"{name}.npz", truth)
    few_presses = virtual_unit(lab.profile, model="core.polynomial")
    few_presses.bundle.save(folder / "polynomial")
    return folder


@pytest.fixture(scope="module")
def result(lab: VirtualLab, recorded: Path) -> Comparison:
    """The unchanged profile, a swap for the same estimator, another estimator, another bundle."""
    return compare(
        lab.profile_path,
        input=recorded / "in",
        truth=recorded / "truth",
        swaps=[
            ("height", "core.poisson"),
            ("height", "core.robust_poisson"),
            ("calibration", str(recorded / "polynomial")),
        ],
        bundle=lab.bundle,
    )


def test_the_unchanged_profile_comes_first(result: Comparison) -> None:
    assert [variant.name.partition("=")[0] for variant in result.variants] == [
        "as it is",
        "height",
        "height",
        "calibration",
    ]
    assert result.frames == 2


def test_a_virtual_ball_is_measured_well(result: Comparison) -> None:
    accuracy = result.variants[0].accuracy
    assert accuracy["normal_error_in_contact_deg"]["mean"] < 4
    assert accuracy["height_rmse_mm"] < 0.1
    assert accuracy["iou"]["contact"] > 0.5


def test_swapping_a_step_for_itself_changes_no_score(result: Comparison) -> None:
    assert result.variants[1].accuracy == result.variants[0].accuracy


def test_another_height_step_leaves_the_normals(result: Comparison) -> None:
    plain, robust = result.variants[0].accuracy, result.variants[2].accuracy
    assert robust["normal_error_deg"] == plain["normal_error_deg"]


def test_a_swapped_bundle_scores_like_that_bundle_alone(
    lab: VirtualLab, recorded: Path, result: Comparison
) -> None:
    alone = compare(
        lab.profile_path,
        input=recorded / "in",
        truth=recorded / "truth",
        bundle=recorded / "polynomial",
    )
    assert alone.variants[0].accuracy == result.variants[3].accuracy
    assert alone.variants[0].accuracy != result.variants[0].accuracy


def test_every_variant_is_timed_equally_often_and_has_its_memory_measured(
    result: Comparison,
) -> None:
    assert len({len(variant.latency_ms) for variant in result.variants}) == 1
    assert len(result.variants[0].latency_ms) == result.frames - 1  # the first prepares tables
    assert all(variant.peak_memory_mib is None or variant.peak_memory_mib > 20
               for variant in result.variants)  # fmt: skip


def test_the_figures_show_the_frame_with_the_highest_truth(result: Comparison) -> None:
    heights = {name: press.height_mm((120, 160), 0.1245).max() for name, press in PRESSES.items()}
    assert result.shown == max(heights, key=lambda name: heights[name])
    shown = comparison_page(result)
    # the truth, and for each variant its height and its error
    assert shown.count("<img") == 1 + 2 * len(result.variants)


def test_the_table_has_a_cell_for_each_column(result: Comparison) -> None:
    header, rows = comparison_table(result)
    assert {len(row) for row in rows} == {len(header)}


def test_no_pixel_is_left_out_of_the_score(lab: VirtualLab, recorded: Path) -> None:
    # The truth is a constant offset, so undeformed pixels contribute the full error.
    folder = recorded / "raised"
    folder.mkdir()
    for name in PRESSES:
        write_npz(folder / f"{name}.npz", {"height_mm": np.full((120, 160), 50.0, np.float32)})
    raised = compare(lab.profile_path, input=recorded / "in", truth=folder, bundle=lab.bundle)
    assert raised.variants[0].accuracy["height_rmse_mm"] == pytest.approx(50, rel=0.01)


def test_each_swap_is_one_change_on_its_own(lab: VirtualLab) -> None:
    variants = variants_of(
        lab.profile_path, [("height", "core.robust_poisson"), ("contact", "core.contact")]
    )
    used = [[v.profile.estimators[s].use for s in ("height", "contact")] for v in variants]
    assert used == [
        ["core.poisson", "core.contact"],
        ["core.robust_poisson", "core.contact"],
        ["core.poisson", "core.contact"],
    ]


def test_a_swap_may_set_options_of_its_estimator(lab: VirtualLab) -> None:
    swap = "height", "{use: core.robust_poisson, rounds: 7}"
    _, variant = variants_of(lab.profile_path, [swap])
    height = variant.profile.estimators["height"]
    assert height.use == "core.robust_poisson"
    assert height.options["rounds"] == 7


@pytest.mark.parametrize(
    ("swap", "error", "message"),
    [
        (("height", "{rounds: 7}"), InputError, "name the estimator"),
        (("heigth", "core.poisson"), InputError, "did you mean 'height'"),
        (("height", "core.poison"), PluginError, "did you mean 'poisson'"),
        (("calibration", "core.mlp"), InputError, "tactile calibrate … --model core.mlp"),
        (("calibration", "no/such/folder"), InputError, "there is no such folder"),
    ],
)
def test_an_impossible_swap_is_refused(
    lab: VirtualLab, swap: tuple[str, str], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        variants_of(lab.profile_path, [swap])


def test_an_estimator_that_does_not_fit_its_step_is_refused_by_name(
    lab: VirtualLab, recorded: Path
) -> None:
    with pytest.raises(ProfileError, match=r"^height=core\.contact: "):
        compare(
            lab.profile_path,
            input=recorded / "in",
            truth=recorded / "truth",
            swaps=[("height", "core.contact")],
            bundle=lab.bundle,
        )


def test_a_frame_without_truth_is_refused_before_anything_is_measured(
    lab: VirtualLab, recorded: Path
) -> None:
    with pytest.raises(InputError, match=r"no press_0\.npz with the truth of that frame"):
        compare(lab.profile_path, input=lab.presses, truth=recorded / "truth", bundle=lab.bundle)


def test_a_sensor_that_measures_nothing_of_the_truth_is_refused(
    lab: VirtualLab, recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with pytest.raises(InputError, match="--bundle"):
        compare(lab.profile_path, input=recorded / "in", truth=recorded / "truth")


def test_a_swap_needs_an_equals_sign() -> None:
    assert parse_swap("height=a.b") == ("height", "a.b")
    with pytest.raises(InputError, match="STEP=USE"):
        parse_swap("height")


def test_the_command_prints_one_object_and_writes_a_page(
    lab: VirtualLab, recorded: Path, tmp_path: Path
) -> None:
    done = subprocess.run(
        [
            *(sys.executable, "-m", "tactile_core.cli", "compare", str(lab.profile_path)),
            *("--input", str(recorded / "in"), "--truth", str(recorded / "truth")),
            *("--bundle", str(lab.bundle), "--swap", "height=core.robust_poisson"),
            *("--out", str(tmp_path / "out"), "--json"),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    assert [v["variant"] for v in printed["variants"]] == ["as it is", "height=core.robust_poisson"]
    assert {"mean", "median", "p90"} == set(printed["variants"][0]["normal_error_deg"])
    assert {"median", "p90"} == set(printed["variants"][0]["latency_ms"])
    assert (tmp_path / "out" / "report.html").is_file()
