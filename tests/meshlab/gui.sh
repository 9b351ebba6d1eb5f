#!/usr/bin/env bash
# A user at MeshLab's window: opens a file, finds a filter by its name, presses Apply. No hands, no display.
# Usage: gui.sh MESHLAB FILE FILTER PICTURES     runs inside xvfb-run; ends with 0 if MeshLab's log says that it applied the filter
set -u
meshlab=$1 file=$2 filter=$3 pictures=$4
mkdir -p "$pictures" "$HOME/.config/VCG"
# From 2022.02 on MeshLab asks once whether it may send statistics.
for precision in fp dp; do
    printf '[General]\ninformativeShown=true\n' >"$HOME/.config/VCG/MeshLab_64bit_$precision.conf"
done
log=$pictures/meshlab.log
openbox >/dev/null 2>&1 &
manager=$!
"$meshlab" "$file" >"$log" 2>&1 &
program=$!
trap 'kill $program $manager 2>/dev/null' EXIT

# The id of a window whose title matches, once there is one.
window() {
    local found
    for _ in $(seq 120); do
        found=$(xdotool search --onlyvisible --name "$1" 2>/dev/null | tail -1)
        [ -n "$found" ] && { echo "$found"; return 0; }
        sleep 0.5
    done
    return 1
}
picture() { import -window root "$pictures/$1.png"; }

main=$(window '^MeshLab 20') || { echo "MeshLab shows no window"; picture none; exit 1; }
sleep 4
xdotool windowactivate --sync "$main"
xdotool key ctrl+f
sleep 1
xdotool type --delay 40 "$filter"
sleep 2
xdotool key Down
sleep 1
xdotool key Return
dialog=$(window "^$filter\$") || { echo "no dialog of $filter"; picture no-dialog; exit 1; }
sleep 2
picture dialog
eval "$(xdotool getwindowgeometry --shell "$dialog")"
# Apply is the button at the bottom, to the right.
xdotool mousemove $((X + WIDTH * 3 / 4)) $((Y + HEIGHT - 21)) click 1
for _ in $(seq 120); do
    if grep -q "Applied filter:\? *$filter" "$log"; then
        sleep 2
        picture applied
        exit 0
    fi
    sleep 0.5
done
picture not-applied
echo "the filter was not applied"
exit 1
