# SPDX-License-Identifier: Apache-2.0
# For the tests here: a small scan whose stereo one program has done ($folder/one), the same one without maps ($folder/scan).
set -eu
polarscan="$1/bin/polarscan"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
options="--preset fast --rounds 2"

"$polarscan" --quiet simulate -o "$folder/input" --samples 1 --masks --known-poses --rings 30:10 --texture strong \
  --width 160 --height 128 2>"$folder/log" || { cat "$folder/log"; exit 1; }
"$polarscan" --quiet reconstruct "$folder/input" -o "$folder/one" $options --no-mesh 2>"$folder/log" || { cat "$folder/log"; exit 1; }
cp -r "$folder/one" "$folder/scan"
rm -rf "$folder/scan/dense/stereo"

maps() { (cd "$1/dense/stereo" && find . -name '*.bin' | sort | xargs sha256sum); }

# Whether the scan's maps are those of one program, byte for byte.
same_maps() {
  maps "$folder/one" >"$folder/one.sums"
  [ "$(wc -l <"$folder/one.sums")" -eq 20 ] || { echo "not 10 depth and 10 normal maps"; return 1; }
  maps "$folder/scan" | diff "$folder/one.sums" - || { echo "the maps differ"; return 1; }
}

# wait_until SECONDS COMMAND...
wait_until() {
  limit=$(($1 * 10)); shift
  while ! "$@"; do
    limit=$((limit - 1))
    [ $limit -gt 0 ] || { echo "in vain: $*"; return 1; }
    sleep 0.1
  done
}
