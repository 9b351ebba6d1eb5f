#!/usr/bin/env bash
# Prints the folder of MeshLab's headers of one version; downloads them first, into the cache, unless they are there.
# Usage: tools/meshlab_source.sh 2020.09|2022.02|2025.07
# They come from Debian's source packages, by apt-get from the mirror this machine itself uses, checked by apt. Nobody has to be
# root, and the machine's own apt is not touched.
set -euo pipefail
. "$(dirname "$0")/lib.sh"

version=${1:?usage: tools/meshlab_source.sh 2020.09|2022.02|2025.07}
case $version in
    2020.09) suite=bookworm ;;
    2022.02) suite=trixie ;;
    2025.07) suite=sid ;;
    *) die "no release of Debian has the sources of MeshLab $version: 2020.09, 2022.02 and 2025.07 can be had" ;;
esac

folder=$cache/meshlab/$version
if [ ! -e "$folder/.complete" ]; then
    lock "meshlab-$version"
    if [ ! -e "$folder/.complete" ]; then
        for program in apt-get xz dpkg; do
            command -v $program >/dev/null || die "$program is missing: MeshLab's headers come from Debian's source packages"
        done
        keys=/usr/share/keyrings/debian-archive-keyring.gpg
        [ -f $keys ] || die "$keys is missing: apt-get install debian-archive-keyring"
        mirror=${DEBIAN_MIRROR:-$(apt-get indextargets --format '$(SITE) $(ORIGIN) $(COMPONENT)' 'Created-By: Packages' |
            awk '$2 == "Debian" && $3 == "main" && $1 !~ /security/ { print $1; exit }')}
        : "${mirror:=http://deb.debian.org/debian}"
        say "getting the headers of MeshLab $version"
        apt=$cache/meshlab/apt-$suite
        rm -rf "$folder" "$apt"
        mkdir -p "$folder" "$apt/lists/partial" "$apt/archives/partial" "$apt/download"
        echo "deb-src [signed-by=$keys] $mirror $suite main" >"$apt/sources.list"
        options=(-qq -o "Dir::Etc::sourcelist=$apt/sources.list" -o Dir::Etc::sourceparts=/dev/null
            -o "Dir::State::Lists=$apt/lists" -o "Dir::Cache=$apt" -o APT::Sandbox::User=root)
        cd "$apt/download"
        retry apt-get "${options[@]}" update || die "MeshLab $version: $mirror does not answer for $suite"
        retry apt-get "${options[@]}" source --tar-only --download-only meshlab ||
            die "MeshLab $version: $mirror has no sources of it in $suite"
        tar xf meshlab_*.orig.tar.xz -C "$folder" --strip-components=1 --wildcards \
            '*/src/common/*' '*/src/vcglib/*' '*/vcglib/*' '*ML_VERSION' 2>/dev/null || true
        cd "$root"
        rm -rf "$apt"
        # A release of Debian moves on: what it has today may be another version.
        found=$(ls "$folder" >/dev/null && cat "$folder/ML_VERSION" 2>/dev/null || echo "$version")
        [ -f "$folder/src/common/mlexception.h" ] || die "MeshLab $version: the sources are not as expected"
        [ "$found" = "$version" ] || die "MeshLab $version can't be had: $suite now has $found"
        touch "$folder/.complete"
    fi
fi
echo "$folder"
