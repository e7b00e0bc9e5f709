# Two commands matter: `make demo` and `make test`. Each makes its own environment from requirements.lock.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed
DOCS   := docs/derivation
SITE   := docs/_build/html

.PHONY: demo test quick coverage lint docs dist goldens lock clean fuzz bench bench-c2000ware bench-identify bench-isr bench-outputs bench-paper bench-verify

demo: $(STAMP)
	$(BIN)/dzdesign demo demo

test: lint
	$(BIN)/pytest --numprocesses auto --dist loadfile

# The quick half of the tests, two minutes on two cores: before every commit. Slow ones are marked `slow`.
quick: lint
	$(BIN)/pytest -m "not slow" --numprocesses auto --dist loadfile

# The tests once more, with the lines and branches of each file that no test runs in its own process.
coverage: $(STAMP)
	$(BIN)/pytest --numprocesses auto --dist loadfile --cov --cov-report=term

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/codespell

# After a change of what codegen writes: tests/goldens anew, then the tests that compile and run them. Read the diff.
goldens: $(STAMP)
	$(BIN)/pytest tests/codegen/test_goldens.py tests/core/test_schemas.py --update-goldens

# All benchmarks and one Markdown table of every limit: hours; `make bench BENCH=--quick` takes a quarter of one.
bench: $(VENV)/.bench
	$(BIN)/python benchmarks/run.py $(BENCH)

# Some three hours of one core, on all that there are; `make bench-identify BENCH=--quick` takes minutes.
bench-identify: $(VENV)/.bench
	$(BIN)/python benchmarks/identify/run.py $(BENCH)

$(VENV)/.bench: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[bench]'
	touch $@

# A minute or two; needs the simulators that .ci/run installs.
bench-isr: $(STAMP)
	$(BIN)/python benchmarks/isr/run.py

# Both C2000 targets against TI's headers, which are not ours to give: `make bench-c2000ware C2000WARE=FOLDER`.
bench-c2000ware: $(STAMP)
	DZDESIGN_C2000WARE="$(C2000WARE)" $(BIN)/pytest -q benchmarks/c2000ware

# Minutes, most of them for mutants; `make bench-verify BENCH=--quick` tries a part of those.
bench-verify: $(STAMP)
	$(BIN)/python benchmarks/verify/run.py $(BENCH)

# FMUs and, most of an hour, wrong function blocks and MATLAB functions; `make bench-outputs BENCH=--quick` tries some.
bench-outputs: $(VENV)/.bench
	$(BIN)/python benchmarks/outputs/run.py $(BENCH)

# Every wrong statement about the paper, and its reproduction twice: minutes. CI tries a drawn part.
bench-paper: $(STAMP)
	$(BIN)/python benchmarks/paper/run.py $(BENCH)

# Every reader against files that nobody meant; `make fuzz SECONDS=3600 SEED=2` goes on for an hour.
SECONDS ?= 180
SEED ?= 1
fuzz: $(VENV)/.fuzz
	$(BIN)/python benchmarks/fuzz/run_fuzz.py --seconds $(SECONDS) --seed $(SEED)
	DZDESIGN_FUZZ=5 DZDESIGN_SEED=$(SEED) $(BIN)/pytest -q tests/identify/reading/test_hostile_files.py

$(VENV)/.fuzz: $(STAMP)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation -e '.[fuzz]'
	touch $@

# The pages, in $(SITE), a warning an error; a part of them is the account of the paper as a page and for
# machines. Built, never committed.
docs: $(STAMP)
	mkdir -p $(DOCS)
	@echo "docs: the account of the paper's equations; then figures and pages: two minutes in all"
	$(BIN)/dzdesign derive --format html -o $(DOCS)/index.html
	$(BIN)/dzdesign derive --format json -o $(DOCS)/derivation.json
	OPENBLAS_NUM_THREADS=1 $(BIN)/sphinx-build -q -E -W --keep-going -b html docs $(SITE)
	@echo "docs: $(SITE)/index.html"

# A release in dist/: wheel, source package, list of components, pages and checksums; the same bytes from the same sources.
dist: docs
	$(BIN)/python -m release.distribution --pages $(SITE)

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("dzdesign needs Python 3.11 or newer; this is " + sys.version.split()[0] + ". Try: make PYTHON=python3.12") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $(STAMP)

# Re-resolve the ranges of pyproject.toml (needs uv); commit the result.
lock:
	uv pip compile pyproject.toml --extra test --extra docs --universal --python-version 3.11 \
	    --generate-hashes --no-annotate --no-header --quiet --upgrade -o requirements.lock

clean:
	rm -rf $(VENV) $(DOCS) docs/_build docs/_made build dist *.egg-info .pytest_cache .ruff_cache
