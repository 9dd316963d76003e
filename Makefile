# Every target sets up what it needs first; on a fresh machine python3, make and a C++ compiler are enough.
.DEFAULT_GOAL := help
.PHONY: help setup demo test lint sanitize wheel wheel-test lock calibrate verify second-opinion bench generate picture clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /  \1\t/p' Makefile | expand -t 16

setup: ## system packages, .venv, extension: whatever is not there yet
	@.ci/setup

demo: setup ## grade a right and a wrong renderer
	@.venv/bin/oracle demo

test: setup ## all tests
	@.venv/bin/pytest -n auto

lint: setup ## ruff and mypy
	@.venv/bin/ruff check
	@.venv/bin/ruff format --check
	@.venv/bin/mypy

# The sanitized extension goes into a folder of its own, and -S keeps the editable install from hiding it. AddressSanitizer
# wants to be loaded first and, to see C++ exceptions, libstdc++ next. Uncaptured, as its reports end the process.
sanitize: setup ## the tracer's tests under AddressSanitizer and UndefinedBehaviorSanitizer
	@rm -rf build/sanitize/site
	@.venv/bin/python -m pip install -q --disable-pip-version-check --no-build-isolation --no-deps \
	    --target build/sanitize/site --config-settings=build-dir=build/sanitize/cmake --config-settings=install.strip=false \
	    --config-settings=cmake.build-type=RelWithDebInfo --config-settings=cmake.define.ORACLE_SANITIZE=ON .
	@packages=$$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))'); \
	compiler=$${CXX:-c++}; \
	ASAN_OPTIONS=detect_leaks=0 \
	LD_PRELOAD="$$($$compiler -print-file-name=libasan.so):$$($$compiler -print-file-name=libstdc++.so)" \
	PYTHONPATH="$(CURDIR)/build/sanitize/site:$$packages" \
	.venv/bin/python -SP -m pytest -p no:cacheprovider --capture=no -q tests/test_tracer.py tests/test_tracing.py \
	    tests/test_traced_samplers.py tests/test_traced_textures.py tests/test_traced_media.py \
	    tests/test_traced_light.py::test_a_diffuse_surface_reflects_the_light_of_every_emitter

# The wheel is made from the source archive, outside of the checkout. auditwheel puts Embree and TBB into it, and names the
# oldest system on which it runs.
wheel: setup ## dist/: the source archive and a wheel that brings Embree along; Linux
	@set -eu; folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; rm -rf dist; \
	{ .venv/bin/python -m build --no-isolation --outdir "$$folder" . && \
	    PATH="$(CURDIR)/.venv/bin:$$PATH" auditwheel repair --wheel-dir dist "$$folder"/*.whl; \
	} >"$$folder/log" 2>&1 || { cat "$$folder/log"; exit 1; }; \
	mv "$$folder"/*.tar.gz dist; du -h --apparent-size dist/*

wheel-test: wheel ## install the wheel where there is no Embree, and render with it
	@.venv/bin/pytest -v tests/wheel.py

lock: ## resolve requirements.lock anew
	@set -eu; folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; \
	python3 -m venv "$$folder"; "$$folder/bin/pip" install -q --disable-pip-version-check uv; \
	"$$folder/bin/uv" pip compile --quiet --upgrade --universal --python-version 3.11 --group dev --generate-hashes \
	    --no-annotate --no-emit-index-url --custom-compile-command 'make lock' --output-file requirements.lock pyproject.toml

calibrate: setup ## false alarms of the judge in both directions, by simulation; a quarter of an hour
	@PYTHONPATH=tests .venv/bin/python tests/calibration.py 200

COUNT ?= 20000
verify: setup ## every closed form against ball arithmetic in 20,000 configurations; four hours (COUNT=500: minutes)
	@PYTHONPATH=tests .venv/bin/python tests/verification.py $(COUNT)

second-opinion: setup ## render with Mitsuba what the tracer is compared with; most of an hour
	@PYTHONPATH=tests .venv/bin/python tests/second_opinion.py

bench: setup ## how fast the closed forms are; minutes
	@for script in benchmarks/*.py; do echo "== $$script"; .venv/bin/python $$script || exit 1; done

generate: setup ## rewrite the parts of docs that come from the code
	@.venv/bin/python docs/generate.py

# Chromium draws a page as a user sees it; nothing is loaded from anywhere.
picture: setup ## draw the README's picture of a report anew; needs chromium
	@set -eu; folder=$$(mktemp -d); trap 'rm -rf "$$folder"' EXIT; \
	.venv/bin/oracle demo --out "$$folder/demo" >"$$folder/log" || { cat "$$folder/log"; exit 1; }; \
	chromium --headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-sync \
	    --user-data-dir="$$folder/profile" --hide-scrollbars --window-size=1200,1250 \
	    --screenshot=docs/images/report.png "file://$$folder/demo/bugs/no-light-cosine/report.html" >/dev/null 2>&1

clean: ## remove .venv, builds and caches
	@rm -rf .venv build dist .hypothesis .mypy_cache .pytest_cache .ruff_cache
	@find . -name __pycache__ -prune -exec rm -rf {} +
