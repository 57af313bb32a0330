#!/bin/sh
# Ends at once and leaves a helper behind in a session of its own.
setsid sh -c 'echo "0 $$" >"$1.part"; mv "$1.part" "$1"; exec sleep 600' sh "$1" >/dev/null 2>&1 &
while [ ! -e "$1" ]; do sleep 0.01; done
