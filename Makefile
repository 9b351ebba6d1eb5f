# `make help` lists the targets. Everything a target needs and the machine lacks is set up first, outside the tree:
# see tools/lib.sh for where, CONTRIBUTING.md for what. Targets that build wait for each other.

SHELL := /usr/bin/env bash
ALONE := tools/alone.sh
.DEFAULT_GOAL := help
.PHONY: help demo docs test test-gui test-windows test-arm64 release release-c check bench fuzz miri explore wheel extension meshlab-plugin install generate clean distclean

# Real scans for tests and benchmarks; without them these say which cases they skipped.
ifndef SURFRECON_DATA
  ifneq ($(wildcard ../shared/data),)
    export SURFRECON_DATA := $(abspath ../shared/data)
  endif
else
  export SURFRECON_DATA
endif

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-14s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: extension ## Scan a shape, merge the scans inside Blender, render: out/demo.*; SCANS=path/to/file.conf uses real scans, SHUFFLE=1 aligns them first, FRAMES=folder merges a phone's recording in its colours
	@SHUFFLE=$(SHUFFLE) FRAMES=$(FRAMES) $(ALONE) tools/demo.sh $(SCANS)

docs: ## Build the documentation site, which needs no network: out/docs/index.html
	@$(ALONE) bash -ec "tools/build_wheel.sh >/dev/null; tools/docs.sh out/docs"

test: ## Set up what is missing, then check and test what a change needs (Rust, C, Python, one Blender, one MeshLab); ALL=1 tests everything
	@tools/setup_apt.sh test
	@python=$$(tools/python.sh) && $(ALONE) "$$python" tools/run_tests.py $(if $(ALL),--all)

test-gui: extension ## Run the extension in the window of a real Blender (Debian 13, as root): pictures in out/gui/
	@$(ALONE) tools/test_gui.sh

test-windows: ## Run the tests of the core, C, Python and Blender as Windows' programs under Wine
	@python=$$(tools/python.sh) && $(ALONE) "$$python" tools/run_elsewhere.py windows

test-arm64: ## Run the tests in Python on Linux for arm64 under qemu
	@python=$$(tools/python.sh) && $(ALONE) "$$python" tools/run_elsewhere.py arm64

release: ## Build what a release consists of, for all systems: out/release/; PLATFORMS="windows-x64 ..." builds some
	@tools/setup_apt.sh
	@python=$$(tools/python.sh) && $(ALONE) "$$python" tools/release.py $(PLATFORMS)

release-c: ## The archive of the C library for this system alone: out/release/
	@python=$$(tools/python.sh) && $(ALONE) "$$python" tools/release.py --only c --native

check: ## Formatting, lints, documentation, licences of dependencies
	@tools/check.sh

bench: ## Run this library beside its peers on the same data: out/bench/*.json; ONLY=merge runs one benchmark, ALL=1 the heavy cases too
	@tools/setup_apt.sh bench
	@$(ALONE) bench/run.sh $(ONLY) $(if $(ALL),--all)

fuzz: ## Feed each reader damaged files for FUZZ_SECONDS=60
	@tools/fuzz.sh

miri: ## Watch each access to memory of what holds `unsafe`, in Miri; needs the nightly compiler
	@tools/miri.sh

explore: ## Run the property tests on inputs that none has seen yet, EXPLORE_ROUNDS=10 times
	@tools/explore.sh

wheel: ## Build the Python wheel: target/wheels/
	@$(ALONE) tools/build_wheel.sh

extension: ## Build the Blender extension with its wheel inside: out/extension/
	@tools/setup_apt.sh
	@python=$$(tools/python.sh) && $(ALONE) bash -ec 'tools/build_wheel.sh; "$$0" tools/build_extension.py' "$$python"

meshlab-plugin: ## Build the plugin for each MeshLab whose headers can be had: out/meshlab-plugin/VERSION-PRECISION/
	@tools/setup_apt.sh meshlab
	@$(ALONE) tools/build_meshlab_plugin.sh

install: ## Install the C library, its headers, pkg-config and CMake files: PREFIX=/usr/local
	@$(ALONE) tools/install_c.sh "$${PREFIX:-/usr/local}"

generate: ## Write what is generated from the code: the C header and its lists, what repeats parameters, PARAMETERS.md, fuzz seeds
	tools/crates.py
	cargo metadata --format-version 1 --manifest-path rust-core/fuzz/Cargo.toml > /dev/null
	SURFRECON_GENERATE=1 cargo test --quiet --package surfrecon-tests --test generated
	SURFRECON_GENERATE=1 cargo test --quiet --package surfrecon-tests --test c_library header::
	SURFRECON_GENERATE=1 cargo test --quiet --package surfrecon --test fuzz_seeds

clean: ## Remove everything built here
	cargo clean
	rm -rf out

distclean: clean ## Remove the cached downloads, environments and tools as well
	. tools/lib.sh && rm -rf "$$cache"
