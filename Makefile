# One verb a line. Everything that a bare Debian 12 with Rust and Node.js lacks is installed by `make setup`, which the others call.

.DEFAULT_GOAL := help
.PHONY: help run test lint bench lab format setup web samples docker clean

APT := libopencv-core-dev libopencv-calib3d-dev libopencv-imgcodecs-dev libopencv-imgproc-dev libopencv-features2d-dev \
       libopencv-videoio-dev libopencv-flann-dev clang libclang-dev libnetcdf-dev libsqlite3-dev pkg-config
APT_TEST := chromium python3-venv
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)
PYTHON := target/venv/bin/python
# Ground stations' libraries that know nothing of Halcyon, as its judges.
STACKS := pymavlink==2.4.50 mavsdk==4.1.0

help: ## this list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

run: build ## build, and fly the simulated fleet: dashboard at http://127.0.0.1:8080
	target/debug/halcyon up --auto-approve

test: build setup-test samples ## every test, browser tests in headless Chromium included
	cargo test --workspace --no-fail-fast
	cd web && npm run --silent check && npm test --silent

lab: build samples ## the thesis's tables and figures, its values beside ours: lab/index.html
	target/debug/halcyon lab --out lab

bench: build samples ## speed and exactness beside OpenCV, then each step of the chain by criterion
	target/debug/halcyon bench
	cargo bench --profile dev --workspace --bench chain --bench waves --bench guidance --bench patch

lint: setup ## formatting, clippy and types
	cargo fmt --all --check
	cargo clippy --workspace --all-targets -- -D warnings
	cd web && npm run --silent check

format: ## format the Rust code
	cargo fmt --all

setup: ## install what is missing: system packages, npm packages
	@sh tests/setup.sh "$(SUDO)" $(APT)
	@test web/node_modules/.package-lock.json -nt web/package-lock.json || (cd web && npm ci --no-audit --no-fund)

setup-test:
	@sh tests/setup.sh "$(SUDO)" $(APT_TEST)
	@test -x $(PYTHON) || python3 -m venv target/venv
	@$(PYTHON) -c 'import importlib.metadata as m; exit(any(m.version(p) != v for p, v in (q.split("==") for q in "$(STACKS)".split())))' 2>/dev/null \
		|| target/venv/bin/pip install --quiet --disable-pip-version-check $(STACKS)

web: setup ## build the dashboard
	cd web && npm run --silent build

.PHONY: build setup-test
build: web
	cargo build --workspace --bins

samples: ## OpenCV's public sample pictures into samples/
	@sh tests/samples.sh samples

docker: build ## the fleet's image; BASE is the image to build on
	sh tests/docker.sh

clean: ## remove what was built
	cargo clean
	rm -rf web/dist web/node_modules samples
