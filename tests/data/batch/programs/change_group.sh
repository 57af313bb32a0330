#!/bin/sh
# As outlive.sh, with the helper in a process group of its own, as a shell with job control makes one.
set -m
sh -c 'trap "" TERM; while :; do sleep 1; done' &
set +m
echo "$$ $!" >"$1.part"
mv "$1.part" "$1"
trap '' TERM
while :; do sleep 1; done
