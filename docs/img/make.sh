#!/bin/sh
# Makes the pictures of runs in README.md and in the book anew. A test compares them with those in the repository:
#   docs/img/make.sh target/release/alliance [FOLDER]
# The screenshots need a browser and are made by docs/img/screenshots.mjs.
set -eu
alliance=$(realpath "$1")
docs=$(realpath "$(dirname "$0")/..")
images=$(realpath "${2:-$docs/img}")
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
cd "$work"

# The default mission, in which gold is killed at work.
cat > mission.toml <<'SCENARIO'
name = "waste-cleanup"
[waste]
[[faults.timeline]]
at_s = 109
fault.kill = "gold"
SCENARIO
"$alliance" run mission.toml --in-process --out run
"$alliance" export run --video "$images/gold-dies.gif" --from 60s --to 200s --speed 20x --fps 10 --width 640
"$alliance" export run --svg 130s
cp run/room-at-130s.svg "$images/room.svg"
"$alliance" report run --only gantt
cp run/report/gantt.svg "$images/report-gantt.svg"

"$alliance" run parker-box --in-process --out box
python3 "$docs/examples/parker_box.py" box "$images/parker-box.svg"
