# Shared by ./run and ./test (sourced, bash only): installs what is missing, configures and builds.
# Needs nothing but bash, dpkg and apt-get before the installation.

say() { printf '%s\n' "$*" >&2; }
die() { local code=$1; shift; say "error: $*"; exit "$code"; }

# a bare root may have neither a locale nor a home
if [ -z "${LC_ALL:-}${LANG:-}" ]; then export LC_ALL=C.UTF-8; fi
if [ -z "${HOME:-}" ]; then HOME=$(cd ~ 2>/dev/null && pwd || echo /tmp); export HOME; fi

# install_missing ROOT: apt-get installs the packages of ROOT/packages.txt that are not there.
install_missing() {
  local root=$1 line name reason installed
  local -a wanted=() missing=() reasons=()
  while IFS= read -r line || [ -n "$line" ]; do
    name=${line%%#*}; name=${name//[[:space:]]/}
    [ -n "$name" ] || continue
    reason=""; case $line in *'#'*) reason=${line#*#}; reason=${reason#"${reason%%[![:space:]]*}"};; esac
    wanted+=("$name"); reasons+=("$reason")
  done < "$root/packages.txt"

  command -v dpkg-query >/dev/null ||
    die 3 "this is not a Debian system (no dpkg-query): install what packages.txt lists, then use --no-install"
  # dpkg-query complains about every package that it does not know
  installed=$'\n'$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null || true)$'\n'
  local i
  local -a lines=()
  for i in "${!wanted[@]}"; do
    case $installed in *$'\n'"installed ${wanted[$i]}"$'\n'*) continue;; esac
    missing+=("${wanted[$i]}"); lines+=("$(printf '  %-26s %s' "${wanted[$i]}" "${reasons[$i]}")")
  done
  [ ${#missing[@]} -gt 0 ] || return 0

  say "installing ${#missing[@]} Debian packages that nido builds and runs with, some minutes (--no-install skips this):"
  printf '%s\n' "${lines[@]}" >&2
  local -a as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die 3 "packages are missing and there is no sudo: as root, run: apt-get install ${missing[*]}"
    as_root=(sudo)
  fi
  local log
  log=$(mktemp) || die 1 "no temporary file can be made"
  local -a apt=(env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=900 -o Dpkg::Use-Pty=0 -qq)
  # ${a[@]+...}: an empty array is no unset variable
  if ! "${as_root[@]+"${as_root[@]}"}" "${apt[@]}" update > "$log" 2>&1; then
    cat "$log" >&2; rm -f "$log"
    die 3 "apt-get update failed: see above; is there a network and a line in /etc/apt/sources.list?"
  fi
  if ! "${as_root[@]+"${as_root[@]}"}" "${apt[@]}" install -y --no-install-recommends "${missing[@]}" > "$log" 2>&1 < /dev/null; then
    tail -n 40 "$log" >&2; rm -f "$log"
    die 3 "apt-get could not install the packages: see above"
  fi
  rm -f "$log"
  say "installed."
}

# run_ninja BUILD TARGET...: builds; a moving line on a terminal, a line each tenth elsewhere, the compiler's words on failure.
run_ninja() {
  local build=$1; shift
  local log=$build/build.log jobs memory_kb line shown=0 tenth
  jobs=$(nproc 2>/dev/null || echo 2)
  # a compiler takes up to 1 GB: no more of them than fit
  memory_kb=$(sed -n 's/^MemAvailable: *\([0-9]*\) kB/\1/p' /proc/meminfo 2>/dev/null) || memory_kb=
  if [ -n "$memory_kb" ] && [ $((memory_kb / 1000000)) -lt "$jobs" ]; then jobs=$((memory_kb / 1000000)); fi
  [ "$jobs" -ge 1 ] || jobs=1
  local started=$SECONDS status=0
  NINJA_STATUS='[%f/%t] ' ninja -C "$build" -j "$jobs" "$@" 2>&1 | tee "$log" | while IFS= read -r line; do
    if [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]]; then
      if [ -t 2 ]; then
        printf '\rbuilding: %s of %s ' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >&2; shown=1
      elif [ "${BASH_REMATCH[2]}" -ge 10 ]; then
        if [ "$shown" -eq 0 ]; then shown=1; say "building ${BASH_REMATCH[2]} parts ..."; fi
        tenth=$((10 * BASH_REMATCH[1] / BASH_REMATCH[2]))
        if [ "$tenth" -gt "$shown" ]; then
          shown=$tenth; say "building: ${BASH_REMATCH[1]} of ${BASH_REMATCH[2]}"
        fi
      fi
    fi
  done || status=$?
  if [ -t 2 ] && grep -q '^\[' "$log"; then printf '\r%60s\r' '' >&2; fi
  if [ "$status" -ne 0 ]; then
    sed -n '/^FAILED:/,$p' "$log" | head -n 60 >&2
    grep -q '^FAILED:' "$log" || tail -n 30 "$log" >&2
    die 1 "the build failed: see above; all of it is in $log"
  fi
  if grep -q '^\[' "$log"; then say "built in $((SECONDS - started)) s."; fi
}

# build ROOT TARGET...: configures ROOT/build (Release, Ninja) when that was not done, then brings the targets up to date.
build() {
  local root=$1; shift
  local folder=$root/build
  mkdir -p "$folder" || die 1 "cannot make $folder"
  command -v cmake >/dev/null && command -v ninja >/dev/null ||
    die 3 "cmake and ninja are not there: leave out --no-install, or install what packages.txt lists"
  (
    # two runs at once: the second waits for the first one's build
    flock 9
    if [ -f "$folder/CMakeCache.txt" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$folder/CMakeCache.txt"; then
      say "the source tree was moved: configuring anew"
      rm -rf "$folder/CMakeCache.txt" "$folder/CMakeFiles" "$folder/build.ninja"
    fi
    if [ ! -f "$folder/build.ninja" ]; then
      say "configuring (Release) ..."
      cmake -S "$root" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release > "$folder/configure.log" 2>&1 || {
        tail -n 40 "$folder/configure.log" >&2
        rm -f "$folder/build.ninja"
        die 3 "the configuration failed: see above; all of it is in $folder/configure.log"
      }
    fi
    if [ $# -eq 0 ]; then
      # everything but the tests
      local room
      for room in msgs interfaces kinematics middleware simulator nodes; do
        if [ -f "$root/$room/CMakeLists.txt" ]; then set -- "$@" "$room/all"; fi
      done
    fi
    run_ninja "$folder" "$@"
  ) 9> "$folder/.lock" || exit $?
}
