#!/usr/bin/env bash
# Hunts each rule that robot-agent/src/broken.rs breaks on purpose, and then each of their allocators as it ships, and prints the table of
# docs/HUNT.md. The results are in hunts/broken-rules/.
# Usage, from the top of the repository: analysis/hunts/broken-rules.sh [PLAN]
set -euo pipefail

plan=${1:-analysis/hunts/broken-rules.toml}
out=hunts/broken-rules
profile=${PROFILE:-release}
cargo build --quiet --locked --package launch --features broken-rules --profile "$profile" --bin alliance
program=${CARGO_TARGET_DIR:-target}/$([[ $profile == dev ]] && echo debug || echo "$profile")/alliance
mkdir -p "$out"

# Hunts an allocator with a broken rule, or with none, and prints the rows of the table.
hunt() {
    local allocator=$1 rule=$2 name=${2:-$1}
    sed "s/^allocators = .*/allocators = [\"$allocator\"]/" "$plan" >"$out/$name.toml"
    ALLIANCE_BROKEN_RULE=$rule "$program" hunt "$out/$name.toml" --out "$out/$name" 2>"$out/$name.log" || (($? == 1))
    python3 - "$out/$name/results.csv" "$name" <<'PYTHON'
import csv
import sys

for row in csv.DictReader(open(sys.argv[1])):
    found = row["found_in_run"] or f"none in {row['runs']}"
    cells = [f"`{sys.argv[2]}`", row["search"], found, row["violation"], row["faults_found"], row["faults_least"],
             row["robots_least"], f"`{row['least']}`" if row["least"] else ""]
    print("| " + " | ".join(cell or "–" for cell in cells) + " |")
PYTHON
}

echo "| rule | search | found in run | violation | faults found | faults left | robots left | least faults |"
echo "|---|---|---|---|---|---|---|---|"
sed -n 's/^    ("\(.*\)", "\(.*\)"),$/\1 \2/p' robot-agent/src/broken.rs | while read -r rule allocator; do
    hunt "$allocator" "$rule" </dev/null
done
for allocator in ble murdoch cbba acbba ssi pi hipc dhba grape l-alliance first-come nearest alliance; do
    hunt "$allocator" "" </dev/null
done
