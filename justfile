# What is done often. `just` lists it; each line also runs by hand.

_default:
    @just --list

# Unit tests and what is fast: before every commit.
test:
    cargo test

# All tests, as the README says.
test-all:
    cargo test --workspace --release

# Recordings in Parquet and MATLAB files, which most do without.
test-formats:
    cargo test --release -p column-source --all-features

# The format; the effects' modules come out of a list, so that `cargo fmt` does not see them.
fmt:
    cargo fmt --all
    rustfmt --edition 2024 crates/valve-model/src/effects/*.rs

# What CI looks at beside the tests.
check:
    cargo fmt --all --check
    rustfmt --edition 2024 --check crates/valve-model/src/effects/*.rs
    cargo clippy --workspace --all-targets -- -D warnings
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps
    typos
    cargo deny check

# Snapshots that a change is meant to change; read the diff afterwards.
snapshots:
    INSTA_UPDATE=always cargo test --release --test program

# Time of a step of the integrator, a cycle, tables, a fleet.
bench:
    cargo bench --bench simulation

# Other people's solvers, searches and filters beside ours; `just peers cycle` for one comparison.
peers *names:
    cd benches/peers && cargo run --release --locked -- {{names}}

# Its own format, lints and tests, which CI leaves out.
check-peers:
    cd benches/peers && cargo fmt --check && cargo clippy --all-targets --release --locked -- -D warnings && cargo test --release --locked

# Campaigns with hidden physics, answered and counted.
score cases="30":
    cargo build --release
    cargo run --release -p blind-score -- --world tidy,laboratory,plant --cases {{cases}} --program target/release/valve
