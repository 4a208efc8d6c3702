#!/usr/bin/env bash
# rustc for run.sh, as RUSTC_WRAPPER: the same code wherever the clone lies.
#
# The crates that are measured lie outside this workspace. Cargo hashes the absolute path of such a crate into its
# `-C metadata`, which goes into the names of all its symbols, and with other names the optimiser orders and inlines the
# functions differently. Name and version of the package tell the crates of an image apart as well.
#
# Cargo does not see a change of this file: remove the target folder after one.
exec "${@/#metadata=*/metadata=${CARGO_PKG_NAME:-}-${CARGO_PKG_VERSION:-}}"
