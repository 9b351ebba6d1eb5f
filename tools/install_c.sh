#!/usr/bin/env bash
# Installs the C library: shared and static library, headers, pkg-config and CMake files.
# Usage: tools/install_c.sh PREFIX     DESTDIR is put before all paths, SURFRECON_PROFILE=dev takes another profile of cargo
set -euo pipefail
. "$(dirname "$0")/lib.sh"
prefix=${1:?usage: tools/install_c.sh PREFIX}
case $prefix in /*) ;; *) die "PREFIX must be an absolute path, got $prefix" ;; esac
cd "$root"

profile=${SURFRECON_PROFILE:-release}
folder=target/$([ "$profile" = dev ] && echo debug || echo "$profile")
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -1)
# What programs ask for when they are loaded: versions that differ in it may be installed beside each other.
compatible=${version%.*}
if [ "$(uname)" = Darwin ]; then
    file=libsurfrecon.$version.dylib named=libsurfrecon.$compatible.dylib plain=libsurfrecon.dylib
    name=-Wl,-install_name,$prefix/lib/$named private="-lc -lm"
else
    file=libsurfrecon.so.$version named=libsurfrecon.so.$compatible plain=libsurfrecon.so
    name=-Wl,-soname,$named private="-lgcc_s -lutil -lrt -lpthread -lm -ldl -lc"
fi

# The name is given here, not in each build: a library that is used where it was built has no links beside it.
cargo rustc --quiet --locked --profile "$profile" --package surfrecon-capi -- -C link-arg="$name"

to=${DESTDIR:-}$prefix
install -d "$to/lib/pkgconfig" "$to/include" "$to/share/cmake/surfrecon"
install -m 755 "$folder/$plain" "$to/lib/$file"
ln -sf "$file" "$to/lib/$named"
ln -sf "$file" "$to/lib/$plain"
install -m 644 "$folder/libsurfrecon.a" "$to/lib/"
install -m 644 c-api/include/* "$to/include/"
install -m 644 c-api/cmake/* "$to/share/cmake/surfrecon/"
cat >"$to/lib/pkgconfig/surfrecon.pc" <<END
prefix=$prefix
libdir=\${prefix}/lib
includedir=\${prefix}/include

Name: surfrecon
Description: Surfaces from range scans
Version: $version
Libs: -L\${libdir} -lsurfrecon
Libs.private: $private
Cflags: -I\${includedir}
END
say "installed under $prefix; programs find it with pkg-config surfrecon or find_package(surfrecon)"
