"""The files of a LeRobot v3 data set besides the frames: ``meta/``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

VERSION = "v3.0"  # Version of the format

DATA = "data/chunk-000/file-000.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
TASKS = "meta/tasks.parquet"
INFO, STATISTICS = "meta/info.json", "meta/stats.json"

_DATA_PATTERN = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
# What LeRobot itself writes: files in a folder, and the sizes at which a new file begins.
_CHUNK_FILES, _DATA_MB, _VIDEO_MB = 1000, 100, 200

# Columns that every data set has, with their types.
INDICES = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}


def info_of(frames: int, fps: int, features: dict[str, Any], sensor: str) -> dict[str, Any]:
    """Return the content of ``info.json`` for one episode."""
    indices = {
        name: {"dtype": dtype, "shape": [1], "names": None} for name, dtype in INDICES.items()
    }
    return {
        "codebase_version": VERSION,
        "robot_type": sensor,
        "total_episodes": 1,
        "total_frames": frames,
        "total_tasks": 1,
        "chunks_size": _CHUNK_FILES,
        "data_files_size_in_mb": _DATA_MB,
        "video_files_size_in_mb": _VIDEO_MB,
        "fps": fps,
        "splits": {"train": "0:1"},
        "data_path": _DATA_PATTERN,
        "video_path": None,
        "features": {**features, **indices},
    }


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write a file of ``meta/``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(values, indent=4, ensure_ascii=False), encoding="utf-8")


def write_tasks(path: Path, task: str) -> None:
    """Write the table of tasks, whose index for pandas is the task in words."""
    index = "__index_level_0__"
    columns: list[dict[str, str | None]] = [
        {"name": "task_index", "field_name": "task_index", "pandas_type": "int64"},
        {"name": None, "field_name": index, "pandas_type": "unicode"},
    ]
    numpy_types = ("int64", "object")
    described = {
        "index_columns": [index],
        "column_indexes": [],
        "columns": [
            {**column, "numpy_type": numpy_type, "metadata": None}
            for column, numpy_type in zip(columns, numpy_types, strict=True)
        ],
        "pandas_version": "2.0.0",
    }
    table = pa.table({"task_index": pa.array([0], pa.int64()), index: pa.array([task])})
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(described)}), path)


def write_episodes(path: Path, frames: int, task: str, statistics: dict[str, Any]) -> None:
    """Write the table of episodes, with the one that there is."""
    row: dict[str, Any] = {
        "episode_index": 0,
        "tasks": [task],
        "length": frames,
        "data/chunk_index": 0,
        "data/file_index": 0,
        "dataset_from_index": 0,
        "dataset_to_index": frames,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }
    for feature, values in statistics.items():
        row.update({f"stats/{feature}/{name}": value for name, value in values.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.table({name: pa.array([value]) for name, value in row.items()}), path)
