#!/bin/sh
# An example of a program as a service: answers with the request and how often it was asked. It counts in the folder it
# runs in, and may write nowhere else under the unit.
set -eu
count=$(($(cat count 2>/dev/null || echo 0) + 1))
echo "$count" >count
printf '%s %d\n' "$1" "$count"
