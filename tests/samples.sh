#!/bin/sh
# OpenCV's public sample pictures, from Debian's opencv-doc, into a folder: samples.sh FOLDER
# The package is unpacked, not installed: slim systems leave out documentation when they install.
set -eu
folder=$1
[ -f "$folder/aloeGT.png" ] && [ -f "$folder/right14.jpg" ] && exit 0
mkdir -p "$folder"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
chmod 755 "$work"
cd "$work"
apt-get download -qq opencv-doc 2>/dev/null || { ${SUDO:-} apt-get update -qq && apt-get download -qq opencv-doc; }
dpkg-deb -x opencv-doc_*.deb unpacked
cd - >/dev/null
data=$work/unpacked/usr/share/doc/opencv-doc/examples/data
for file in "$data"/left[0-9]*.jpg* "$data"/right[0-9]*.jpg* "$data"/aloe*; do
    case "$file" in
        *.gz) gunzip -c "$file" > "$folder/$(basename "$file" .gz)" ;;
        *) cp "$file" "$folder/" ;;
    esac
done
[ -f "$folder/aloeGT.png" ] && [ -f "$folder/right14.jpg" ] || { echo "error: opencv-doc holds no sample pictures" >&2; exit 1; }
echo "sample pictures are in $folder/"
