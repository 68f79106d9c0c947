#!/usr/bin/env bash
# usage: install_test.sh SOURCE BUILD: installs into a folder of its own; the app runs from there, and a node is written against it.
set -euo pipefail
source_dir=$1 build=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix
fail() { echo "FAILED: $*"; exit 1; }

cmake --install "$build" --prefix "$prefix" > "$work/install.log" || fail "$(tail "$work/install.log")"
for file in bin/nido bin/nido-janitor bin/nido-recorder share/nido/config/apps/speech_and_action.yaml \
  share/bash-completion/completions/nido share/zsh/site-functions/_nido; do
  [ -e "$prefix/$file" ] || fail "$file is not installed"
done

env -i PATH=/usr/bin:/bin PYTHONPATH="$(echo "$prefix"/lib/python3*/dist-packages)" python3 -B -c \
  'import nido; from nido import system; print(system._find_gateway())' > "$work/gateway.txt" 2>&1 || { cat "$work/gateway.txt"; fail "the Python client is not installed"; }
grep -q "$prefix/bin/nido-gateway" "$work/gateway.txt" || { cat "$work/gateway.txt"; fail "the Python client does not find its gateway"; }

# the environment and the folder of somebody else; 27: a domain of this test's own
cd "$work"
nido() { env -i PATH=/usr/bin:/bin HOME="$work" ROS_DOMAIN_ID=27 "$prefix/bin/nido" "$@"; }
nido doctor --json > doctor.json || { cat doctor.json; fail "the doctor finds fault with the installation"; }
code=0
nido launch speech_and_action --for 0.5 --out run --record run.mcap > run.log 2>&1 || code=$?
[ $code -eq 1 ] && grep -q "no outcome within 0.5 s" run.log || { cat run.log; fail "the app did not run"; }
if grep -rq "$source_dir/config" run; then fail "the run used files of the source tree"; fi
grep -rq "$prefix/share/nido/config" run || fail "the run did not use the installed config"
nido replay run.mcap --info > info.txt
grep -q "/icubSim/head/state:o" info.txt || fail "the run was not recorded"

mkdir doubler
cat > doubler/CMakeLists.txt <<'LISTS'
cmake_minimum_required(VERSION 3.25)
project(doubler LANGUAGES C CXX)
set(CMAKE_CXX_STANDARD 20)
find_package(nido REQUIRED)
add_executable(doubler doubler.cpp)
target_link_libraries(doubler PRIVATE nido::middleware)
nido_messages(lab_messages lab.idl)
add_executable(lab_node lab_node.cpp)
target_link_libraries(lab_node PRIVATE nido::middleware nido::value_message lab_messages)
LISTS
cp "$source_dir/tests/cli/lab.idl" "$source_dir/tests/cli/lab_node.cpp" doubler/
# the first program of docs/ports.md
awk '/^```cpp$/{on=1;next} /^```$/{if(on)exit} on' "$source_dir/docs/ports.md" > doubler/doubler.cpp
cmake -S doubler -B doubler/build -DCMAKE_PREFIX_PATH="$prefix" > doubler.log 2>&1 &&
  cmake --build doubler/build >> doubler.log 2>&1 || { tail -30 doubler.log; fail "a node cannot be built"; }
env ROS_DOMAIN_ID=27 doubler/build/doubler > doubler.out 2>&1 &
doubler=$!
trap 'kill $doubler 2> /dev/null || true; rm -rf "$work"' EXIT
nido port info /doubler/twice:o --wait 20 > port.txt 2>&1 || true
grep -q "sensor_msgs/msg/JointState" port.txt || { cat doubler.out port.txt; fail "the node's port is not there"; }
env ROS_DOMAIN_ID=27 doubler/build/lab_node > lab.out 2>&1 &
lab=$!
trap 'kill $doubler $lab 2> /dev/null || true; rm -rf "$work"' EXIT
nido port read /lab/packet:o --count 1 --wait 20 --json > packet.txt 2>&1 || true
grep -q '"label":"left"' packet.txt || { cat lab.out packet.txt; fail "a message of the node's own cannot be read"; }
echo "installed, launched, recorded, built against"
