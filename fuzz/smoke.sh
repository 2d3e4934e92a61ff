#!/bin/sh
# Runs fuzz targets one after the other: fuzz/smoke.sh [SECONDS [TARGET...]]
# Without arguments it runs all of them for 15 seconds each. It stops at the first finding.
set -eu
cd "$(dirname "$0")"

seconds=${1:-15}
[ $# -eq 0 ] || shift
[ $# -gt 0 ] || set -- judp fragments ra_node jtcp jserial local secure \
    service gateway capture generated dynamic jsidl_text

cargo +nightly run --quiet --bin seeds
for target in "$@"; do
    # Beside tests, at the lowest priority, the first input of a target took 46 s, which alone takes half a second.
    options="-timeout=300 -max_total_time=$seconds -print_final_stats=1 -verbosity=0 -print_funcs=0"
    [ ! -f "dictionaries/$target.dict" ] || options="$options -dict=dictionaries/$target.dict"
    echo "== $target for $seconds s"
    mkdir -p "corpus/$target"
    seeds=
    [ ! -d "seeds/$target" ] || seeds=seeds/$target
    # shellcheck disable=SC2086 # several options, and maybe no seeds
    cargo +nightly fuzz run "$target" "corpus/$target" $seeds -- $options
done
