#!/bin/sh
# As many x as the request says, and one y on standard error.
head -c "$1" /dev/zero | tr '\0' x
echo y >&2
