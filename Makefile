# Two commands do everything: `make demo` runs the main job, `make test` checks the project.
# Each makes its virtual environment when there is none.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: demo test docs bench proof results pictures compiled pure clean

demo: $(VENV)/.view
	$(BIN)/mavherd run crossing-targets --speed 3

test: $(VENV)/.test pure  # tests replace what compiled modules do not let go of
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/mypy benchmarks docs
	$(BIN)/python -m pytest -n 3 --dist loadfile  # most tests wait for vehicles, not for the processor

docs: $(VENV)/.test
	$(BIN)/python docs/make_mavlink.py
	$(BIN)/python docs/make_parameters.py

bench: $(VENV)/.test
	$(BIN)/python benchmarks/run.py

proof: $(VENV)/.test
	$(BIN)/python benchmarks/determinism.py

results: $(VENV)/.test
	$(BIN)/python docs/make_results.py

pictures: $(VENV)/.test  # those in a browser need chromium, those of Rerun mesa-vulkan-drivers or a GPU
	$(BIN)/python docs/make_pictures.py

compiled: $(VENV)/.test pure
	$(BIN)/python setup.py --quiet build_ext --inplace
	@$(BIN)/mavherd version

pure:
	find -L src -name '*.so' -delete

clean: pure
	rm -rf $(VENV) build dist src/*.egg-info

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "mavherd needs Python 3.11 or newer; run: make $(MAKECMDGOALS) PYTHON=python3.12"; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.view: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[view]'
	@touch $@

$(VENV)/.test: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[view,test]'
	@touch $@ $(VENV)/.view
