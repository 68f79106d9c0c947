#!/bin/bash
# The whole app in lockstep, recorded, with a snapshot at 15 s; then a new robot process that goes on from there, with
# what the other nodes said in the recording: states and pictures until the end have to be the same, bit for bit.
# half_way_test.sh BIN DOMAIN
set -eu
bin=$1
domain=$2
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
"$bin/nido" launch speech_and_action --lockstep --rate max --seed 7 --domain "$domain" --out "$dir/run" \
  --record "$dir/run.mcap" --set robot.snapshot_file="$dir/half.json" --set robot.snapshot_at_s=15
test -s "$dir/half.json"
"$bin/nido" launch continue --lockstep --rate max --seed 7 --domain "$domain" --out "$dir/again" \
  --record "$dir/again.mcap" --set robot.start_from="$dir/half.json" --set replayer.file="$dir/run.mcap"
# the phrase is done at 28.1 s; later the run's processes are being stopped
"$bin/nido" compare "$dir/run.mcap" "$dir/again.mcap" '/icubSim/*' /tf --except '/icubSim/mic:o' --from 15 --to 28.5
# and the comparison can fail: the second before is in one of the files only
if "$bin/nido" compare "$dir/run.mcap" "$dir/again.mcap" '/icubSim/*' --from 14 --to 28.5 >"$dir/other.txt"; then
  echo "a second that only the first has was not noticed"
  exit 1
fi
