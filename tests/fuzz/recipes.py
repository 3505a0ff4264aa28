"""Command lines that succeed with the corpus; every case mutates one of them."""

from __future__ import annotations

from shlex import split

RUN = split("run small.yaml --bundle bundle --input frames --out out --save npz,tmd,png,ply --json")
RUN_IMAGE = split("run small.yaml --bundle bundle --input frame.jpg --reference ref.png --out out")
RUN_VIDEO = split("run small.yaml --bundle bundle --input film.avi --frames 3 --out out --json")
RUN_SCAN = split("run turn.yaml --bundle turn_bundle --input scan --out out --save npz,png --json")
RUN_SCANS = split("run turn.yaml --bundle turn_bundle --input scans --out out --json")
RUN_MARKED = split("run marked.yaml --input sheared/frames --reference sheared/reference --json")
RUN_FIRST = split("run marked.yaml --input sheared/frames --reference first --tare-frame 1")
RUN_SIM = split("run small.yaml --sim --script script.yaml --frames 2 --json")
CALIBRATE = split(
    "calibrate small.yaml --presses presses --reference ref.png --ball-diameter-mm 3 --out fresh "
    "--json"
)
CALIBRATE_LABELS = split(
    "calibrate small.yaml --presses presses --reference ref.png --ball-diameter-mm 3 "
    "--labels labels.csv --out fresh --serial 7"
)
CALIBRATE_GRID = split(
    "calibrate small.yaml --presses balls.png --reference ref.png --target grid.yaml --out fresh "
    "--json"
)
CALIBRATE_MAP = split(
    "calibrate turn.yaml --presses scan --reference level --target map.tmd --rows 0:60 --out fresh"
)
SIMULATE = split("simulate small.yaml --script script.yaml --out fresh --mode fast --json")
NEW = split("new mine --from small.yaml --image ref.png --scale 0.1 --out mine.yaml")
NEW_PLUGIN = split(
    "new mine --from hex_fingertip_unmarked --image ref.png --scale 0.1 --plugin --out pack"
)
NEW_PRESSES = split(
    "new mine --from small.yaml --image ref.png --scale 0.1 --presses presses "
    "--ball-diameter-mm 3 --out mine.yaml"
)
RUN_LIT = split("run lit.yaml --bundle lit_bundle --input lit/frames --reference lit.png --json")
_TAPE = "run small.yaml --bundle bundle --json --input"
RUN_MCAP, RUN_HDF5, RUN_FOLDER = (split(f"{_TAPE} {n}") for n in ("tape.mcap", "tape.h5", "tape"))
RUN_RECORD = split("run small.yaml --bundle bundle --input frames --save npz,record --out out")
RECORD = split(
    "record small.yaml --bundle bundle --input frames --reference ref.png --readings --out new.mcap"
)
RECORD_FOLDER = split("record small.yaml --input frames --reference first --out new")
CONVERT, CONVERT_HDF5, CONVERT_FOLDER = (
    split(words)
    for words in ("convert tape.mcap new.h5", "convert tape.h5 new.mcap", "convert tape new.mcap")
)
RECOVER = split("recover cut.mcap --out new.mcap")
COMPARE = split(
    "compare small.yaml --input played/frames --truth played/truth --bundle bundle --out page "
    "--json"
)
VALIDATE = split("validate small.yaml turn.yaml marked.yaml touched.yaml")
DOCTOR = split("doctor small.yaml --sim")
PROFILES, PLUGINS, SCHEMA = ["profiles", "--json"], ["plugins", "--json"], ["schema"]

RUNS = (RUN, RUN_IMAGE, RUN_VIDEO, RUN_SCAN, RUN_SCANS, RUN_MARKED, RUN_FIRST, RUN_SIM)
CALIBRATIONS = (*(CALIBRATE, CALIBRATE_LABELS, CALIBRATE_GRID, CALIBRATE_MAP),)
RECORDING = (RECORD, RECORD_FOLDER, RUN_RECORD, CONVERT, CONVERT_HDF5, CONVERT_FOLDER, RECOVER)
WRITING = (RUN, RUN_SCAN, RUN_VIDEO, *CALIBRATIONS, SIMULATE, NEW, NEW_PLUGIN)
OTHERS = (NEW, NEW_PLUGIN, NEW_PRESSES, VALIDATE, DOCTOR, PROFILES, PLUGINS, SCHEMA)
ALL = (*RUNS, *CALIBRATIONS, SIMULATE, *OTHERS)
