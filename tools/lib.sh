# Sourced by the scripts beside it: where things are kept, how to fail, how to try again.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# Downloads, virtual environments and tools live outside the tree, so that a second checkout or a `make clean` costs nothing.
cache=${SURFRECON_CACHE:-${XDG_CACHE_HOME:-${HOME:-~}/.cache}/surfrecon}
mkdir -p "$cache"

say() { echo "$(basename "$0"): $*" >&2; }
die() { say "$*"; exit 1; }

# Registries have hiccups: three tries, waiting longer each time.
retry() {
    local pause
    for pause in 5 20 0; do
        "$@" && return 0
        [ "$pause" = 0 ] || { say "failed, trying again in $pause s: $*"; sleep "$pause"; }
    done
    return 1
}

# Takes the lock open as descriptor 9; says so if that takes waiting.
wait_for_lock() {
    # On a system without locks, as macOS, one run at a time is the user's to see to.
    command -v flock >/dev/null || return 0
    flock -n 9 && return 0
    say "waiting for another run to finish with: $1"
    flock 9
}

# One process at a time prepares a thing; the others wait and then find it ready.
lock() {
    exec 9>"$cache/$1.lock"
    wait_for_lock "$1"
}

# Flags of rustc that keep folders of this machine out of what is compiled: they differ from build to build.
without_paths() {
    local pair flags=()
    for pair in "$root=surfrecon" "${CARGO_HOME:-$HOME/.cargo}=cargo" "$(rustc --print sysroot)=rust" "$cache=cache"; do
        # Bash on Windows has names of its own for folders.
        flags+=("--remap-path-prefix=$(cygpath -w "${pair%=*}" 2>/dev/null || echo "${pair%=*}")=${pair##*=}")
    done
    echo "${flags[*]}"
}
