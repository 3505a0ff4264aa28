PYTHON ?= python3.11
BIN := .venv/bin
ONE_CORE := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 OPENCV_FOR_THREADS_NUM=1
# One more than the processors, because devices are waited for.
PARALLEL := --numprocesses $(shell $(PYTHON) -c "import os; print(os.cpu_count() + 1)") --dist worksteal
FURTHER := 3.12 3.13 3.14
PYENV := $(subst $() $(),:,$(wildcard $(shell pyenv root 2>/dev/null)/versions/*/bin))
# What another Python or numpy may break: annotations, every kind of output, one plugin of each kind, the public names.
PORTABLE = tests/algorithms/arrays/test_annotations.py tests/quantities tests/formats tests/plugins tests/interfaces tests/profiles \
    tests/recordings/test_recorded_formats.py tests/recordings/test_inputs.py tests/recordings/test_saved_inputs.py \
    tests/builtin/test_result_files.py tests/pipeline/test_chain.py tests/pipeline/test_pipeline.py \
    tests/docs/test_pages.py::test_the_promised_names_are_the_public_names $(wildcard $(WITH_PORTABLE:%=%/tests/test_*_conformance.py)) \
    plugins/tactile-lerobot plugins/tactile-rosbag
WITH_PORTABLE = $(SHIPPED) plugins/tactile-lerobot plugins/tactile-rosbag
TIMED := benchmarks --benchmark-only --benchmark-columns=median,min --benchmark-sort=name
SOAK ?= 1
# Every distribution beside the core; what the two commands of the README install, and the rest, each with an environment of its own.
PLUGINS := $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml))
SHIPPED := $(addprefix plugins/tactile-,desktop-six-led baxter-fingertip hex-fingertip gelsight-mini gelsight-wedge gelslim tactip digit 9dtact genicam hdf5 imports sim live networks)
# Installed in LeRobot's environment, which tactile-core need not share, and tested from this one.
IN_LEROBOT := plugins/lerobot_camera_tactile
OTHERS := $(filter-out $(SHIPPED) $(IN_LEROBOT),$(PLUGINS))
# Hundreds of tests start a Python, which would otherwise compile all that it imports anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test test-others $(OTHERS:plugins/%=test-%) test-pages test-exports screenshots test-hardware test-oldest test-pythons headline lint soak soak-alone soak-together fuzz mutants bench docs wheels try-wheels clean

demo: .venv/installed
	$(BIN)/tactile demo --out demo

# On all cores.
test: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL)

# The distributions that bring large libraries, or one that few need: make test-others, or one of them by its name, as in make test-tactile-train.
test-others: $(OTHERS:plugins/%=test-%)

$(OTHERS:plugins/%=test-%): test-%: .venv-%/installed
	.venv-$*/bin/python -m pytest plugins/$*

# What the documentation prints is run, the examples' own tests, and the live page in Debian's Chromium; skips with a reason where
# that is not installed.
test-pages: .venv/installed
	.ci/packages
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[page-tests]' -e plugins/tactile-lerobot -e plugins/tactile-rosbag -e plugins/tactile-ros2
	$(BIN)/python -m pytest $(PARALLEL) -m pages -rs

# The documentation's pictures of the live page, taken anew.
screenshots: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[page-tests]'
	TACTILE_SCREENSHOTS=$(CURDIR)/docs/images $(BIN)/python -m pytest -m pages plugins/tactile-live/tests -k 'documentation or calibration_is_led'

# Real drivers in a virtual machine, with emulated devices; skips with a reason what cannot run here.
test-hardware: .venv/installed
	.ci/packages
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[hardware-tests]'
	$(ONE_CORE) $(BIN)/python -m pytest -m hardware -rs tests/hardware

# Exports, read back by the programs that they are for, and cameras in LeRobot; their packages are large.
test-exports: .venv/installed .venv-lerobot/installed
	$(MAKE) .venv-lerobot-3.12/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[record]' -e plugins/tactile-lerobot -e plugins/tactile-rerun -e plugins/tactile-rosbag 'hdf5plugin>=4.4'
	$(BIN)/python -m pytest -rs plugins/tactile-lerobot $(IN_LEROBOT) plugins/tactile-rerun plugins/tactile-rosbag plugins/tactile-hdf5 tests/cli/test_convert.py

# The same with the oldest versions that pyproject.toml admits.
test-oldest: .venv-oldest/installed
	.venv-oldest/bin/python -m pytest $(PARALLEL)

# What is portable, on every newer interpreter that is on this machine, with the newest and the oldest versions that it takes.
test-pythons: export PATH := $(PATH):$(PYENV)
test-pythons: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	@for version in $(FURTHER); do \
	    $(BIN)/uv python find --quiet --no-python-downloads $$version >/dev/null 2>&1 || { echo "Python $$version: not run, as it is not installed"; continue; }; \
	    for versions in highest lowest-direct; do \
	        echo "Python $$version, $$versions versions"; \
	        venv=.venv-$$version-$$versions; \
	        $(BIN)/uv venv --quiet --clear --no-python-downloads --python $$version $$venv || exit; \
	        $(BIN)/uv pip install --quiet --python $$venv --resolution $$versions -e '.[dev]' $(WITH_PORTABLE:%=-e %) || exit; \
	        $$venv/bin/python -m pytest $(PARALLEL) --quiet $(PORTABLE) || exit; \
	    done; \
	done

# Published figures, on all the recordings that they speak of.
headline: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL) -m headline tests

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	PYTHONPATH=$(subst $() $(),:,$(OTHERS) $(IN_LEROBOT)) $(BIN)/lint-imports

# What runs for minutes: thousands of frames and of openings, hundreds of unplugs; SOAK=0.1 runs a tenth.
soak: soak-alone soak-together

# A webcam's 30 Hz through the whole chain, which needs a processor for itself.
soak-alone: .venv/installed
	TACTILE_SOAK=$(SOAK) $(ONE_CORE) $(BIN)/python -m pytest -m soak -s tests/hardware

# The rest, two at a time, as most wait for devices.
soak-together: .venv/installed .venv-tactile-cluster/installed .venv-tactile-dslr/installed
	for name in tactile-cluster tactile-dslr; do TACTILE_SOAK=$(SOAK) .venv-$$name/bin/python -m pytest -m soak -rP plugins/$$name || exit; done
	TACTILE_SOAK=$(SOAK) $(ONE_CORE) $(BIN)/python -m pytest --numprocesses 2 --dist worksteal -m soak -rP --ignore=tests/hardware

# Thousands of bad inputs and faults; FUZZ='--seed 7' tries others, '--case ID' one of them again.
fuzz: .venv/installed
	$(ONE_CORE) PYTHONPATH=tests $(BIN)/python -m fuzz $(FUZZ)

# Makes small mistakes, one by one, in a copy of the tree; fails if the tests miss one.
mutants: .venv/installed
	PYTHONPATH=tests $(BIN)/python -m mutants $(if $(ONLY),--only $(ONLY))

bench: .venv/installed
	$(ONE_CORE) $(BIN)/python -m pytest $(TIMED)
	$(ONE_CORE) $(BIN)/python benchmarks/bench_sim.py

# The site, in site/; open site/index.html.
docs: .venv/docs-installed
	$(BIN)/python docs/building/stage_site.py
	$(BIN)/zensical build --strict --clean --config-file build/docs/mkdocs.yml
	rm -rf site && mv build/docs/site site

wheels: .venv/installed
	rm -rf dist
	for d in . $(PLUGINS); do $(BIN)/python -m build --wheel --no-isolation --outdir dist $$d || exit; done

# Installs each wheel alone with its dependencies into an empty environment elsewhere and tries it there, then all of the README's together.
try-wheels: wheels
	.ci/try-wheels $(SHIPPED) $(OTHERS)

.venv/installed: pyproject.toml $(SHIPPED:%=%/pyproject.toml)
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -e '.[dev]' $(SHIPPED:%=-e %)
	touch $@

$(OTHERS:plugins/%=.venv-%/installed): .venv-%/installed: .venv/installed plugins/%/pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(BIN)/uv venv --quiet --clear --no-python-downloads --python $(PYTHON) .venv-$*
	$(BIN)/uv pip install --quiet --python .venv-$* -e '.[tests,record]' $(SHIPPED:%=-e %) -e plugins/$*
	touch $@

# LeRobot takes another PyTorch than it needs to read a data set, hence without its dependencies.
.venv-lerobot/installed: plugins/tactile-lerobot/tests/reader/requirements.txt
	$(PYTHON) -m venv .venv-lerobot
	.venv-lerobot/bin/python -m pip install --quiet --disable-pip-version-check 'torch==2.13.0'
	.venv-lerobot/bin/python -m pip install --quiet --disable-pip-version-check --no-deps 'lerobot==0.4.4' 'torchvision==0.28.0'
	.venv-lerobot/bin/python -m pip install --quiet --disable-pip-version-check -r plugins/tactile-lerobot/tests/reader/requirements.txt
	touch $@

# LeRobot 0.6 needs Python 3.12; its tests are skipped with a reason where that is not installed.
.venv-lerobot-3.12/installed: export PATH := $(PATH):$(PYENV)
.venv-lerobot-3.12/installed: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	if $(BIN)/uv python find --quiet --no-python-downloads 3.12 >/dev/null 2>&1; then \
	    $(BIN)/uv venv --quiet --clear --no-python-downloads --python 3.12 .venv-lerobot-3.12 && \
	    $(BIN)/uv pip install --quiet --python .venv-lerobot-3.12 'lerobot[dataset]>=0.6,<0.7' && \
	    touch $@; \
	else echo "LeRobot 0.6: not run, as Python 3.12 is not installed"; fi

.venv-oldest/installed: pyproject.toml $(SHIPPED:%=%/pyproject.toml)
	$(PYTHON) -m venv .venv-oldest
	.venv-oldest/bin/python -m pip install --quiet --disable-pip-version-check uv
	.venv-oldest/bin/uv pip install --quiet --python .venv-oldest --resolution lowest-direct -e '.[dev]' $(SHIPPED:%=-e %)
	touch $@

.venv/docs-installed: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	touch $@

clean:
	rm -rf .venv .venv-* demo dist site
